"""Find a way between obstacles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.tasks.locomotion.base import LANE_HALF_WIDTH_M, LEAVES_LANE, OUT_OF_LANE, LaneTask, in_lane
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import share
from aidsr.tasks.task import Criteria, Feature, TaskState, span
from aidsr.tasks.variation import Change, Variation

GOAL_M = 1.0
OBSTACLES = 6
"""Boxes and cylinders in turn, as the environment has them."""
HALF_WIDTH_M = (0.02, 0.03)
HEIGHT_M = 0.04
FIELD_M = ((0.35, 1.2), (-0.28, 0.28))
"""Where their middles lie, along and across the lane."""
NEAREST = 3


@dataclass(frozen=True)
class Obstacles(LaneTask):
    """The robot's centre of mass travels a metre between obstacles and stays in the lane.

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
    features: ClassVar = (
        *LaneTask.features,
        Feature(
            "centre of mass to the three nearest obstacles, along and to the left each",
            "m",
            (-1.5, 1.5),
            "com_position, lane_*, (parameters)",
            size=6,
        ),
    )
    hard: ClassVar = {"gap_m": 0.10}

    gap_m: float = 0.15
    """Least free way between two obstacles [m]."""

    @property
    def objective(self) -> str:
        return (
            f"Travel {GOAL_M:.1f} m forward between boxes and cylinders {span(HALF_WIDTH_M, 2000)} mm wide and "
            f"{1000 * HEIGHT_M:g} mm high, at least {1000 * self.gap_m:g} mm apart, within {self.time_limit_s:g} s, "
            f"and stay within {LANE_HALF_WIDTH_M:g} m to either side of the lane's middle line."
        )

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation="Widths and places of the obstacles.",
            progress="Distance travelled forward.",
            success="A metre forward, and inside the lane.",
            violation=LEAVES_LANE,
            failure=OUT_OF_LANE,
        )

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        half_m = rng.uniform(*HALF_WIDTH_M, size=OBSTACLES)
        places = _scatter(rng, half_m, self.gap_m)
        changes: list[Change] = []
        for number, ((x, y), half) in enumerate(zip(places, half_m, strict=True), start=1):
            size = (half, half, HEIGHT_M / 2) if number % 2 else (half, HEIGHT_M / 2, 0.0)
            changes.append(Change("geom_size", f"obstacle_{number}", size))
            changes.append(Change("geom_pos", f"obstacle_{number}", (x, y, HEIGHT_M / 2)))
        return Variation(tuple(changes), {"places_m": tuple(places.ravel())})

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        ways = readings.parameters["places_m"].reshape(readings.n, OBSTACLES, 2) - in_lane(readings)[:, None, :2]
        order = np.argsort(np.linalg.norm(ways, axis=2), axis=1)[:, :NEAREST]
        nearest = np.take_along_axis(ways, order[:, :, None], axis=1).reshape(readings.n, -1)
        return np.column_stack([super().observe(readings, state), nearest])

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        return share(in_lane(readings)[:, 0] - state["start"][:, 0], GOAL_M)

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        there = in_lane(readings)
        inside = np.abs(there[:, 1]) < LANE_HALF_WIDTH_M
        return (there[:, 0] - state["start"][:, 0] >= GOAL_M) & inside


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
