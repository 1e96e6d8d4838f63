"""Collection of all errors that MuJoCo's compiler finds in a document.

MuJoCo stops at its first error. This module neutralizes the reported element in a copy of the document and compiles the
copy again, until there is no error left. All faults are thus found by the rules of the installed MuJoCo version, not by
a second implementation of these rules.
"""

from __future__ import annotations

import copy
import re
from dataclasses import dataclass, field

import mujoco

from aidsr.core.artifacts import Fault
from aidsr.mjcf.compiler_messages import CompilerMessage, parse_message
from aidsr.mjcf.elements import Element, attributes, elements, load_fault
from aidsr.mjcf.read import canonical

_MAX_CHARACTERS = 4_000_000  # compiled in all rounds together; our choice: about 1 s, 100 rounds for a robot of 40 KB

_ALWAYS_ACCEPTED: dict[str, dict[str, str]] = {"geom": {"size": "0.01"}, "joint": {}, "site": {}}
"""Attributes with which MuJoCo accepts an element of this kind in every place."""
_INERTIAL = {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"}


_CURES = {
    "joint_range_invalid": "write the smaller number first; the range of a ball joint begins with 0",
    "ctrlrange_invalid": "write the smaller number first",
    "tendon_path_invalid": "begin and end with a site, put a site on both sides of a geom, name no site twice in a row",
    "zero_mass": "give the body a geom with mass, or an <inertial>",
    "invalid_joint_placement": "a body has up to six degrees of freedom, a free joint only in a child of the world",
    "keyframe_size": "count the joints, or leave the keyframe out",
}


@dataclass(frozen=True, eq=False)
class CompileResult:
    """Result of compiling a document."""

    built: tuple[mujoco.MjSpec, mujoco.MjModel] | None
    """Specification and compiled model; None if the document does not compile."""
    faults: tuple[Fault, ...]
    """Faults that prevent the compilation."""


def collect_compile_errors(root: Element) -> CompileResult:
    """Compile a document, or collect every error that MuJoCo finds in it.

    Args:
        root: Root of a document that passed `check_safety`; it is not changed.

    Raises:
        MemoryError: MuJoCo could not allocate what the model needs.
    """
    built = _build(canonical(root)[0])
    if not isinstance(built, CompilerMessage):
        return CompileResult(built, ())
    tree = copy.deepcopy(root)
    read = dict(zip(tree.iter(), root.iter(), strict=True))
    changes = _Changes()
    faults: list[Fault] = []
    compiled_characters = 0
    while True:
        text, owners = canonical(tree)
        message = _build(text)
        if not isinstance(message, CompilerMessage):
            return CompileResult(None, tuple(faults))
        culprit = _culprit(tree, owners, message)
        if not changes.explain(culprit, message):
            faults.append(_fault(read.get(culprit, root), message))
        compiled_characters += len(text)
        if culprit is tree or compiled_characters > _MAX_CHARACTERS:
            return CompileResult(None, tuple(faults))
        changes.neutralize(culprit, message)


def _build(text: str) -> tuple[mujoco.MjSpec, mujoco.MjModel] | CompilerMessage:
    """Compile a text, or return MuJoCo's first error message.

    Static bodies are not fused, because the rest of the package refers to bodies by name. The settings njmax and
    nconmax are ignored: current MuJoCo versions do not need them, and they could reserve gigabytes.
    """
    try:
        spec = mujoco.MjSpec.from_string(text)
        spec.compiler.fusestatic = False
        spec.njmax = spec.nconmax = -1
        return spec, spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        return _message(error)


def _message(error: Exception) -> CompilerMessage:
    if "allocate memory" in str(error):
        raise MemoryError(str(error)) from error
    return parse_message(str(error))


def _culprit(tree: Element, owners: list[Element], message: CompilerMessage) -> Element:
    """Return the element that MuJoCo reports, or the root if the message does not name one."""
    if message.line:
        return owners[message.line - 1]
    keys = list(elements(tree, "key"))
    if message.code == "keyframe_size" and message.index is not None and message.index < len(keys):
        return keys[message.index]
    return tree


def _fault(element: Element, message: CompilerMessage) -> Fault:
    names = message.quoted if message.code in {"undefined_reference", "missing_asset"} else ()
    return load_fault(message.code, element, message.problem, names=names, cure=_CURES.get(message.code, ""))


def _blamed_attributes(culprit: Element, message: CompilerMessage) -> list[str]:
    """Return the attributes whose removal avoids this message and leaves the rest of the element to be checked."""
    if message.code not in {"bad_value", "unknown_attribute", "undefined_reference", "duplicate_name"}:
        return []
    names = {message.attribute, *re.findall(r"\w+", message.problem)}
    return [
        name
        for name, value in attributes(culprit)
        if name in names or (value in message.quoted and name != "name" and message.code != "duplicate_name")
    ]


@dataclass
class _Changes:
    """Changes made to get past earlier messages; later messages may be consequences of them."""

    altered: set[Element] = field(default_factory=set)
    """Elements whose further messages are ignored: their attributes were removed, or an element inside them was."""
    given_mass: set[Element] = field(default_factory=set)
    """Bodies to which an <inertial> was added."""
    removed_attributes: set[tuple[Element, str]] = field(default_factory=set)
    without_reference: set[Element] = field(default_factory=set)
    """Elements from which a reference was removed: MuJoCo may report the missing reference."""
    removed_names: set[str] = field(default_factory=set)
    """Names and classes of removed elements."""

    def explain(self, culprit: Element, message: CompilerMessage) -> bool:
        """Return whether a message is a consequence of these changes, not a fault of the document."""
        return (
            culprit in self.altered
            or any(element is culprit and name in message.problem for element, name in self.removed_attributes)
            or (culprit in self.without_reference and message.code == "undefined_reference")
            or not self.removed_names.isdisjoint(message.quoted)
        )

    def neutralize(self, culprit: Element, message: CompilerMessage) -> None:
        """Change the reported element so that MuJoCo accepts it, and keep as much of it as possible for checking."""
        attributes_blamed = _blamed_attributes(culprit, message)
        if attributes_blamed:
            for name in attributes_blamed:
                del culprit.attrib[name]
                self.removed_attributes.add((culprit, name))
            if message.code == "undefined_reference":
                self.without_reference.add(culprit)
        elif message.code == "zero_mass" and culprit not in self.given_mass:
            for inertial in culprit.findall("inertial"):
                culprit.remove(inertial)
            culprit.append(culprit.makeelement("inertial", _INERTIAL))
            self.given_mass.add(culprit)
        elif culprit.tag in _ALWAYS_ACCEPTED and culprit not in self.altered:
            kept = {name: value for name, value in attributes(culprit) if name == "name"}
            culprit.attrib.clear()
            for attribute, value in (kept | _ALWAYS_ACCEPTED[culprit.tag]).items():
                culprit.set(attribute, value)
            self.altered.add(culprit)
        else:
            self._remove(culprit)

    def _remove(self, culprit: Element) -> None:
        for element in elements(culprit):
            self.removed_names |= {element.get("name", ""), element.get("class", "")} - {""}
        self.altered.update(culprit.iterancestors())
        parent = culprit.getparent()
        if parent is not None:
            parent.remove(culprit)
