"""All errors of MuJoCo's compiler at once.

MuJoCo stops at its first error. Here the element it blames is neutralized in a copy, which is compiled again until no
error is left, so that all faults are found by the rules of the installed version rather than by a second set of rules.
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

_MAX_CHARACTERS = 4_000_000  # our choice: of all rounds together, about 1 s; 100 rounds for a robot of 40 KB

_ALWAYS_ACCEPTED: dict[str, dict[str, str]] = {"geom": {"size": "0.01"}, "joint": {}, "site": {}}
"""Attributes with which MuJoCo accepts an element of this kind anywhere."""
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
    """A document as MuJoCo compiled it, or the faults that keep it from being compiled."""

    built: tuple[mujoco.MjSpec, mujoco.MjModel] | None
    faults: tuple[Fault, ...]


def collect_compile_errors(root: Element) -> CompileResult:
    """Compile a document, or collect every error that MuJoCo has about it.

    Args:
        root: The document, free of anything forbidden; it is not changed.

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
    """Compile a text, or return MuJoCo's first message.

    Bodies are not fused, since they go by their names. Memory for contacts is MuJoCo's to choose: njmax and nconmax, of
    which it no longer needs to be told, can ask for gigabytes.
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
    """Return the element MuJoCo blames, or the root when it does not say."""
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
    """Return the attributes without which this message would not come, while others still could."""
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
    """What was changed to get past earlier messages, and which later messages follow from that."""

    altered: set[Element] = field(default_factory=set)
    """Elements whose messages are ignored from now on: emptied, or an element inside them was removed."""
    given_mass: set[Element] = field(default_factory=set)
    removed_attributes: set[tuple[Element, str]] = field(default_factory=set)
    without_reference: set[Element] = field(default_factory=set)
    """Elements that lost a name they refer to: MuJoCo may now report a missing reference."""
    removed_names: set[str] = field(default_factory=set)

    def explain(self, culprit: Element, message: CompilerMessage) -> bool:
        """Whether a message follows from a change made here rather than from the document."""
        return (
            culprit in self.altered
            or any(element is culprit and name in message.problem for element, name in self.removed_attributes)
            or (culprit in self.without_reference and message.code == "undefined_reference")
            or not self.removed_names.isdisjoint(message.quoted)
        )

    def neutralize(self, culprit: Element, message: CompilerMessage) -> None:
        """Change the culprit so that MuJoCo accepts it, keeping as much of it as possible to be checked."""
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
