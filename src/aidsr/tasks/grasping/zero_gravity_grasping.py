"""Catch hold of a ball that drifts in weightlessness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.tasks.condition import Condition
from aidsr.tasks.grasping.base import CarriageTask, away_m, grip_conditions, nearness
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import closeness, excess
from aidsr.tasks.task import FORCE_SCALE_N, Criteria, Feature, TaskState, span
from aidsr.tasks.variation import Change, Variation, solid

APPROACH_S, RETREAT_S, END_S = 1.0, 3.0, 5.0
"""Times at which the carriage has approached, begins to draw back, and has drawn back [s]."""
APPROACH_M = 0.10
MOUNT_M, RADIUS_M = 0.65, 0.03
MASS_KG = (0.05, 0.20)
DISTANCE_M = (0.06, 0.10)
"""Range of the distance from the mount to the object's centre after the approach [m]."""
SPIN_RAD_S = 0.2
STILL_M_S = 0.02
PUSHED_M, LOST_M = 0.3, 0.6
"""Distances from the functional part at which an object counts as pushed off, and as out of reach [m]."""
KEPT_M = 0.05
"""Displacement relative to the mount at which the object counts as left behind [m]."""


@dataclass(frozen=True)
class ZeroGravityGrasping(CarriageTask):
    """The carriage comes near, waits two seconds and draws back; the ball must come along without moving in the grip.

    Source: our choice; drift and spin of debris that is approached on a matched course.
    """

    name: ClassVar = "grasping/zero_gravity_grasping"
    times_s: ClassVar = (0.0, APPROACH_S, RETREAT_S, END_S)
    heights_m: ClassVar = (0.0, -APPROACH_M, -APPROACH_M, 0.0)
    time_limit_s: ClassVar = 15.0
    hold_s: ClassVar = 2.0
    stages: ClassVar = ((0.3, "at the object"), (0.6, "around it"), (1.0, "holding it still"))
    decisive: ClassVar = "holding it still"
    required_names: ClassVar = ("mount", "carriage", "carriage_lift", "object", "object_free")
    features: ClassVar = (
        Feature("functional part to object", "m", (-1, 1), "object_position, tip_position", size=3),
        Feature("object's velocity", "m/s", (-2, 2), "object_velocity", size=3),
        Feature("mount to object", "m", (-1, 1), "object_position, mount_position", size=3),
        Feature("carriage's height, 0 at the start", "m", (-0.1, 0.02), "carriage_height"),
        Feature("time, 1 when the carriage has drawn back", "", (0, 3), "(time)"),
        Feature(f"strongest contact with the object, 1 = {FORCE_SCALE_N:g} N", "", (0, 8), "grip"),
        Feature("how far the contacts face each other", "", (0, 1), "grip"),
        Feature("object's spin", "rad/s", (-10, 10), "object_spin", size=3),
    )
    hard: ClassVar = {"drift_m_s": 0.1}

    drift_m_s: float = 0.03
    """Largest drift speed of the object [m/s]."""

    @property
    def objective(self) -> str:
        nearest_m, farthest_m = DISTANCE_M
        return (
            f"Catch hold of a ball of {1000 * RADIUS_M:g} mm radius and {span(MASS_KG, 1000)} g that floats without "
            f"gravity, drifting at up to {self.drift_m_s:g} m/s, and keep it still in the grip (slower than "
            f"{STILL_M_S:g} m/s) for {self.hold_s:g} s while the mount moves away. The mount comes within "
            f"{nearest_m:.2f} to {farthest_m:.2f} m of its middle in {APPROACH_S:g} s, waits for "
            f"{RETREAT_S - APPROACH_S:g} s and draws back {APPROACH_M:.2f} m in {END_S - RETREAT_S:g} s."
        )

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=(
                f"Distance +-{500 * (DISTANCE_M[1] - DISTANCE_M[0]):g} mm, drift and spin in any direction, mass "
                f"{span(MASS_KG, 1000)} g."
            ),
            progress=(
                "Three tenths for coming near, three for holding it from opposite sides, four for stillness in that "
                "hold."
            ),
            success=(
                "The carriage draws back, and the object, held and not drifting by itself, comes along without moving."
            ),
            violation=f"The object is more than {PUSHED_M:g} m away from the functional part: it was pushed off.",
            failure="The object is out of reach for good.",
        )

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        drift, spin = rng.normal(size=(2, 3))
        drift *= rng.uniform(0.0, self.drift_m_s) / np.linalg.norm(drift)
        spin *= rng.uniform(0.0, SPIN_RAD_S) / np.linalg.norm(spin)
        distance_m, mass_kg = rng.uniform(*DISTANCE_M), rng.uniform(*MASS_KG)
        height_m = MOUNT_M - APPROACH_M - distance_m
        drifts = " ".join(f"{1000 * speed:+.1f}" for speed in drift)
        return Variation(
            (
                *solid("object", "sphere", RADIUS_M, mass_kg),
                Change("qpos", "object_free", (0.0, 0.0, height_m, 1.0, 0.0, 0.0, 0.0)),
                Change("qvel", "object_free", (*drift, *spin)),
            ),
            words=(
                f"{1000 * distance_m:.0f} mm below the mount where it stops, drifts {drifts} mm/s along x y z, spins "
                f"{np.rad2deg(np.linalg.norm(spin)):.1f} deg/s, {1000 * mass_kg:.0f} g"
            ),
        )

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        return np.column_stack([super().observe(readings, state), readings["object_spin"]])

    def reset_state(self, readings: Readings) -> TaskState:
        return {"held": _from_mount_m(readings), "moved_m": np.zeros(readings.n)}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        # "held": position of the object relative to the mount when the carriage began to draw back; "moved_m": its
        # largest displacement from there since then
        held = np.where((readings.time_s < RETREAT_S)[:, None], _from_mount_m(readings), state["held"])
        moved_m = np.linalg.norm(_from_mount_m(readings) - held, axis=1)
        return {"held": held, "moved_m": np.maximum(state["moved_m"], moved_m)}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        del state
        opposition = readings.contacts("grip").opposition()
        still = closeness(_relative_m_s(readings), within=STILL_M_S, margin=0.1)
        return 0.3 * nearness(readings) + 0.3 * opposition + 0.4 * opposition * still

    def conditions(self, readings: Readings, state: TaskState) -> tuple[Condition, ...]:
        moved_mm = 1000 * state["moved_m"]
        return (
            *grip_conditions(readings),
            Condition("speed against the mount", _relative_m_s(readings), STILL_M_S, at_least=False, unit="m/s"),
            Condition("moved in the grip", moved_mm, 1000 * KEPT_M, at_least=False, unit="mm"),
        )

    def violation(self, readings: Readings) -> FloatArray:
        return excess(away_m(readings), PUSHED_M, full=LOST_M)

    def is_failure(self, readings: Readings, state: TaskState) -> BoolArray:
        del state
        return away_m(readings) >= LOST_M

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        touched = readings.contacts("grip").found.any(axis=1) & (state["moved_m"] < KEPT_M)
        return np.asarray((readings.time_s >= RETREAT_S) & touched & (_relative_m_s(readings) < STILL_M_S))


def _from_mount_m(readings: Readings) -> FloatArray:
    return np.asarray(readings["object_position"] - readings["mount_position"])


def _relative_m_s(readings: Readings) -> FloatArray:
    return np.asarray(np.linalg.norm(readings["object_velocity"] - readings["mount_velocity"], axis=1))
