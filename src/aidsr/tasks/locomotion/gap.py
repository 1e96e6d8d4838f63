"""Get across a gap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.locomotion.lane import LaneTask, box_between, outline_in_lane, turned_lane
from aidsr.tasks.readings import TOUCH_N, BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import share
from aidsr.tasks.task import Edits, Memory
from aidsr.tasks.variation import Change, Variation

EDGE_M = 0.4
"""Where the gap begins: a robot of the usual size starts clear of it."""
PAST_M = 0.02
LONG_M, HALF_WIDTH_M, THICK_M = 1.4, 0.5, 0.14
"""Size of a platform. Its thickness leaves 10 mm over the bottom, so that nothing crawls under it."""


@dataclass(frozen=True)
class Gap(LaneTask):
    """Every part of the robot gets past the far edge.

    | index | feature                                | unit | range       | sensor                                    |
    |-------|----------------------------------------|------|-------------|-------------------------------------------|
    | 0     | centre of mass along the lane          | m    | -1 to 5     | com_position, lane_position, lane_forward |
    | 1     | centre of mass to the left of the lane | m    | -1 to 1     | com_position, lane_position, lane_left    |
    | 2     | centre of mass over the ground         | m    | 0 to 1      | com_position                              |
    | 3     | speed along the lane                   | m/s  | -2 to 2     | com_velocity, lane_forward                |
    | 4     | speed to the left                      | m/s  | -2 to 2     | com_velocity, lane_left                   |
    | 5     | speed upwards                          | m/s  | -2 to 2     | com_velocity                              |
    | 6-7   | forward direction, world x and y       |      | -1 to 1     | lane_forward                              |
    | 8     | rearmost part along the lane           | m    | -1 to 2     | (outline)                                 |
    | 9     | foremost part along the lane           | m    | -1 to 2     | (outline)                                 |
    | 10    | width of the gap, 1 = 0.10 m           |      | 0.6 to 1.5  | (parameters)                              |

    Source: our choice, after EvoGym's terrains (gaps of a body length; Bhatia et al. 2021), eased towards the 0.15 body
    lengths that real soft robots cross.
    """

    name: ClassVar = "locomotion/gap"
    time_limit_s: ClassVar = 40.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((0.1, "moving forward"), (0.6, "at the gap"), (1.0, "on the far side"))
    needs_outline: ClassVar = True
    required_names: ClassVar = ("mount", "lane", "near_platform", "far_platform", "pit")
    sensors: ClassVar = (*LaneTask.sensors, TaskSensor(name="pit_force", quantity="contact_force", target="pit"))
    hard: ClassVar = {"narrowest_m": 0.15, "widest_m": 0.15}
    hard_words: ClassVar = {"draw": "Direction of approach +-15 deg."}

    narrowest_m: float = 0.06
    widest_m: float = 0.10

    @property
    def objective(self) -> str:
        """See `Task`."""
        width = f"{1000 * self.narrowest_m:g}" + f" to {1000 * self.widest_m:g}" * (self.narrowest_m < self.widest_m)
        return (
            f"Get across a gap {width} mm wide and 0.15 m deep that begins 0.4 m ahead, with every part at least 20 "
            "mm past the far edge, and never touch the bottom."
        )

    @property
    def edits(self) -> Edits:
        """See `Task`."""
        boxes = self._platforms((self.narrowest_m + self.widest_m) / 2)
        return {f"geom/{box.name}": {box.field.removeprefix("geom_"): box.value} for box in boxes}

    def draw(self, rng: np.random.Generator) -> Variation:
        """Width 60 to 100 mm, direction of approach +-15 deg."""
        width_m = rng.uniform(self.narrowest_m, self.widest_m)
        return Variation((*self._platforms(width_m), turned_lane(rng, 15.0)), {"width_m": (width_m,)})

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        front_m = (outline_in_lane(readings)[:, :, 0] + readings.body.radius_m).max(axis=1)
        width = readings.parameters["width_m"] / 0.10
        return np.column_stack([super().features(readings, memory), _rear_m(readings), front_m, width])

    def begin(self, readings: Readings) -> Memory:
        """Where the rearmost part starts."""
        return {"rear": _rear_m(readings)}

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Way of the rearmost part to beyond the far edge."""
        return share(_rear_m(readings) - memory["rear"], _goal_m(readings) - memory["rear"])

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """Every part is past the far edge."""
        del memory
        return _rear_m(readings) >= _goal_m(readings)

    def failed(self, readings: Readings, memory: Memory) -> BoolArray:
        """The robot touches the bottom, or is out of the lane."""
        return super().failed(readings, memory) | (readings.peak_force_n("pit_force") > TOUCH_N)

    def _platforms(self, width_m: float) -> tuple[Change, ...]:
        low, far = (EDGE_M - LONG_M, -HALF_WIDTH_M, -THICK_M), EDGE_M + width_m
        near = box_between("near_platform", low, (EDGE_M, HALF_WIDTH_M, 0.0))
        beyond = box_between("far_platform", (far, -HALF_WIDTH_M, -THICK_M), (far + LONG_M, HALF_WIDTH_M, 0.0))
        return (*near, *beyond, Change("geom_pos", "finish_line", (far + PAST_M, 0.0, 0.0)))


def _rear_m(readings: Readings) -> FloatArray:
    """Return where the rearmost part is along the lane, (n,) [m]."""
    return np.asarray((outline_in_lane(readings)[:, :, 0] - readings.body.radius_m).min(axis=1))


def _goal_m(readings: Readings) -> FloatArray:
    return EDGE_M + readings.parameters["width_m"][:, 0] + PAST_M
