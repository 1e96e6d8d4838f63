"""The goal of touching a body with a force between two limits."""

from __future__ import annotations

from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import model_validator

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.goals.environment_index import EnvironmentIndex
from aidsr.tasks.goals.goal import COMING, DOING, MARGIN_M, Goal, Wording, offset_sensor
from aidsr.tasks.goals.goal_readings import GoalReadings
from aidsr.tasks.goals.limits import AnyLimit, NetForceLimit
from aidsr.tasks.goals.numbers import Positive
from aidsr.tasks.readings import BoolArray, FloatArray
from aidsr.tasks.shaping import closeness, share
from aidsr.tasks.task import Feature, TaskState


class Touch(Goal):
    """A body is touched with a force between two limits."""

    wording: ClassVar = Wording(
        "goal/touch",
        "A body is touched.",
        "Three tenths for coming to the body, the rest for force.",
        ((0.25, "at the body"), (0.6, "touching it lightly"), (1.0, "pressing as wanted")),
    )
    kind: Literal["touch"]
    target: str
    """Body of the environment."""
    force_n: Positive = 0.1
    """Smallest net force that counts [N]."""
    at_most_n: Positive | None = None
    """Net force above which the episode is lost, at any moment [N]."""
    part: Literal["functional_part", "robot"] = "functional_part"
    """Part of the robot that must touch the body."""

    @model_validator(mode="after")
    def _a_band(self) -> Self:
        if self.at_most_n is not None and self.at_most_n <= self.force_n:
            raise ValueError(f"at_most_n ({self.at_most_n:g} N) must be more than force_n ({self.force_n:g} N)")
        return self

    def resolved(self, environment: EnvironmentIndex) -> Self:
        environment.require_solid(self.target, "touch")
        return self

    @property
    def wanted_n(self) -> float:
        return self.force_n

    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        return (
            offset_sensor(tag, self.target, of_body=True),
            TaskSensor(name=f"{tag}_gap", quantity="distance", target=self.target),
            TaskSensor(name=f"{tag}_force", quantity="contact_force", target=self.target, part=self.part),
        )

    @property
    def features(self) -> tuple[Feature, ...]:
        return (
            Feature("functional part in the body's frame", "m", (-2, 2), "goal_offset", size=3),
            Feature("gap between the two", "m", (0, 1), "goal_gap"),
            Feature("force, 1 = as much as wanted", "", (0, 10), "goal_force"),
        )

    def observe(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        del state
        force = seen.mean_force_n("force") / self.force_n
        return np.column_stack([seen["offset"], seen["gap"], np.clip(force, 0.0, 10.0)])

    def progress(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        del state
        near = closeness(seen.scalar("gap"), margin=MARGIN_M)
        return COMING * near + DOING * share(seen.mean_force_n("force"), self.force_n)

    def bounds(self, tag: str) -> tuple[tuple[str, AnyLimit], ...]:
        if self.at_most_n is None:
            return ()
        return ((tag, NetForceLimit(kind="force", on=self.target, at_most_n=self.at_most_n)),)

    def is_met(self, seen: GoalReadings, state: TaskState) -> BoolArray:
        del state
        enough = seen.mean_force_n("force") >= self.force_n
        return np.asarray(enough & (seen.peak_force_n("force") <= (self.at_most_n or np.inf)))

    @property
    def success_text(self) -> str:
        part = "the functional part" if self.part == "functional_part" else "any part of the robot"
        most = "" if self.at_most_n is None else f" and at most {self.at_most_n:g} N"
        return f"The net force on {self.target} by {part} is at least {self.force_n:g} N{most}."

    @property
    def violation_text(self) -> str:
        if self.at_most_n is None:
            return ""
        part = "the functional part" if self.part == "functional_part" else "the robot"
        return f"More than {self.at_most_n:g} N by {part} on {self.target} at any moment."

    @property
    def failure_text(self) -> str:
        return self.violation_text

    def losses(self, seen: GoalReadings, state: TaskState) -> dict[str, BoolArray]:
        del state
        if self.at_most_n is None:
            return {}
        return {self.failure_text: np.asarray(seen.peak_force_n("force") > self.at_most_n)}
