"""Pick up something that breaks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.tasks.grasping.base import LIFT_PROGRESS, RAISED_M, TABLE_M, LiftTask, raised_m
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import excess
from aidsr.tasks.task import FORCE_SCALE_N, Criteria, Feature, TaskState, span
from aidsr.tasks.variation import Change, Variation, shift_words

HALF_AXES_M = np.array([0.020, 0.020, 0.027])
"""Half axes of the ellipsoid [m], which lies on its side."""
SIZE_FACTOR = (0.85, 1.15)
MASS_KG = (0.02, 0.04)
OFFSET_M = 0.01
TOGETHER = 3.0
"""Force limit of all contacts together, as a multiple of the limit of a single contact."""
LUMP_M = 0.012
LUMPS = ("object_lump_1", "object_lump_2", "object_lump_3")


@dataclass(frozen=True)
class DelicateGrasping(LiftTask):
    """The carriage lowers the robot, waits two seconds and lifts it; the object must come along and not be crushed.

    Source: our choice; an egg's or a berry's size, and the contact pressures of ultragentle soft grippers.
    """

    name: ClassVar = "grasping/delicate_grasping"
    time_limit_s: ClassVar = 12.0
    hold_s: ClassVar = 2.0
    unchanged_since: ClassVar = 8
    required_names: ClassVar = ("mount", "table", "carriage", "carriage_lift", "object", "object_free")
    features: ClassVar = (
        Feature("functional part to object", "m", (-0.8, 0.8), "object_position, tip_position", size=3),
        Feature("object's velocity", "m/s", (-3, 3), "object_velocity", size=3),
        Feature("mount to object", "m", (-0.8, 0.8), "object_position, mount_position", size=3),
        Feature("carriage's height, 0 at the start", "m", (-0.1, 0.05), "carriage_height"),
        Feature("time, 1 when the lift has ended", "", (0, 2.7), "(time)"),
        Feature(f"strongest contact with the object, 1 = {FORCE_SCALE_N:g} N", "", (0, 0.4), "grip"),
        Feature("how far the contacts face each other", "", (0, 1), "grip"),
        Feature("all contacts together, 1 = their limit", "", (0, 1), "grip"),
    )
    hard: ClassVar = {"contact_n": 1.0}

    contact_n: float = 2.0
    """Force of a single contact at which the object breaks [N]; see `TOGETHER`."""

    @property
    def objective(self) -> str:
        sizes = " x ".join(f"{2000 * half_m:g}" for half_m in HALF_AXES_M)
        return (
            f"Pick up a fragile object of {span(MASS_KG, 1000)} g, an ellipsoid of {sizes} mm or a lumpy one of that "
            f"size, and keep it raised at least {RAISED_M:.2f} m for {self.hold_s:g} s; it breaks when any contact "
            f"reaches {self.contact_n:g} N or all together {TOGETHER * self.contact_n:g} N. {self.timetable}"
        )

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=(
                f"Ellipsoid or lumpy, size +-{100 * (SIZE_FACTOR[1] - 1):g} %, mass {span(MASS_KG, 1000)} g, "
                f"+-{1000 * OFFSET_M:g} mm to each side, any yaw."
            ),
            progress=LIFT_PROGRESS,
            success=f"Raised at least {RAISED_M:.2f} m.",
            violation="Contacts beyond half of what the object bears.",
            failure="The object is broken.",
        )

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        scale, lumpy, mass_kg = rng.uniform(*SIZE_FACTOR), bool(rng.integers(2)), rng.uniform(*MASS_KG)
        half_m = scale * HALF_AXES_M
        # the long axis lies along the body's y
        inertia = (
            mass_kg
            / 5
            * np.array([half_m[0] ** 2 + half_m[2] ** 2, 2 * half_m[0] ** 2, half_m[0] ** 2 + half_m[2] ** 2])
        )
        x, y = rng.uniform(-OFFSET_M, OFFSET_M, size=2)
        half_yaw = rng.uniform(0.0, 2 * np.pi) / 2
        pose = (x, y, TABLE_M + half_m[0], np.cos(half_yaw), 0.0, 0.0, np.sin(half_yaw))
        return Variation(
            (
                Change("geom_size", "object_core", tuple(half_m)),
                *_lumps(rng, scale, lumpy=lumpy),
                Change("body_mass", "object", (mass_kg,)),
                Change("body_inertia", "object", tuple(inertia)),
                Change("qpos", "object_free", pose),
            ),
            words=(
                f"{'lumpy' if lumpy else 'smooth'}, {100 * scale:.0f} % of its size, {1000 * mass_kg:.0f} g, "
                f"{shift_words(x, y)}, turned {np.rad2deg(2 * half_yaw):.0f} deg"
            ),
        )

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        together = readings.contacts("grip").force_n.sum(axis=1) / (TOGETHER * self.contact_n)
        return np.column_stack([super().observe(readings, state), together])

    def violation(self, readings: Readings) -> FloatArray:
        return excess(self._load(readings), 0.5, full=1.0)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        return raised_m(readings, state) >= RAISED_M

    def is_failure(self, readings: Readings, state: TaskState) -> BoolArray:
        del state
        return self._load(readings) >= 1.0

    def _load(self, readings: Readings) -> FloatArray:
        """Return the contact forces as a share of those at which the object breaks, (n,)."""
        single = readings.peak_contact_n("grip") / self.contact_n
        return np.maximum(single, readings.all_contacts_n("grip") / (TOGETHER * self.contact_n))


def _lumps(rng: np.random.Generator, scale: float, *, lumpy: bool) -> tuple[Change, ...]:
    """Return the changes that make three balls stick out of the ellipsoid by 3 to 7 mm, or hide them in it."""
    changes = []
    for number, lump in enumerate(LUMPS):
        out_m = HALF_AXES_M[0] - LUMP_M + rng.uniform(0.003, 0.007)
        around = np.deg2rad(rng.uniform(-40.0, 40.0)) + (0.0, np.pi)[number % 2]
        # on the upper side: a lump below would lift the object off the table
        place = np.array([out_m * np.cos(around), (number - 1) * 0.012, abs(out_m * np.sin(around))])
        changes.append(Change("geom_size", lump, (scale * LUMP_M,) * 3))
        changes.append(Change("geom_pos", lump, tuple(scale * place) if lumpy else (0.0, 0.0, 0.0)))
    return tuple(changes)
