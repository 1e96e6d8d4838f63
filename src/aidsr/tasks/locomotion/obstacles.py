"""Find a way between obstacles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.tasks.locomotion.lane import LANE_HALF_WIDTH_M, LaneTask, in_lane
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import share
from aidsr.tasks.task import Memory
from aidsr.tasks.variation import Change, Variation

GOAL_M = 1.0
OBSTACLES = 6
"""Boxes and cylinders in turn, as the environment has them."""
HEIGHT_M = 0.04
FIELD_M = ((0.35, 1.2), (-0.28, 0.28))
"""Where their middles lie, along and across the lane."""
NEAREST = 3


@dataclass(frozen=True)
class Obstacles(LaneTask):
    """The robot's centre of mass travels a metre between obstacles and stays in the lane.

    | index | feature                                | unit | range       | sensor                                    |
    |-------|----------------------------------------|------|-------------|-------------------------------------------|
    | 0     | centre of mass along the lane          | m    | -1 to 5     | com_position, lane_position, lane_forward |
    | 1     | centre of mass to the left of the lane | m    | -1 to 1     | com_position, lane_position, lane_left    |
    | 2     | centre of mass over the ground         | m    | 0 to 1      | com_position                              |
    | 3     | speed along the lane                   | m/s  | -2 to 2     | com_velocity, lane_forward                |
    | 4     | speed to the left                      | m/s  | -2 to 2     | com_velocity, lane_left                   |
    | 5     | speed upwards                          | m/s  | -2 to 2     | com_velocity                              |
    | 6-7   | forward direction, world x and y       |      | -1 to 1     | lane_forward                              |
    | 8-13  | centre of mass to the three nearest    | m    | -1.5 to 1.5 | com_position, lane_*, (parameters)        |
    |       | obstacles, along and to the left each  |      |             |                                           |

    Source: our choice; obstacles as high as the robots are thick, gaps for one to pass.
    """

    name: ClassVar = "locomotion/obstacles"
    time_limit_s: ClassVar = 60.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((0.1, "moving forward"), (0.5, "half way"), (1.0, "past all obstacles"))
    required_names: ClassVar = (
        "mount",
        "ground",
        "lane",
        *(f"obstacle_{number}" for number in range(1, OBSTACLES + 1)),
    )
    hard: ClassVar = {"gap_m": 0.10}

    gap_m: float = 0.15
    """Least free way between two obstacles [m]."""

    @property
    def objective(self) -> str:
        """See `Task`."""
        return (
            "Travel 1.0 m forward between boxes and cylinders 40 to 60 mm wide and 40 mm high, at least "
            f"{1000 * self.gap_m:g} mm apart, within 60 s, and stay within 0.3 m to either side of the lane's middle "
            "line."
        )

    def draw(self, rng: np.random.Generator) -> Variation:
        """Widths and places of the obstacles."""
        half_m = rng.uniform(0.02, 0.03, size=OBSTACLES)
        places = _scatter(rng, half_m, self.gap_m)
        changes: list[Change] = []
        for number, ((x, y), half) in enumerate(zip(places, half_m, strict=True), start=1):
            size = (half, half, HEIGHT_M / 2) if number % 2 else (half, HEIGHT_M / 2, 0.0)
            changes.append(Change("geom_size", f"obstacle_{number}", size))
            changes.append(Change("geom_pos", f"obstacle_{number}", (x, y, HEIGHT_M / 2)))
        return Variation(tuple(changes), {"places_m": tuple(places.ravel())})

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        ways = readings.parameters["places_m"].reshape(readings.n, OBSTACLES, 2) - in_lane(readings)[:, None, :2]
        order = np.argsort(np.linalg.norm(ways, axis=2), axis=1)[:, :NEAREST]
        nearest = np.take_along_axis(ways, order[:, :, None], axis=1).reshape(readings.n, -1)
        return np.column_stack([super().features(readings, memory), nearest])

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Distance travelled forward."""
        return share(in_lane(readings)[:, 0] - memory["start"][:, 0], GOAL_M)

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """A metre forward, and inside the lane."""
        there = in_lane(readings)
        inside = np.abs(there[:, 1]) < LANE_HALF_WIDTH_M
        return (there[:, 0] - memory["start"][:, 0] >= GOAL_M) & inside


def _scatter(rng: np.random.Generator, half_m: FloatArray, gap_m: float) -> FloatArray:
    """Return places with at least `gap_m` between any two obstacles, (OBSTACLES, 2) [m].

    Boxes count with their diagonals. A layout that leaves no room for the next obstacle is thrown away as a whole.
    """
    reach_m = half_m * np.where(np.arange(OBSTACLES) % 2 == 0, np.sqrt(2), 1.0)
    (x_low, x_high), (y_low, y_high) = FIELD_M
    while True:
        places = np.empty((0, 2))
        for _ in range(200):
            place = np.array([rng.uniform(x_low, x_high), rng.uniform(y_low, y_high)])
            free = np.linalg.norm(places - place, axis=1) - reach_m[: len(places)] - reach_m[len(places)]
            if (free >= gap_m).all():
                places = np.vstack([places, place])
            if len(places) == OBSTACLES:
                return places
