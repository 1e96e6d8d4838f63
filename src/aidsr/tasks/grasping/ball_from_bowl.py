"""Take a ball out of a bowl."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.condition import Condition
from aidsr.tasks.grasping.base import (
    LIFT_PROGRESS,
    RAISED_M,
    grip_conditions,
    lift_progress,
    raised_condition,
    raised_m,
)
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import excess
from aidsr.tasks.task import FORCE_SCALE_N, Criteria, Feature, Task, TaskState, span
from aidsr.tasks.variation import Change, Variation, shift_words, solid

BOTTOM_M = 0.408
"""Height of the bowl's flat bottom above the floor [m]."""
RIM_M = 0.04
"""Height of the bowl's rim above its bottom [m]."""
RIM_RADIUS_M = 0.09
ABOVE_M = (0.15, 0.30, 0.40)
"""Heights of the mount above the bowl's bottom: lowest, at the start, highest [m]."""
HALF_SIZE_M = (0.022, 0.030)
OFFSET_M = 0.01
OUTSIDE_M = 0.12
"""Distance from the bowl's axis at which a ball below the rim has fallen out [m]."""
MAX_FORCE_N = 15.0


@dataclass(frozen=True)
class BallFromBowl(Task):
    """The policy lowers the robot into the bowl, and raises it with the ball.

    Source: our choice. The rim keeps a robot from closing in from the side, and only the policy raises it: a body that
    always does the same comes down or goes up.
    """

    name: ClassVar = "grasping/ball_from_bowl"
    base: ClassVar = "moving"
    time_limit_s: ClassVar = 15.0
    hold_s: ClassVar = 1.0
    stages: ClassVar = ((0.25, "at the ball"), (0.5, "around it"), (0.75, "half way up"), (1.0, "out of the bowl"))
    required_names: ClassVar = ("mount", "carriage", "bowl", "object", "object_free", "base_z")
    policy_actuators: ClassVar = ("base_z",)
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="grip", quantity="contacts", target="object", slots=8),
    )
    features: ClassVar = (
        Feature("functional part to ball", "m", (-0.5, 0.5), "object_position, tip_position", size=3),
        Feature("ball's velocity", "m/s", (-3, 3), "object_velocity", size=3),
        Feature("mount to ball", "m", (-0.5, 0.5), "object_position, mount_position", size=3),
        Feature("base up and down", "m", (-0.15, 0.1), "base_z_position"),
        Feature(f"height of the ball over its start, 1 = {RAISED_M:g} m", "", (0, 2.5), "object_position"),
        Feature(f"strongest contact with the ball, 1 = {FORCE_SCALE_N:g} N", "", (0, 8), "grip"),
        Feature("how far the contacts face each other", "", (0, 1), "grip"),
    )
    hard: ClassVar = {"lightest_kg": 0.10, "heaviest_kg": 0.15}

    lightest_kg: float = 0.03
    heaviest_kg: float = 0.08

    @property
    def objective(self) -> str:
        low_m, start_m, high_m = ABOVE_M
        return (
            f"Scoop a ball of {span(HALF_SIZE_M, 2000)} mm and {span(self._mass_kg, 1000)} g out of a bowl, "
            f"{RAISED_M:.2f} m upwards, for {self.hold_s:g} s. The bowl is {1000 * RIM_M:g} mm high and "
            f"{2000 * RIM_RADIUS_M:g} mm wide at its rim, its bottom {start_m:.2f} m below the base, which shifts down "
            f"to {low_m:g} m and up to {high_m:.2f} m from it at 0.1 m/s."
        )

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=(
                f"Half size {span(HALF_SIZE_M, 1000)} mm, mass {span(self._mass_kg, 1000)} g, the bowl and the ball in "
                f"it each +-{1000 * OFFSET_M:g} mm to each side."
            ),
            progress=LIFT_PROGRESS,
            success=f"The ball is at least {RAISED_M:.2f} m higher than it lay.",
            violation=f"More than {MAX_FORCE_N:g} N on the ball, or it is outside the bowl.",
            failure="The ball lies outside the bowl.",
        )

    @property
    def _mass_kg(self) -> tuple[float, float]:
        return self.lightest_kg, self.heaviest_kg

    @property
    def target(self) -> tuple[Mark, ...]:
        return (Mark(element="joint", name="object_free", by=RAISED_M),)

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        half_m = float(rng.uniform(*HALF_SIZE_M))
        x, y, dx, dy = rng.uniform(-OFFSET_M, OFFSET_M, size=4)
        place = (x + dx, y + dy, BOTTOM_M + half_m, 1.0, 0.0, 0.0, 0.0)
        mass_kg = rng.uniform(*self._mass_kg)
        ball = solid("object", "sphere", half_m, mass_kg)
        changes = (*ball, Change("body_pos", "bowl", (x, y, BOTTOM_M)), Change("qpos", "object_free", place))
        words = (
            f"ball of radius {1000 * half_m:.1f} mm, {1000 * mass_kg:.0f} g; bowl {shift_words(x, y)}, the ball in it "
            f"{shift_words(dx, dy)}"
        )
        return Variation(changes, words=words)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        grip = readings.contacts("grip")
        return np.column_stack(
            [
                readings["object_position"] - readings["tip_position"],
                readings["object_velocity"],
                readings["object_position"] - readings["mount_position"],
                readings["base_z_position"],
                raised_m(readings, state) / RAISED_M,
                grip.force_n.max(axis=1) / FORCE_SCALE_N,
                grip.opposition(),
            ]
        )

    def reset_state(self, readings: Readings) -> TaskState:
        return {"start": readings["object_position"]}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        return lift_progress(readings, state)

    def conditions(self, readings: Readings, state: TaskState) -> tuple[Condition, ...]:
        return (*grip_conditions(readings), raised_condition(raised_m(readings, state), RAISED_M))

    def violation(self, readings: Readings) -> FloatArray:
        return np.maximum(_outside(readings), excess(readings.peak_contact_n("grip"), MAX_FORCE_N))

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        return raised_m(readings, state) >= RAISED_M

    def is_failure(self, readings: Readings, state: TaskState) -> BoolArray:
        del state
        return _outside(readings)


def _outside(readings: Readings) -> BoolArray:
    from_bowl_m = readings["object_position"] - readings["bowl_position"]
    return np.asarray((np.linalg.norm(from_bowl_m[:, :2], axis=1) > OUTSIDE_M) & (from_bowl_m[:, 2] < RIM_M))
