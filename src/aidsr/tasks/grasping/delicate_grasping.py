"""Pick up something that breaks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.tasks.grasping.carriage import RAISED_M, TABLE_M, Lifting, raised_m
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import excess
from aidsr.tasks.task import Memory
from aidsr.tasks.variation import Change, Variation

HALF_AXES_M = np.array([0.020, 0.020, 0.027])
"""Half axes of the ellipsoid, which lies on its side."""
LUMP_M = 0.012
LUMPS = ("object_lump_1", "object_lump_2", "object_lump_3")


@dataclass(frozen=True)
class DelicateGrasping(Lifting):
    """The carriage lowers the robot, waits two seconds and lifts it; the object must come along and not be crushed.

    | index | feature                                  | unit | range       | sensor                         |
    |-------|------------------------------------------|------|-------------|--------------------------------|
    | 0-2   | functional part to object                | m    | -0.8 to 0.8 | object_position, tip_position  |
    | 3-5   | object's velocity                        | m/s  | -3 to 3     | object_velocity                |
    | 6-8   | mount to object                          | m    | -0.8 to 0.8 | object_position, mount_position |
    | 9     | carriage's height, 0 at the start        | m    | -0.1 to 0.05 | carriage_height               |
    | 10    | time, 1 when the lift has ended          |      | 0 to 2.7    | (time)                         |
    | 11    | strongest contact with the object, 1 = 5 N |    | 0 to 0.4    | grip                           |
    | 12    | how far the contacts face each other     |      | 0 to 1      | grip                           |
    | 13    | all contacts together, 1 = their limit   |      | 0 to 1      | grip                           |

    Source: our choice; an egg's or a berry's size, and the contact pressures of ultragentle soft grippers.
    """

    name: ClassVar = "grasping/delicate_grasping"
    time_limit_s: ClassVar = 12.0
    hold_s: ClassVar = 2.0
    required_names: ClassVar = ("mount", "table", "carriage", "carriage_lift", "object", "object_free")
    hard: ClassVar = {"contact_n": 1.0}

    contact_n: float = 2.0
    """What a single contact may bear [N]; all together may bear three times as much."""

    @property
    def objective(self) -> str:
        """See `Task`."""
        return (
            "Pick up a fragile object of 20 to 40 g, an ellipsoid of 40 x 40 x 54 mm or a lumpy one of that size, "
            f"and keep it raised at least 0.10 m for 2 s; it breaks when any contact reaches {self.contact_n:g} N or "
            f"all together {3 * self.contact_n:g} N. The mount comes down to 0.25 m above the table within 1 s, "
            "waits for 2 s and rises by 0.15 m within 1.5 s."
        )

    def draw(self, rng: np.random.Generator) -> Variation:
        """Ellipsoid or lumpy, size +-15 %, mass 20 to 40 g, +-10 mm to each side, any yaw."""
        scale, lumpy, mass_kg = rng.uniform(0.85, 1.15), bool(rng.integers(2)), rng.uniform(0.02, 0.04)
        half_m = scale * HALF_AXES_M
        # the long axis lies along the body's y
        inertia = (
            mass_kg
            / 5
            * np.array([half_m[0] ** 2 + half_m[2] ** 2, 2 * half_m[0] ** 2, half_m[0] ** 2 + half_m[2] ** 2])
        )
        x, y = rng.uniform(-0.01, 0.01, size=2)
        half_yaw = rng.uniform(0.0, 2 * np.pi) / 2
        pose = (x, y, TABLE_M + half_m[0], np.cos(half_yaw), 0.0, 0.0, np.sin(half_yaw))
        return Variation(
            (
                Change("geom_size", "object_core", tuple(half_m)),
                *_lumps(rng, scale, lumpy=lumpy),
                Change("body_mass", "object", (mass_kg,)),
                Change("body_inertia", "object", tuple(inertia)),
                Change("qpos", "object_free", pose),
            )
        )

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        together = readings.contacts("grip").force_n.sum(axis=1) / (3 * self.contact_n)
        return np.column_stack([super().features(readings, memory), together])

    def violation(self, readings: Readings) -> FloatArray:
        """Contacts beyond half of what the object bears."""
        return excess(self._load(readings), 0.5, full=1.0)

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """Raised at least 0.10 m."""
        return raised_m(readings, memory) >= RAISED_M

    def failed(self, readings: Readings, memory: Memory) -> BoolArray:
        """The object is broken."""
        del memory
        return self._load(readings) >= 1.0

    def _load(self, readings: Readings) -> FloatArray:
        """Return the contacts' forces as a share of what the object bears, (n,)."""
        single = readings.peak_contact_n("grip") / self.contact_n
        return np.maximum(single, readings.peak_contact_n("grip", together=True) / (3 * self.contact_n))


def _lumps(rng: np.random.Generator, scale: float, *, lumpy: bool) -> tuple[Change, ...]:
    """Return the changes that let three balls look out of the ellipsoid by 3 to 7 mm, or hide them in it."""
    changes = []
    for number, lump in enumerate(LUMPS):
        out_m = HALF_AXES_M[0] - LUMP_M + rng.uniform(0.003, 0.007)
        around = np.deg2rad(rng.uniform(-40.0, 40.0)) + (0.0, np.pi)[number % 2]
        # above the table: a lump below would lift the object off it
        place = np.array([out_m * np.cos(around), (number - 1) * 0.012, abs(out_m * np.sin(around))])
        changes.append(Change("geom_size", lump, (scale * LUMP_M,) * 3))
        changes.append(Change("geom_pos", lump, tuple(scale * place) if lumpy else (0.0, 0.0, 0.0)))
    return tuple(changes)
