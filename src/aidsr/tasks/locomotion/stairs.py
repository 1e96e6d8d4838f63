"""Climb three low steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.tasks.locomotion.lane import LANE_HALF_WIDTH_M, LaneTask, box_between, in_lane
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import share
from aidsr.tasks.task import Edits, Memory
from aidsr.tasks.variation import Change, Variation

FIRST_EDGE_M = 0.4
"""Where the first step begins: a robot of the usual size starts clear of it."""
STEPS = 3
TREAD_M = 0.15
LANDING_M = 1.0
CLIMBED = 0.8
"""Share of the whole rise that counts as being up."""


@dataclass(frozen=True)
class Stairs(LaneTask):
    """The robot's centre of mass gets past the third edge and stays up there.

    | index | feature                                | unit | range       | sensor                                    |
    |-------|----------------------------------------|------|-------------|-------------------------------------------|
    | 0     | centre of mass along the lane          | m    | -1 to 5     | com_position, lane_position, lane_forward |
    | 1     | centre of mass to the left of the lane | m    | -1 to 1     | com_position, lane_position, lane_left    |
    | 2     | centre of mass over the ground         | m    | 0 to 1      | com_position                              |
    | 3     | speed along the lane                   | m/s  | -2 to 2     | com_velocity, lane_forward                |
    | 4     | speed to the left                      | m/s  | -2 to 2     | com_velocity, lane_left                   |
    | 5     | speed upwards                          | m/s  | -2 to 2     | com_velocity                              |
    | 6-7   | forward direction, world x and y       |      | -1 to 1     | lane_forward                              |
    | 8     | tread, 1 = 0.15 m                      |      | 0.8 to 1.2  | (parameters)                              |
    | 9     | rise, 1 = 20 mm                        |      | 0.8 to 1.8  | (parameters)                              |

    Source: our choice, after EvoGym's terrains (risers of 0.2 body lengths; Bhatia et al. 2021), eased to what random
    gaits of good bodies climb in a third of their tries.
    """

    name: ClassVar = "locomotion/stairs"
    time_limit_s: ClassVar = 60.0
    hold_s: ClassVar = 1.0
    stages: ClassVar = ((0.2, "before the stairs"), (0.5, "on the stairs"), (1.0, "past the last edge"))
    required_names: ClassVar = ("mount", "ground", "lane", "step_1", "step_2", "step_3")
    hard: ClassVar = {"rise_m": 0.03}

    rise_m: float = 0.02
    """Height of a step [m]."""

    @property
    def objective(self) -> str:
        """See `Task`."""
        return (
            f"Climb three steps, each about {1000 * self.rise_m:g} mm high and 0.15 m deep, that begin 0.4 m ahead, "
            "and stay for 1 s beyond the third edge."
        )

    @property
    def edits(self) -> Edits:
        """See `Task`."""
        boxes = self._steps(self.rise_m, TREAD_M)
        return {f"geom/{box.name}": {box.field.removeprefix("geom_"): box.value} for box in boxes}

    def draw(self, rng: np.random.Generator) -> Variation:
        """Rise and tread +-20 %."""
        rise_m, tread_m = self.rise_m * rng.uniform(0.8, 1.2), TREAD_M * rng.uniform(0.8, 1.2)
        return Variation(self._steps(rise_m, tread_m), {"rise_m": (rise_m,), "tread_m": (tread_m,)})

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table above."""
        tread, rise = readings.parameters["tread_m"] / TREAD_M, readings.parameters["rise_m"] / 0.02
        return np.column_stack([super().features(readings, memory), tread, rise])

    def begin(self, readings: Readings) -> Memory:
        """Where the centre of mass starts."""
        there = in_lane(readings)
        return {"start": there[:, 0], "lowest": there[:, 2]}

    def remember(self, readings: Readings, memory: Memory) -> Memory:
        """The lowest height of the centre of mass: a body that sinks down at first does not have to rise again."""
        return {"start": memory["start"], "lowest": np.minimum(memory["lowest"], in_lane(readings)[:, 2])}

    def progress(self, readings: Readings, memory: Memory) -> FloatArray:
        """Nine tenths for the way to the third edge, one for height: for more, policies stand tall and stay."""
        there, last_edge_m = in_lane(readings), _last_edge_m(readings)
        way = share(there[:, 0] - memory["start"], last_edge_m - memory["start"])
        return 0.9 * way + 0.1 * share(there[:, 2] - memory["lowest"], _climb_m(readings))

    def succeeded(self, readings: Readings, memory: Memory) -> BoolArray:
        """Past the third edge, up by four fifths of all steps, and not off the side."""
        there = in_lane(readings)
        up = there[:, 2] - memory["lowest"] >= _climb_m(readings)
        return (there[:, 0] > _last_edge_m(readings)) & up & (np.abs(there[:, 1]) < LANE_HALF_WIDTH_M)

    def _steps(self, rise_m: float, tread_m: float) -> tuple[Change, ...]:
        """Return the boxes of the steps and of the mark on the last of them."""
        edges = [FIRST_EDGE_M + tread_m * step for step in range(STEPS)]
        boxes: list[Change] = []
        for step, edge in enumerate(edges, start=1):
            top = (edge + LANDING_M, LANE_HALF_WIDTH_M, rise_m * step)
            boxes += box_between(f"step_{step}", (edge, -LANE_HALF_WIDTH_M, 0.0), top)
        x, y, z = top
        boxes += box_between("goal", (x - LANDING_M, -y, z), (x, y, z + 0.001))
        return tuple(boxes)


def _last_edge_m(readings: Readings) -> FloatArray:
    return FIRST_EDGE_M + (STEPS - 1) * readings.parameters["tread_m"][:, 0]


def _climb_m(readings: Readings) -> FloatArray:
    return CLIMBED * STEPS * readings.parameters["rise_m"][:, 0]
