"""Designs from a robot that the user provides: its MJCF is kept, only its springs and forces are varied."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator

from aidsr.core.artifacts import Brief, Concept, Robot
from aidsr.core.errors import MjcfError
from aidsr.mjcf.edit import parse, scale_forces, scale_springs, to_text
from aidsr.mjcf.elements import Element
from aidsr.teams.rules.apply_feedback import WORDS, with_changes
from aidsr.teams.rules.families.family import Quantity
from aidsr.teams.rules.job import read_job

FAMILY = "own robot"

_Version = tuple[str, str, float, float]
"""Name, sentence, factor on stiffness and damping, factor on actuator forces."""

_AS_BROUGHT: _Version = ("as brought", "It is taken as it is.", 1.0, 1.0)
_CHANGES: tuple[_Version, ...] = (
    (
        "stiffer and stronger",
        "Its joint springs are {stiffness:.3g} times as stiff and its actuators {force:.3g} times as strong.",
        1.5,
        1.5,
    ),
    (
        "softer",
        "Its joint springs are {stiffness:.3g} times as stiff, so that the same actuators bend it further.",
        0.6,
        1.0,
    ),
    ("stronger", "Its actuators are {force:.3g} times as strong.", 1.0, 1.5),
)

_WORKING_NAMES = tuple(
    re.compile(words, re.IGNORECASE)
    for words in (r"end_?effector|tcp|grasp", r"tip", r"hook|pad|hand|palm|head|gripper")
)
"""Names that authors use for the part that does the work, the clearest first. Our choice."""


_FACTORS: dict[tuple[Quantity, ...], str] = {("stiffness",): "stiffness_factor", ("tension",): "force_factor"}
"""Quantities that feedback may refer to, with the parameter of a concept that scales each."""


def concepts(brief: Brief, count: int) -> tuple[Concept, ...]:
    """Return versions of the user's robot that differ in stiffness and strength; rules do not redesign it."""
    job = read_job(brief)
    part = functional_part(brief.starting_robot)
    return tuple(
        Concept(
            name=f"Own robot, {name}",
            interpretation=f"The robot was brought along; the job is to {job.kind}: {job.because}.",
            morphology=f"The MJCF that came with the brief. {sentence}",
            actuation="The actuators of that robot.",
            functional_part=part,
            family=FAMILY,
            parameters={"stiffness_factor": stiffness, "force_factor": force},
            rationale="The built-in rules vary and repair a given robot; they do not redesign it.",
        )
        for name, sentence, stiffness, force in itertools.islice(_versions(), count)
    )


def _versions() -> Iterator[_Version]:
    """Yield the robot as provided, then its changes without end, in each turn with larger factors."""
    yield _AS_BROUGHT
    for turn in itertools.count(1):
        for name, sentence, stiffness, force in _CHANGES:
            stiff, strong = stiffness**turn, force**turn
            label = f"{name} ({turn})" if turn > 1 else name
            yield label, sentence.format(stiffness=stiff, force=strong), stiff, strong


def revise(concept: Concept, feedback: str) -> Concept:
    """Return the concept with its two factors changed as far as the rules understand the feedback."""
    words, parameters, understood = feedback.lower(), dict(concept.parameters), []
    for pattern, quantities, factor in WORDS:
        match = re.search(pattern, words)
        if match and quantities in _FACTORS:
            name = _FACTORS[quantities]
            parameters[name] = parameters.get(name, 1.0) * factor
            understood.append(f'"{match.group()}" ({name} x {factor:g})')
    return with_changes(concept.model_copy(update={"parameters": parameters}), concept, feedback, understood)


def write(brief: Brief, concept: Concept) -> Robot:
    """Return the user's robot in the version of the concept; a text that is not MJCF is returned unchanged."""
    note = "The user's own robot, changed by the built-in rules only as the concept says."
    try:
        root = parse(brief.starting_robot)
    except MjcfError:
        return Robot(mjcf=brief.starting_robot, functional_part=concept.functional_part, notes=note)
    stiffness, force = (concept.parameters.get(name, 1.0) for name in ("stiffness_factor", "force_factor"))
    if stiffness != 1.0:
        scale_springs(root, stiffness)
    if force != 1.0:
        scale_forces(root, force)
    unchanged = stiffness == force == 1.0
    text = (
        brief.starting_robot
        if unchanged and _names(root, concept.functional_part)
        else to_text(_with_part(root, concept.functional_part))
    )
    return Robot(mjcf=text, functional_part=concept.functional_part, notes=note)


def functional_part(mjcf: str) -> str:
    """Return the name of the site or body that looks like the working end, else that of the deepest body.

    It is "working_end" if that body has no name, and empty if the document cannot be parsed or has no body.
    """
    try:
        root = parse(mjcf)
    except MjcfError:
        return ""
    for pattern in _WORKING_NAMES:
        for tag in ("site", "body"):
            names = [str(item.get("name")) for item in root.iter(tag) if pattern.search(item.get("name") or "")]
            if names:
                return min(names, key=len)
    deepest = _deepest(root)
    return "" if deepest is None else deepest.get("name") or "working_end"


def _deepest(root: Element) -> Element | None:
    return max(root.iter("body"), key=lambda body: sum(1 for _ in body.iterancestors("body")), default=None)


def _names(root: Element, name: str) -> bool:
    return any(item.get("name") == name for item in root.iter("site", "body"))


def _with_part(root: Element, name: str) -> Element:
    """Return the document with a name for the working end if its author gave it none."""
    deepest = _deepest(root)
    if name and deepest is not None and not _names(root, name):
        deepest.set("name", name)
    return root
