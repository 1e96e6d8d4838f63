"""Travel along a lane on flat ground."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.tasks.locomotion.lane import LANE_HALF_WIDTH_M, LaneTask, in_lane, turned_lane
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import share
from aidsr.tasks.task import Edits, Memory
from aidsr.tasks.variation import Change, Variation

GOAL_LENGTHS = 4.0
"""A long robot has to go four times its own length, so that unrolling or falling over is not travelling."""


@dataclass(frozen=True)
class FlatGround(LaneTask):
    """The robot's centre of mass travels forward and stays in the lane.

    | index | feature                                | unit | range       | sensor                                    |
    |-------|----------------------------------------|------|-------------|-------------------------------------------|
    | 0     | centre of mass along the lane          | m    | -1 to 5     | com_position, lane_position, lane_forward |
    | 1     | centre of mass to the left of the lane | m    | -1 to 1     | com_position, lane_position, lane_left    |
    | 2     | centre of mass over the ground         | m    | 0 to 1      | com_position                              |
    | 3     | speed along the lane                   | m/s  | -2 to 2     | com_velocity, lane_forward                |
    | 4     | speed to the left                      | m/s  | -2 to 2     | com_velocity, lane_left                   |
    | 5     | speed upwards                          | m/s  | -2 to 2     | com_velocity                              |
    | 6-7   | forward direction, world x and y       |      | -1 to 1     | lane_forward                              |

    Source: our choice; 1.2 m in 40 s is 0.03 m/s, which soft crawlers of this size reach (0.05 to 0.06 body lengths per
    second).
    """

    name: ClassVar = "locomotion/flat_ground"
    time_limit_s: ClassVar = 40.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((0.1, "moving forward"), (0.5, "half way"), (1.0, "at the goal"))
    required_names: ClassVar = ("mount", "ground", "lane")
    hard: ClassVar = {"goal_m": 2.4, "goal_lengths": 2 * GOAL_LENGTHS}

    goal_m: float = 1.2
    """Distance to travel [m]."""
    goal_lengths: float = GOAL_LENGTHS
    """Distance to travel in lengths of the robot; the larger one counts."""

    @property
    def objective(self) -> str:
        """See `Task`."""
        return (
            f"Travel {self.goal_m:g} m forward on flat ground within 40 s, or {self.goal_lengths:g} times the "
            "robot's own length if that is more, and stay within 0.3 m to either side of the lane's middle line."
        )

    @property
    def edits(self) -> Edits:
        """See `Task`."""
        return {"geom/finish_line": {"pos": (self.goal_m, 0.0, 0.0)}}

    def draw(self, rng: np.random.Generator) -> Variation:
        """Friction 0.6 to 1.2, lane turned by up to 20 deg to either side."""
        friction = Change("geom_friction", "ground", (rng.uniform(0.6, 1.2), 0.005, 0.0001))
        return Variation((friction, turned_lane(rng, 20.0)))

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Distance travelled forward."""
        return share(self._forward_m(readings, memory), self._goal_m(readings))

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """The whole distance, and inside the lane."""
        inside = np.abs(in_lane(readings)[:, 1]) < LANE_HALF_WIDTH_M
        return (self._forward_m(readings, memory) >= self._goal_m(readings)) & inside

    def _forward_m(self, readings: Readings, memory: Memory) -> FloatArray:
        return np.asarray(in_lane(readings)[:, 0] - memory["start"][:, 0])

    def _goal_m(self, readings: Readings) -> float:
        return max(self.goal_m, self.goal_lengths * readings.length_m)
