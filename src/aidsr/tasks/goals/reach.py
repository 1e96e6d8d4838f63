"""Goals of bringing the functional part to a point."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, field_validator

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.goals.environment_index import EnvironmentIndex
from aidsr.tasks.goals.goal import MARGIN_M, Goal, Wording, length_m, offset_sensor, unit
from aidsr.tasks.goals.goal_readings import GoalReadings
from aidsr.tasks.goals.numbers import Positive, a_direction
from aidsr.tasks.readings import BoolArray, FloatArray
from aidsr.tasks.shaping import closeness
from aidsr.tasks.task import Feature, TaskState

_PLACE, _TURN = 0.6, 0.4
"""Shares of the progress of a pose for being at the target and for pointing in the direction. Our choice."""


class _ToAPoint(Goal):
    """Base class of goals that bring the functional part to a point."""

    target: str
    """Site or body of the environment."""
    within_m: Positive = 0.02
    """Largest distance that counts as reached [m]."""

    def resolved(self, environment: EnvironmentIndex) -> Self:
        environment.require_place(self.target, self.kind_name)
        return self

    @property
    def kind_name(self) -> str:
        """Value of the key `kind`."""
        return str(self.kind)  # type: ignore[attr-defined]

    @property
    def needs_contact(self) -> bool:
        return False

    @property
    def points(self) -> tuple[str, ...]:
        return (self.target,)

    @property
    def reached(self) -> tuple[tuple[str, float], ...]:
        return ((self.target, self.within_m),)

    @property
    def bodies(self) -> tuple[str, ...]:
        return ()

    @property
    def may_target_site(self) -> bool:
        return True

    @property
    def near_m(self) -> float:
        return self.within_m

    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        return (offset_sensor(tag, self.target, of_body=False),)

    def _near(self, seen: GoalReadings) -> FloatArray:
        return closeness(length_m(seen["offset"]), within=self.within_m, margin=MARGIN_M)


class Reach(_ToAPoint):
    """The functional part comes to a site, or to the origin of a body."""

    wording: ClassVar = Wording(
        "goal/reach",
        "The functional part comes to the target.",
        "Nearness.",
        ((0.3, "near the target"), (1.0, "there")),
    )
    kind: Literal["reach"]

    @property
    def features(self) -> tuple[Feature, ...]:
        return (Feature("functional part in the target's frame", "m", (-2, 2), "goal_offset", size=3),)

    def observe(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        del state
        return seen["offset"]

    def progress(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        del state
        return self._near(seen)

    def is_met(self, seen: GoalReadings, state: TaskState) -> BoolArray:
        del state
        return np.asarray(length_m(seen["offset"]) <= self.within_m)

    @property
    def success_text(self) -> str:
        return f"The point with which the functional part works is at most {self.within_m:g} m from {self.target}."


class Pose(_ToAPoint):
    """The functional part comes to a site or to the origin of a body, and points in a direction there."""

    wording: ClassVar = Wording(
        "goal/pose",
        "The functional part comes to the target and points as wanted.",
        "Six tenths for nearness, the rest for pointing as wanted where it is near.",
        ((0.3, "near the target"), (0.6, "there"), (1.0, "pointing as wanted")),
    )
    kind: Literal["pose"]
    direction: tuple[float, ...]
    """Direction in which the functional part's axis must point, in world axes, of any length."""
    axis: tuple[float, ...] = (0.0, 0.0, 1.0)
    """Axis of the functional part, in the frame of the site or body that is the functional part; of any length."""
    within_deg: Annotated[float, Field(gt=0, lt=180)] = 15.0
    """Largest angle between the axis and the direction [deg]."""

    @field_validator("direction", "axis")
    @classmethod
    def _somewhere(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        return a_direction(value)

    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        return (*super().sensors(tag), TaskSensor(name=f"{tag}_turn", quantity="quaternion"))

    @property
    def features(self) -> tuple[Feature, ...]:
        return (
            Feature("functional part in the target's frame", "m", (-2, 2), "goal_offset", size=3),
            Feature("where its axis points", "", (-1, 1), "goal_turn", size=3),
            Feature("where it has to point", "", (-1, 1), "(goal)", size=3),
        )

    def observe(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        del state
        wanted = np.tile(unit(self.direction), (seen.n, 1))
        return np.concatenate([seen["offset"], self._pointing(seen), wanted], axis=1)

    def progress(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        del state
        near = self._near(seen)
        aligned = closeness(self._aside_deg(seen), within=self.within_deg, margin=90.0)
        return _PLACE * near + _TURN * near * aligned

    def is_met(self, seen: GoalReadings, state: TaskState) -> BoolArray:
        del state
        return np.asarray((length_m(seen["offset"]) <= self.within_m) & (self._aside_deg(seen) <= self.within_deg))

    def _pointing(self, seen: GoalReadings) -> FloatArray:
        """Return the direction of the axis in world axes, (n, 3)."""
        turn, axis = seen["turn"], unit(self.axis)
        w, v = turn[:, :1], turn[:, 1:]
        twice = 2.0 * np.cross(v, np.broadcast_to(axis, v.shape))
        return np.asarray(axis + w * twice + np.cross(v, twice))

    def _aside_deg(self, seen: GoalReadings) -> FloatArray:
        cosine = np.clip(self._pointing(seen) @ unit(self.direction), -1.0, 1.0)
        return np.asarray(np.rad2deg(np.arccos(cosine)))

    @property
    def success_text(self) -> str:
        way, axis = (" ".join(f"{each:g}" for each in vector) for vector in (self.direction, self.axis))
        return (
            f"The point with which the functional part works is at most {self.within_m:g} m from {self.target}, and "
            f"its own axis {axis} points along {way} (world axes), at most {self.within_deg:g} deg aside."
        )
