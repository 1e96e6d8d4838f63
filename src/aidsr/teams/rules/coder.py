"""The Coder as rules: it writes the MJCF of a family's robot, and repairs the MJCF of any robot by fault code."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Any

from aidsr.core.artifacts import Brief, Concept, CritiqueIssue, Fault, Robot, ValidationReport
from aidsr.core.errors import ReplyError, UserError
from aidsr.core.roles import Feedback
from aidsr.fixes import FixResult, fix
from aidsr.mjcf.kept_parts import changes_to_kept_parts
from aidsr.teams.rules import user_robot
from aidsr.teams.rules.families import Families, Family, load_families

_FALLS = ("free_fall", "base_not_attached")

_VARIATION = re.compile(r'<mujoco model="\w*?_variation_(\d+)"')


@dataclass(frozen=True)
class RuleCoder:
    """Writes and repairs robots without a language model.

    Attributes:
        families: Families whose robots it can write.
    """

    families: Families = field(default_factory=load_families)

    def write(self, brief: Brief, concept: Concept) -> Robot:
        """Return the robot of a concept's family and parameters, or the user's own robot.

        Raises:
            UserError: The concept is of a family that the built-in rules cannot write.
            ReplyError: The robot would change a part that the user wants to keep.
        """
        return _with_kept(brief, self._written(brief, concept))

    def _written(self, brief: Brief, concept: Concept) -> Robot:
        if concept.family == user_robot.FAMILY:
            return user_robot.write(brief, concept)
        if concept.family not in self.families:
            raise UserError(
                f"the built-in Coder cannot write the family {concept.family!r}; it knows {', '.join(self.families)}. "
                "Use concepts of the built-in Designer, or name a language model for the Coder"
            )
        return self.families[concept.family].write_concept(concept)

    def repair(self, brief: Brief, concept: Concept, robot: Robot, feedback: Feedback) -> Robot:
        """Return the robot with the reported faults repaired, or a reinforced one if there is no repair.

        A robot of another author for which there is no repair is left as it is.

        Raises:
            ReplyError: The repair would change a part that the user wants to keep.
        """
        return _with_kept(brief, self._repaired(brief, concept, robot, feedback))

    def _repaired(self, brief: Brief, concept: Concept, robot: Robot, feedback: Feedback) -> Robot:
        faults = (
            feedback.errors
            if isinstance(feedback, ValidationReport)
            else tuple(_as_fault(issue) for issue in feedback.issues)
        )
        if brief.base == "free":
            # A robot that has to move itself keeps its free joint, even if it falls.
            faults = tuple(fault for fault in faults if fault.code not in _FALLS)
        result = fix(robot.mjcf, faults, keep=brief.keep)
        if result.total:
            return robot.model_copy(update={"mjcf": result.mjcf, "notes": _notes(result)})
        if concept.family in self.families:
            return _reinforced(self.families[concept.family], concept, robot, result)
        codes = ", ".join(result.unfixed) or "this"
        note = f"Built-in rules: no repair for {codes} in a robot of another author; left as it was."
        return robot.model_copy(update={"notes": " ".join([note, *result.notes])})


def _with_kept(brief: Brief, robot: Robot) -> Robot:
    """Return the robot if all parts that the user wants to keep are unchanged.

    Raises:
        ReplyError: A part changed: the rules write robots from parameters and cannot preserve a part of one.
    """
    changes = changes_to_kept_parts(brief.starting_robot, robot.mjcf, brief.keep) if brief.keep else []
    if changes:
        raise ReplyError(
            f"The built-in rules write robots from parameters and cannot keep a part of one. {changes[0]} Refine "
            "without parts to keep, or with a language model."
        )
    return robot


def _as_fault(issue: CritiqueIssue) -> Fault:
    """Return an issue of the Judge as a fault: the built-in Judge names fault codes as components."""
    return Fault(
        code=issue.component, layer="structure", severity="error", message=issue.problem, cure=issue.suggestion
    )


def _notes(result: FixResult) -> str:
    left = f" No repair known or left for: {', '.join(result.unfixed)}." if result.unfixed else ""
    return f"Built-in rules repaired {'; '.join(result.notes)}.{left}"


def _reinforced(family: Family[Any], concept: Concept, robot: Robot, result: FixResult) -> Robot:
    """Return the concept's robot written again, one step stiffer and more damped than the present one."""
    found = _VARIATION.search(robot.mjcf)
    parameters = family.read(concept)
    for _ in range((int(found.group(1)) if found else 0) + 1):
        parameters = family.reinforce(parameters)
    note = f"Built-in rules: no repair for {', '.join(result.unfixed) or 'this'}; written anew, stiffer and calmer."
    return family.write(parameters).model_copy(update={"notes": note})
