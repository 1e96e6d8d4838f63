"""Pick an object up from a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.tasks.grasping.carriage import RAISED_M, TABLE_M, Lifting, raised_m, slip_m
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import excess
from aidsr.tasks.task import Memory
from aidsr.tasks.variation import Change, Shape, Variation, solid

SHAPES: tuple[Shape, ...] = ("sphere", "cylinder", "box")
SLIP_M = 0.02
SHAKE_HZ = 2.0


@dataclass(frozen=True)
class SimpleGrasping(Lifting):
    """The carriage lowers the robot, waits two seconds and lifts it; the object must come along.

    | index | feature                                  | unit | range       | sensor                         |
    |-------|------------------------------------------|------|-------------|--------------------------------|
    | 0-2   | functional part to object                | m    | -0.8 to 0.8 | object_position, tip_position  |
    | 3-5   | object's velocity                        | m/s  | -3 to 3     | object_velocity                |
    | 6-8   | mount to object                          | m    | -0.8 to 0.8 | object_position, mount_position |
    | 9     | carriage's height, 0 at the start        | m    | -0.1 to 0.05 | carriage_height               |
    | 10    | time, 1 when the lift has ended          |      | 0 to 2.3    | (time)                         |
    | 11    | strongest contact with the object, 1 = 5 N |    | 0 to 8      | grip                           |
    | 12    | how far the contacts face each other     |      | 0 to 1      | grip                           |

    Source: our choice; sizes and masses of everyday objects that soft grippers of this size hold (SoMoGym, SofaGym).
    """

    name: ClassVar = "grasping/simple_grasping"
    time_limit_s: ClassVar = 10.0
    hold_s: ClassVar = 2.0
    required_names: ClassVar = ("mount", "table", "carriage", "carriage_lift", "object", "object_free", "object_push")
    hard: ClassVar = {"shake_n": 1.0}

    shake_n: float = 0.0
    """Amplitude of a sideways push on the lifted object, to and fro twice a second [N]."""

    @property
    def objective(self) -> str:
        """See `Task`."""
        shaken = f" while it is shaken sideways with {self.shake_n:g} N" if self.shake_n else ""
        return (
            "Pick up a sphere, cylinder or box, 50 to 70 mm across and 50 to 150 g, from a table and keep it raised "
            f"at least 0.10 m for 2 s{shaken}. The mount comes down to 0.25 m above the table within 1 s, waits for "
            "2 s and rises by 0.15 m within 1.5 s."
        )

    def draw(self, rng: np.random.Generator) -> Variation:
        """Shape, half size 25 to 35 mm, mass 50 to 150 g, +-15 mm to each side, any yaw."""
        shape = SHAPES[rng.integers(3)]
        half_m = float(rng.uniform(0.025, 0.035))
        x, y = rng.uniform(-0.015, 0.015, size=2)
        half_yaw = rng.uniform(0.0, np.pi) / 2
        pose = (x, y, TABLE_M + half_m, np.cos(half_yaw), 0.0, 0.0, np.sin(half_yaw))
        return Variation(
            (*solid("object", shape, half_m, rng.uniform(0.05, 0.15)), Change("qpos", "object_free", pose))
        )

    def script(self, readings: Readings) -> Mapping[str, FloatArray]:
        """The carriage's height, and at the hard level the push on the object once it is up."""
        lifted_for_s = readings.time_s - self.times_s[-1]
        push_n = np.where(lifted_for_s >= 0.0, self.shake_n * np.sin(2 * np.pi * SHAKE_HZ * lifted_for_s), 0.0)
        return {**super().script(readings), "object_push": push_n}

    def violation(self, readings: Readings) -> FloatArray:
        """The object is off the table, or thrown: faster than 1 m/s."""
        thrown = excess(np.linalg.norm(readings["object_velocity"], axis=1), 1.0)
        return np.maximum(_off_table(readings), thrown)

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """Raised at least 0.10 m and slipped less than 20 mm in the grip; at the hard level while being shaken."""
        ready = (readings.time_s >= self.times_s[-1]) | (self.shake_n == 0.0)
        return (raised_m(readings, memory) >= RAISED_M) & ready & (slip_m(readings, memory) < SLIP_M)

    def failed(self, readings: Readings, memory: Memory) -> BoolArray:
        """The object is off the table."""
        del memory
        return _off_table(readings)


def _off_table(readings: Readings) -> BoolArray:
    return np.asarray(readings["object_position"][:, 2] < TABLE_M - 0.02)
