"""The Scene Integrator: decides where a robot stands in the environment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from aidsr.core.artifacts import Brief, Concept, Placement, Robot
from aidsr.core.errors import IsolationError, MjcfError, ReplyError
from aidsr.core.roles import Feedback
from aidsr.mjcf.condense import condense
from aidsr.sim.measure import Extent, measure
from aidsr.teams.llm.conversation import Conversation
from aidsr.teams.llm.describe_environment import describe_environment
from aidsr.teams.llm.feedback import describe_feedback
from aidsr.teams.llm.prompts import as_json, render
from aidsr.teams.llm.replies import element_names, parse_json, validate_as


@dataclass(frozen=True)
class IntegratorAgent:
    """A language model as the Scene Integrator.

    Attributes:
        conversation: The model, and how often it is asked again after an unusable reply.
        condensed: Whether the MJCF of the robot is shown in condensed form.
    """

    conversation: Conversation
    condensed: bool = True

    def place(self, brief: Brief, concept: Concept, robot: Robot) -> Placement:
        """Return the first placement of a robot.

        Raises:
            ReplyError: No reply could be used.
        """
        user = render("integrator_place", **self._prompt_values(brief, concept, robot))
        return self._placement(user, brief, robot)

    def adjust(
        self, brief: Brief, concept: Concept, robot: Robot, placement: Placement, feedback: Feedback
    ) -> Placement:
        """Return the placement with the reported problems removed.

        Raises:
            ReplyError: No reply could be used.
        """
        user = render(
            "integrator_adjust",
            **self._prompt_values(brief, concept, robot),
            placement=as_json(placement),
            feedback=describe_feedback(feedback),
        )
        return self._placement(user, brief, robot)

    def _prompt_values(self, brief: Brief, concept: Concept, robot: Robot) -> dict[str, Any]:
        return {
            "brief": brief,
            "environment": describe_environment(brief.summary),
            "concept": concept,
            "robot": robot,
            "extent": _extent_of(robot),
            "mjcf": ((self.condensed and condense(robot.mjcf)) or robot.mjcf).strip(),
        }

    def _placement(self, user: str, brief: Brief, robot: Robot) -> Placement:
        def read(reply: str) -> Placement:
            placement = validate_as(Placement, parse_json(reply))
            complaints = _check_placement(placement, brief, robot)
            if complaints:
                raise ReplyError(" ".join(complaints))
            return placement

        return self.conversation.ask("integrator", render("integrator"), user, read)


def _extent_of(robot: Robot) -> Extent | None:
    """Return the extent of the robot; None if it does not load, which the validator reports."""
    try:
        return measure(robot)
    except (MjcfError, IsolationError):
        return None


def _check_placement(placement: Placement, brief: Brief, robot: Robot) -> list[str]:
    """Return a sentence for everything in a placement that contradicts the job, with the valid choices."""
    mounts = {mount.name: mount for mount in brief.summary.mounts}
    bodies = {body.name for body in brief.summary.bodies}
    parts = element_names(robot.mjcf, "body", "site")
    found = []
    if placement.mount not in {*mounts, "world"}:
        found.append(f'There is no mount "{placement.mount}"; there is {", ".join([*mounts, "world"])}.')
    elif brief.base in {"fixed", "moving"} and mounts and placement.mount == "world":
        found.append(f'The job wants the robot on a mount of the environment, not "world": {", ".join(mounts)}.')
    elif brief.base == "moving" and mounts and not mounts[placement.mount].moved_by:
        moved = ", ".join(mount.name for mount in mounts.values() if mount.moved_by)
        found.append(f'The job wants a mount that the environment moves: {moved}; "{placement.mount}" stands still.')
    wanted = {"fixed": "fixed", "moving": "fixed", "free": "free", "any": placement.base}[brief.base]
    if placement.base != wanted:
        found.append(f'The job wants base "{wanted}", found "{placement.base}".')
    unknown = [name for name in placement.intended_contacts if name not in bodies]
    if unknown:
        found.append(f"intended_contacts names {', '.join(unknown)}; the bodies are {', '.join(sorted(bodies))}.")
    if placement.functional_part and placement.functional_part not in parts:
        found.append(
            f'The robot has no body or site "{placement.functional_part}"; leave functional_part empty to keep '
            f'"{robot.functional_part}".'
        )
    return found
