"""Lie along a curved surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.reaching.half_cylinder import gaps_m, half_cylinder
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import closeness, excess, share
from aidsr.tasks.task import Memory, Task
from aidsr.tasks.variation import Variation

NEAR_LENGTHS = 0.03
"""A part of the body lies on the surface when the gap is at most this share of the robot's length."""
GAP_M = 0.13
AXIS_M = 0.65
"""Height of the cylinder's axis, 0.05 m below the mount."""


@dataclass(frozen=True)
class SurfaceAdapting(Task):
    """As much of the body as possible lies along half a cylinder, smooth or with waves.

    | index | feature                                   | unit | range       | sensor                            |
    |-------|-------------------------------------------|------|-------------|-----------------------------------|
    | 0-2   | functional part to the cylinder's axis    | m    | -1 to 1     | surface_position, tip_position    |
    | 3-5   | direction in which the half cylinder looks |     | -1 to 1     | surface_back                      |
    | 6     | radius, 1 = 0.25 m                        |      | 0.3 to 1    | (parameters)                      |
    | 7     | share of the body that lies on it         |      | 0 to 1      | (outline)                         |
    | 8     | mean gap between body and surface         | m    | 0 to 1      | (outline)                         |
    | 9     | strongest contact, 1 = 5 N                |      | 0 to 8      | surface_contacts                  |

    Source: our choice. No accepted threshold was found; 3 % of the length is a third of a body's usual thickness.
    """

    name: ClassVar = "reaching/surface_adapting"
    base: ClassVar = "fixed"
    time_limit_s: ClassVar = 15.0
    hold_s: ClassVar = 1.0
    stages: ClassVar = ((0.4, "near the surface"), (0.6, "lying on it in part"), (1.0, "lying on it"))
    needs_outline: ClassVar = True
    required_names: ClassVar = ("mount", "surface")
    sensors: ClassVar = (
        TaskSensor(name="tip_position", quantity="position"),
        TaskSensor(name="surface_contacts", quantity="contacts", target="surface", slots=16),
    )
    hard: ClassVar = {"share_on_surface": 0.7}

    share_on_surface: float = 0.5

    @property
    def objective(self) -> str:
        """See `Task`."""
        return (
            f"Lie along a rounded surface for 1 s with at least {100 * self.share_on_surface:g} % of the body's "
            "length, each part within 3 % of that length, and press with at most 5 N. The surface is half a "
            "cylinder of 0.08 to 0.25 m radius, smooth or with 8 mm waves; its level axis is 0.05 m below the fixed "
            "mount and its nearest side 0.10 to 0.16 m from the line straight down, to the left or to the right."
        )

    def draw(self, rng: np.random.Generator) -> Variation:
        """Radius 0.08 to 0.25 m, distance +-30 mm, smooth or with waves, on either side."""
        radius_m, gap_m = rng.uniform(0.08, 0.25), GAP_M + rng.uniform(-0.03, 0.03)
        side, waves = (1.0, -1.0)[rng.integers(2)], bool(rng.integers(2))
        place_m = (side * (gap_m + radius_m), 0.0, AXIS_M)
        return Variation(half_cylinder(place_m, radius_m, waves=waves), {"radius_m": (radius_m,)})

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        del memory
        return np.column_stack(
            [
                readings["surface_position"] - readings["tip_position"],
                -readings["surface_back"],
                readings.parameters["radius_m"] / 0.25,
                _share_on_surface(readings),
                np.clip(gaps_m(readings), 0.0, 1.0).mean(axis=1),
                readings.contacts("surface_contacts").force_n.max(axis=1) / 5.0,
            ]
        )

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Half for the body's nearness to the surface, half for the share of it that lies there."""
        del memory
        outline = readings.body
        near = closeness(gaps_m(readings), within=NEAR_LENGTHS * readings.length_m, margin=0.2) @ outline.length_share
        return 0.5 * near + 0.5 * share(_share_on_surface(readings), self.share_on_surface)

    def violation(self, readings: Readings) -> FloatArray:
        """A contact of more than 5 N."""
        return excess(readings.peak_contact_n("surface_contacts"), 5.0)

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """Enough of the body lies on the surface."""
        del memory
        return _share_on_surface(readings) >= self.share_on_surface


def _share_on_surface(readings: Readings) -> FloatArray:
    """Return the share of the body's length that lies on the surface, (n,)."""
    on = gaps_m(readings) <= NEAR_LENGTHS * readings.length_m
    return np.asarray(on @ readings.body.length_share)
