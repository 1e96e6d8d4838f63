"""The human baseline: one robot for each benchmark task, designed by hand, with its placement and its rationale.

The robots started as output of the built-in families; their parameters were then chosen by hand for the one task.
No part of them is sampled, repaired or searched.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from importlib.resources import files

from pydantic import Field

from aidsr.core.artifacts import ActuatorGroup, Artifact, Brief, Concept, Placement, Robot
from aidsr.core.errors import UserError
from aidsr.core.roles import Feedback, Team

_ROBOTS = files("aidsr.teams.baselines") / "robots"


class Reference(Artifact):
    """Entry of a robot in robots.toml: what its MJCF does not contain."""

    name: str
    family: str
    morphology: str
    actuation: str
    rationale: str
    functional_part: str
    placement: Placement
    groups: dict[str, tuple[str, ...]] = Field(default_factory=dict)
    """Actuators that act together, by the name of the group."""


def read_reference(task: str) -> tuple[Reference, Robot]:
    """Return the robot designed by hand for a benchmark task, with its entry in robots.toml.

    Raises:
        UserError: The task is not one of the benchmark.
    """
    name = task.rpartition("/")[2]
    table = tomllib.loads((_ROBOTS / "robots.toml").read_text(encoding="utf-8"))
    if name not in table:
        raise UserError(
            f'there is no reference robot for "{task or "an objective in words"}"; name one of `aidsr tasks`'
        )
    found = Reference.model_validate(table[name])
    groups = tuple(ActuatorGroup(name=name, actuators=actuators) for name, actuators in found.groups.items())
    mjcf = (_ROBOTS / f"{name}.xml").read_text(encoding="utf-8")
    notes = "Designed by hand."
    return found, Robot(mjcf=mjcf, functional_part=found.functional_part, actuator_groups=groups, notes=notes)


def team() -> Team:
    """Return the team of the reference robots; its Judge is that of the built-in rules."""
    from aidsr.teams.rules.judge import RuleJudge

    roles = _ReferenceRoles()
    return Team(roles, roles, roles, RuleJudge())


@dataclass(frozen=True)
class _ReferenceRoles:
    """Designer, Coder and Scene Integrator in one; feedback changes nothing, since the robot itself is evaluated."""

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        if count != 1:
            raise UserError(f"there is one reference robot for each task, not {count}; set concepts to 1")
        found, robot = read_reference(brief.task)
        concept = Concept(
            name=found.name,
            interpretation=brief.objective,
            morphology=found.morphology,
            actuation=found.actuation,
            functional_part=found.functional_part,
            family=found.family,
            actuator_groups=robot.actuator_groups,
            rationale=found.rationale,
        )
        return (concept,)

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        del brief, robot, feedback
        return concept

    def write(self, brief: Brief, concept: Concept) -> Robot:
        del concept
        return read_reference(brief.task)[1]

    def repair(self, brief: Brief, concept: Concept, robot: Robot, feedback: Feedback) -> Robot:
        del brief, concept, feedback
        return robot

    def place(self, brief: Brief, concept: Concept, robot: Robot) -> Placement:
        del concept, robot
        return read_reference(brief.task)[0].placement

    def adjust(
        self, brief: Brief, concept: Concept, robot: Robot, placement: Placement, feedback: Feedback
    ) -> Placement:
        del brief, concept, robot, feedback
        return placement
