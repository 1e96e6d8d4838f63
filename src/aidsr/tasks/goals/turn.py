"""The goal of turning a joint of the environment by an angle."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from aidsr.core.errors import UserError
from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.goals.environment_index import EnvironmentIndex, unknown
from aidsr.tasks.goals.goal import COMING, DOING, MARGIN_M, Goal, Wording, offset_sensor
from aidsr.tasks.goals.goal_readings import GoalReadings
from aidsr.tasks.goals.numbers import Finite
from aidsr.tasks.goals.unattended import Sweep
from aidsr.tasks.readings import BoolArray, FloatArray
from aidsr.tasks.shaping import closeness, share
from aidsr.tasks.task import Feature, TaskState

_ROUNDING_DEG = 0.01
"""Tolerance for rounded angles [deg]. Our choice: MJCF is written with six digits."""


class Turn(Goal):
    """A hinge is turned from its position at the start."""

    wording: ClassVar = Wording(
        "goal/turn",
        "A joint is turned.",
        "Three tenths for coming to what turns, the rest for the angle.",
        ((0.25, "at what turns"), (0.6, "half of the angle"), (1.0, "all of the angle")),
    )
    kind: Literal["turn"]
    joint: str
    """Hinge of the environment."""
    by_deg: Finite
    """Angle [deg]: positive about the joint's axis by the right-hand rule, negative in the other direction."""
    within_deg: Annotated[float, Field(gt=0, le=180)] | None = None
    """Tolerance to both sides of `by_deg` [deg]; without it, every angle of at least `by_deg` counts."""
    target: str = ""
    """Body that the robot must come to, such as a handle; by default the body that the joint moves."""

    @field_validator("by_deg")
    @classmethod
    def _somewhere(cls, value: float) -> float:
        if not value:
            raise ValueError("by_deg must not be 0; use a positive or a negative angle")
        return value

    @model_validator(mode="after")
    def _not_met_yet(self) -> Self:
        if self.within_deg is not None and self.within_deg >= abs(self.by_deg):
            raise ValueError(
                f"within_deg ({self.within_deg:g} deg) must be less than by_deg ({abs(self.by_deg):g} deg): else the "
                "goal is met before anything moves"
            )
        return self

    def resolved(self, environment: EnvironmentIndex) -> Self:
        joint = environment.joint(self.joint)
        if joint.kind != "hinge":
            kind, instead = {
                "slide": ("slide", "use a travel goal for a slide"),
                "ball": ("ball joint", "give the body a hinge"),
            }.get(joint.kind, ("free joint", "use a lift, travel or bring goal for a free body"))
            raise UserError(f'the joint "{self.joint}" is a {kind}, which has no angle to turn; {instead}')
        end = joint.high if self.by_deg > 0 else joint.low
        if end is not None:
            way_deg = abs(math.degrees(end - joint.now))
            least_deg = abs(self.by_deg) - (self.within_deg or 0.0)
            if least_deg > way_deg + _ROUNDING_DEG:
                raise UserError(
                    f'the joint "{self.joint}" cannot be turned by {self.by_deg:g} deg: its range ends after '
                    f"{way_deg:.3g} deg that way; ask for less, turn it the other way, or give it a wider range"
                )
        target = self.target or (joint.body and (environment.solid_part(joint.body) or joint.body))
        if not target:
            raise UserError(f'the joint "{self.joint}" moves a body without a name; name that body')
        environment.require_solid(target, "turn")
        if joint.name not in (each.name for each in environment.mechanism.carrying(target)):
            turned = [name for name in environment.bodies if joint in environment.mechanism.carrying(name)]
            raise unknown("target", target, f'the joint "{self.joint}" must carry it', turned)
        return self.model_copy(update={"target": target})

    @property
    def moves_bodies(self) -> bool:
        return True

    def sweeps(self, environment: EnvironmentIndex) -> tuple[Sweep, ...]:
        joint = environment.only_joint(environment.joint(self.joint).body)
        least_deg = abs(self.by_deg) - (self.within_deg or 0.0)
        return (Sweep(joint.body, by_rad=math.radians(math.copysign(least_deg, self.by_deg))),) if joint else ()

    def sensors(self, tag: str) -> tuple[TaskSensor, ...]:
        return (
            offset_sensor(tag, self.target, of_body=True),
            TaskSensor(name=f"{tag}_gap", quantity="distance", target=self.target),
            TaskSensor(name=f"{tag}_angle", quantity="joint_position", target=self.joint),
        )

    @property
    def features(self) -> tuple[Feature, ...]:
        return (
            Feature("functional part in the body's frame", "m", (-2, 2), "goal_offset", size=3),
            Feature("gap between the two", "m", (0, 1), "goal_gap"),
            Feature("angle turned, 1 = as wanted", "", (-1, 2), "goal_angle"),
        )

    def start(self, seen: GoalReadings) -> TaskState:
        return {"start": seen["angle"]}

    def observe(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        return np.column_stack([seen["offset"], seen["gap"], self._turned_deg(seen, state) / abs(self.by_deg)])

    def progress(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        wanted, turned_deg = abs(self.by_deg), self._turned_deg(seen, state)
        if self.within_deg is not None:  # an angle too large counts the same as one that is too small by as much
            turned_deg = wanted - np.maximum(np.abs(turned_deg - wanted) - self.within_deg, 0.0)
        turned = share(turned_deg, wanted)
        near = closeness(seen.scalar("gap"), margin=MARGIN_M)
        return COMING * np.maximum(near, turned) + DOING * turned

    def is_met(self, seen: GoalReadings, state: TaskState) -> BoolArray:
        wanted, turned_deg = abs(self.by_deg), self._turned_deg(seen, state)
        if self.within_deg is None:
            return np.asarray(turned_deg >= wanted - _ROUNDING_DEG)
        return np.asarray(np.abs(turned_deg - wanted) <= self.within_deg)

    def _turned_deg(self, seen: GoalReadings, state: TaskState) -> FloatArray:
        """Return the angle turned in the required direction, (n,) [deg]."""
        turned = np.rad2deg(seen["angle"] - state["start"])[:, 0]
        return np.asarray(turned * math.copysign(1.0, self.by_deg))

    @property
    def success_text(self) -> str:
        hand = "right" if self.by_deg > 0 else "left"
        how = (
            f"at least {abs(self.by_deg):g} deg"
            if self.within_deg is None
            else f"{abs(self.by_deg):g} deg, give or take {self.within_deg:g} deg,"
        )
        return (
            f"The joint {self.joint} is turned {how} about its axis by the {hand} hand (thumb along the axis, fingers "
            "the way it turns) from where it was at the start."
        )
