"""Pick an object up from a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.tasks.grasping.base import LIFT_PROGRESS, RAISED_M, TABLE_M, LiftTask, raised_m, slip_m
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import excess
from aidsr.tasks.task import FORCE_SCALE_N, Criteria, Feature, TaskState, span
from aidsr.tasks.variation import Change, Shape, Variation, shift_words, solid

SHAPES: tuple[Shape, ...] = ("sphere", "cylinder", "box")
HALF_SIZE_M = (0.025, 0.035)
MASS_KG = (0.05, 0.15)
OFFSET_M = 0.015
SLIP_M = 0.02
OFF_TABLE_M = 0.02
"""Depth of an object's centre below the table's top at which it has fallen off [m]."""
MAX_SPEED_M_S = 1.0
SHAKE_HZ = 2.0


@dataclass(frozen=True)
class SimpleGrasping(LiftTask):
    """The carriage lowers the robot, waits two seconds and lifts it; the object must come along.

    Source: our choice; sizes and masses of everyday objects that soft grippers of this size hold (SoMoGym, SofaGym).
    """

    name: ClassVar = "grasping/simple_grasping"
    time_limit_s: ClassVar = 10.0
    hold_s: ClassVar = 2.0
    required_names: ClassVar = ("mount", "table", "carriage", "carriage_lift", "object", "object_free", "object_push")
    features: ClassVar = (
        Feature("functional part to object", "m", (-0.8, 0.8), "object_position, tip_position", size=3),
        Feature("object's velocity", "m/s", (-3, 3), "object_velocity", size=3),
        Feature("mount to object", "m", (-0.8, 0.8), "object_position, mount_position", size=3),
        Feature("carriage's height, 0 at the start", "m", (-0.1, 0.05), "carriage_height"),
        Feature("time, 1 when the lift has ended", "", (0, 2.3), "(time)"),
        Feature(f"strongest contact with the object, 1 = {FORCE_SCALE_N:g} N", "", (0, 8), "grip"),
        Feature("how far the contacts face each other", "", (0, 1), "grip"),
    )
    hard: ClassVar = {"shake_n": 1.0}

    shake_n: float = 0.0
    """Amplitude of the sideways force on the lifted object, which oscillates at `SHAKE_HZ` [N]."""

    @property
    def objective(self) -> str:
        shaken = f" while it is shaken sideways with {self.shake_n:g} N" if self.shake_n else ""
        return (
            f"Pick up a sphere, cylinder or box, {span(HALF_SIZE_M, 2000)} mm across and {span(MASS_KG, 1000)} g, from "
            f"a table and keep it raised at least {RAISED_M:.2f} m for {self.hold_s:g} s{shaken}. {self.timetable}"
        )

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=(
                f"Shape, half size {span(HALF_SIZE_M, 1000)} mm, mass {span(MASS_KG, 1000)} g, "
                f"+-{1000 * OFFSET_M:g} mm to each side, any yaw."
            ),
            progress=LIFT_PROGRESS,
            success=(
                f"Raised at least {RAISED_M:.2f} m and slipped less than {1000 * SLIP_M:g} mm in the grip; at the hard "
                "level while being shaken."
            ),
            violation=f"The object is off the table, or thrown: faster than {MAX_SPEED_M_S:g} m/s.",
            failure="The object is off the table.",
        )

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        shape = SHAPES[rng.integers(3)]
        half_m = float(rng.uniform(*HALF_SIZE_M))
        x, y = rng.uniform(-OFFSET_M, OFFSET_M, size=2)
        half_yaw, mass_kg = rng.uniform(0.0, np.pi) / 2, rng.uniform(*MASS_KG)
        pose = (x, y, TABLE_M + half_m, np.cos(half_yaw), 0.0, 0.0, np.sin(half_yaw))
        words = (
            f"{shape} of half size {1000 * half_m:.1f} mm, {1000 * mass_kg:.0f} g, {shift_words(x, y)}, turned "
            f"{np.rad2deg(2 * half_yaw):.0f} deg"
        )
        return Variation((*solid("object", shape, half_m, mass_kg), Change("qpos", "object_free", pose)), words=words)

    def script(self, readings: Readings) -> Mapping[str, FloatArray]:
        lifted_for_s = readings.time_s - self.times_s[-1]
        push_n = np.where(lifted_for_s >= 0.0, self.shake_n * np.sin(2 * np.pi * SHAKE_HZ * lifted_for_s), 0.0)
        return {**super().script(readings), "object_push": push_n}

    def violation(self, readings: Readings) -> FloatArray:
        thrown = excess(np.linalg.norm(readings["object_velocity"], axis=1), MAX_SPEED_M_S)
        return np.maximum(_off_table(readings), thrown)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        ready = (readings.time_s >= self.times_s[-1]) | (self.shake_n == 0.0)
        return (raised_m(readings, state) >= RAISED_M) & ready & (slip_m(readings, state) < SLIP_M)

    def is_failure(self, readings: Readings, state: TaskState) -> BoolArray:
        del state
        return _off_table(readings)


def _off_table(readings: Readings) -> BoolArray:
    return np.asarray(readings["object_position"][:, 2] < TABLE_M - OFF_TABLE_M)
