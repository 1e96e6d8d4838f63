"""MuJoCo asked about a document until it has nothing more to say.

MuJoCo stops at its first error. Here what it blames is made harmless in a copy and MuJoCo is asked again, so that all
faults are found at once, by the rules of the installed version rather than by rules written down a second time.
"""

from __future__ import annotations

import copy
import re
from dataclasses import dataclass, field

import mujoco

from aidsr.core.artifacts import Fault
from aidsr.mjcf.compiler_messages import Complaint, read_complaint
from aidsr.mjcf.location import Element, attributes, elements, load_fault
from aidsr.mjcf.read import canonical

__all__ = ["Answer", "ask_mujoco"]

_MAX_CHARACTERS = 4_000_000  # our choice: of all rounds together, about 1 s; 100 rounds for a robot of 40 KB

_ALWAYS_ACCEPTED: dict[str, dict[str, str]] = {"geom": {"size": "0.01"}, "joint": {}, "site": {}}
"""Attributes with which MuJoCo takes an element of this kind wherever it may stand."""
_A_MASS = {"pos": "0 0 0", "mass": "1", "diaginertia": "1 1 1"}


_CURES = {
    "joint_range_invalid": "write the smaller number first; the range of a ball joint begins with 0",
    "ctrlrange_invalid": "write the smaller number first",
    "tendon_path_invalid": "begin and end with a site, put a site on both sides of a geom, name no site twice in a row",
    "zero_mass": "give the body a geom with mass, or an <inertial>",
    "invalid_joint_placement": "a body has up to six degrees of freedom, a free joint only in a child of the world",
    "keyframe_size": "count the joints, or leave the keyframe out",
}


@dataclass(frozen=True, eq=False)
class Answer:
    """What MuJoCo makes of a document: either something built or faults."""

    built: tuple[mujoco.MjSpec, mujoco.MjModel] | None
    faults: tuple[Fault, ...]


def ask_mujoco(root: Element) -> Answer:
    """Parse and compile a document.

    Args:
        root: The document, free of anything forbidden; it is not changed.

    Raises:
        MemoryError: MuJoCo could not allocate what the model needs.
    """
    built = _build(canonical(root)[0])
    if not isinstance(built, Complaint):
        return Answer(built, ())
    tree = copy.deepcopy(root)
    read = dict(zip(tree.iter(), root.iter(), strict=True))
    changes = _Changes()
    faults: list[Fault] = []
    asked = 0
    while True:
        text, owners = canonical(tree)
        complaint = _build(text)
        if not isinstance(complaint, Complaint):
            return Answer(None, tuple(faults))
        culprit = _culprit(tree, owners, complaint)
        if not changes.explain(culprit, complaint):
            faults.append(_fault(read.get(culprit, root), complaint))
        asked += len(text)
        if culprit is tree or asked > _MAX_CHARACTERS:
            return Answer(None, tuple(faults))
        changes.make_harmless(culprit, complaint)


def _build(text: str) -> tuple[mujoco.MjSpec, mujoco.MjModel] | Complaint:
    """What MuJoCo builds of a text, or its first complaint; bodies are not fused, since they go by their names."""
    try:
        spec = mujoco.MjSpec.from_string(text)
        spec.compiler.fusestatic = False
        return spec, spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        return _complaint(error)


def _complaint(error: Exception) -> Complaint:
    if "allocate memory" in str(error):
        raise MemoryError(str(error)) from error
    return read_complaint(str(error))


def _culprit(tree: Element, owners: list[Element], complaint: Complaint) -> Element:
    """Return the element MuJoCo blames, or the root when it does not say."""
    if complaint.line:
        return owners[complaint.line - 1]
    keys = list(elements(tree, "key"))
    if complaint.code == "keyframe_size" and complaint.index is not None and complaint.index < len(keys):
        return keys[complaint.index]
    return tree


def _fault(element: Element, complaint: Complaint) -> Fault:
    names = complaint.quoted if complaint.code in {"undefined_reference", "missing_asset"} else ()
    return load_fault(complaint.code, element, complaint.problem, names=names, cure=_CURES.get(complaint.code, ""))


def _blamed(culprit: Element, complaint: Complaint) -> list[str]:
    """Return the attributes without which the complaint would not arise and others could still be heard."""
    if complaint.code not in {"bad_value", "unknown_attribute", "undefined_reference", "duplicate_name"}:
        return []
    names = {complaint.attribute, *re.findall(r"\w+", complaint.problem)}
    return [
        name
        for name, value in attributes(culprit)
        if name in names or (value in complaint.quoted and name != "name" and complaint.code != "duplicate_name")
    ]


@dataclass
class _Changes:
    """What was changed to get past earlier complaints, and which later ones follow from that."""

    altered: set[Element] = field(default_factory=set)
    """Elements of which nothing more is believed: emptied, or without something that stood in them."""
    weighed: set[Element] = field(default_factory=set)
    removed_attributes: set[tuple[Element, str]] = field(default_factory=set)
    unreferring: set[Element] = field(default_factory=set)
    """Elements that lost a name they refer to, and may now be told that they refer to nothing."""
    removed_names: set[str] = field(default_factory=set)

    def explain(self, culprit: Element, complaint: Complaint) -> bool:
        """Whether a complaint follows from a change made here rather than from the document."""
        return (
            culprit in self.altered
            or any(element is culprit and name in complaint.problem for element, name in self.removed_attributes)
            or (culprit in self.unreferring and complaint.code == "undefined_reference")
            or not self.removed_names.isdisjoint(complaint.quoted)
        )

    def make_harmless(self, culprit: Element, complaint: Complaint) -> None:
        """Change the culprit so that MuJoCo goes past it, keeping as much as possible for it to look at."""
        blamed = _blamed(culprit, complaint)
        if blamed:
            for name in blamed:
                del culprit.attrib[name]
                self.removed_attributes.add((culprit, name))
            if complaint.code == "undefined_reference":
                self.unreferring.add(culprit)
        elif complaint.code == "zero_mass" and culprit not in self.weighed:
            for inertial in culprit.findall("inertial"):
                culprit.remove(inertial)
            culprit.append(culprit.makeelement("inertial", _A_MASS))
            self.weighed.add(culprit)
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
