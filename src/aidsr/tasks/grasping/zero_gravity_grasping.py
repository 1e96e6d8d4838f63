"""Catch hold of a ball that drifts in weightlessness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.tasks.grasping.carriage import CarriageTask, approach, away_m
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import closeness, excess
from aidsr.tasks.task import Memory
from aidsr.tasks.variation import Change, Variation, solid

RETREAT_S = 3.0
"""When the carriage begins to draw back."""
MOUNT_M, RADIUS_M = 0.65, 0.03
STILL_M_S = 0.02
LOST_M = 0.6
KEPT_M = 0.05
"""An object that is farther than this from where it was against the mount has been left behind."""


@dataclass(frozen=True)
class ZeroGravityGrasping(CarriageTask):
    """The carriage comes near, waits two seconds and draws back; the ball must come along without moving in the grip.

    | index | feature                                    | unit  | range       | sensor                         |
    |-------|--------------------------------------------|-------|-------------|--------------------------------|
    | 0-2   | functional part to object                  | m     | -1 to 1     | object_position, tip_position  |
    | 3-5   | object's velocity                          | m/s   | -2 to 2     | object_velocity                |
    | 6-8   | mount to object                            | m     | -1 to 1     | object_position, mount_position |
    | 9     | carriage's height, 0 at the start          | m     | -0.1 to 0.02 | carriage_height               |
    | 10    | time, 1 when the carriage has drawn back   |       | 0 to 3      | (time)                         |
    | 11    | strongest contact with the object, 1 = 5 N |       | 0 to 8      | grip                           |
    | 12    | how far the contacts face each other       |       | 0 to 1      | grip                           |
    | 13-15 | object's spin                              | rad/s | -10 to 10   | object_spin                    |

    Source: our choice; drift and spin of debris that is approached on a matched course.
    """

    name: ClassVar = "grasping/zero_gravity_grasping"
    times_s: ClassVar = (0.0, 1.0, RETREAT_S, 5.0)
    heights_m: ClassVar = (0.0, -0.10, -0.10, 0.0)
    time_limit_s: ClassVar = 15.0
    hold_s: ClassVar = 2.0
    stages: ClassVar = ((0.3, "at the object"), (0.6, "around it"), (1.0, "holding it still"))
    required_names: ClassVar = ("mount", "carriage", "carriage_lift", "object", "object_free")
    hard: ClassVar = {"drift_m_s": 0.1}

    drift_m_s: float = 0.03
    """Fastest drift of the object [m/s]."""

    @property
    def objective(self) -> str:
        """See `Task`."""
        return (
            "Catch hold of a ball of 30 mm radius and 50 to 200 g that floats without gravity, drifting at up to "
            f"{self.drift_m_s:g} m/s, and keep it still in the grip (slower than 0.02 m/s) for 2 s while the mount "
            "moves away. The mount comes within 0.06 to 0.10 m of its middle in 1 s, waits for 2 s and draws back "
            "0.10 m in 2 s."
        )

    def draw(self, rng: np.random.Generator) -> Variation:
        """Distance +-20 mm, drift and spin in any direction, mass 50 to 200 g."""
        drift, spin = rng.normal(size=(2, 3))
        drift *= rng.uniform(0.0, self.drift_m_s) / np.linalg.norm(drift)
        spin *= rng.uniform(0.0, 0.2) / np.linalg.norm(spin)
        height_m = MOUNT_M - 0.10 - rng.uniform(0.06, 0.10)
        return Variation(
            (
                *solid("object", "sphere", RADIUS_M, rng.uniform(0.05, 0.20)),
                Change("qpos", "object_free", (0.0, 0.0, height_m, 1.0, 0.0, 0.0, 0.0)),
                Change("qvel", "object_free", (*drift, *spin)),
            )
        )

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        return np.column_stack([super().features(readings, memory), readings["object_spin"]])

    def begin(self, readings: Readings) -> Memory:
        """Where the object is, seen from the mount."""
        return {"held": _from_mount_m(readings), "left": np.zeros(readings.n)}

    def remember(self, readings: Readings, memory: Memory) -> Memory:
        """Where the object was against the mount as the carriage began to draw back, and whether it was left there."""
        held = np.where((readings.time_s < RETREAT_S)[:, None], _from_mount_m(readings), memory["held"])
        left = np.linalg.norm(_from_mount_m(readings) - held, axis=1) >= KEPT_M
        return {"held": held, "left": np.maximum(memory["left"], left)}

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Three tenths for coming near, three for holding it from opposite sides, four for stillness in that hold."""
        del memory
        opposition = readings.contacts("grip").opposition()
        still = closeness(_relative_m_s(readings), within=STILL_M_S, margin=0.1)
        return 0.3 * approach(readings) + 0.3 * opposition + 0.4 * opposition * still

    def violation(self, readings: Readings) -> FloatArray:
        """The object is more than 0.3 m away from the functional part: it was pushed off."""
        return excess(away_m(readings), 0.3, full=LOST_M)

    def failed(self, readings: Readings, memory: Memory) -> BoolArray:
        """The object is out of reach for good."""
        del memory
        return away_m(readings) >= LOST_M

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """The carriage draws back, and the object, held and not drifting by itself, comes along without moving."""
        touched = readings.contacts("grip").found.any(axis=1) & (memory["left"] == 0)
        return np.asarray((readings.time_s >= RETREAT_S) & touched & (_relative_m_s(readings) < STILL_M_S))


def _from_mount_m(readings: Readings) -> FloatArray:
    return np.asarray(readings["object_position"] - readings["mount_position"])


def _relative_m_s(readings: Readings) -> FloatArray:
    return np.asarray(np.linalg.norm(readings["object_velocity"] - readings["mount_velocity"], axis=1))
