"""Climb three low steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.tasks.locomotion.base import LANE_HALF_WIDTH_M, LEAVES_LANE, OUT_OF_LANE, LaneTask, box_between, in_lane
from aidsr.tasks.locomotion.course import starts_beyond
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import share
from aidsr.tasks.task import Criteria, Edits, Feature, TaskState
from aidsr.tasks.variation import Change, Variation

FIRST_EDGE_M = 0.4
"""Position of the first edge along the lane [m]: a robot of the usual size starts clear of it."""
STEPS = 3
TREAD_M = 0.15
RISE_M = 0.02
SIZE_FACTOR = (0.8, 1.2)
LANDING_M = 1.0
CLIMBED = 0.8
"""Smallest share of the whole rise that counts as having climbed it."""
STARTS_BEYOND = "A part of the robot starts beyond the first edge."


@dataclass(frozen=True)
class Stairs(LaneTask):
    """The robot's centre of mass gets from before the stairs past the third edge and stays up there.

    Source: our choice, after EvoGym's terrains (risers of 0.2 body lengths; Bhatia et al. 2021), eased to what random
    gaits of good bodies climb in a third of their tries.
    """

    name: ClassVar = "locomotion/stairs"
    time_limit_s: ClassVar = 60.0
    hold_s: ClassVar = 1.0
    stages: ClassVar = ((0.2, "before the stairs"), (0.5, "on the stairs"), (1.0, "past the last edge"))
    needs_outline: ClassVar = True
    required_names: ClassVar = ("mount", "ground", "lane", "step_1", "step_2", "step_3")
    features: ClassVar = (
        *LaneTask.features,
        Feature(f"tread, 1 = {TREAD_M:g} m", "", (0.8, 1.2), "(parameters)"),
        Feature(f"rise, 1 = {1000 * RISE_M:g} mm", "", (0.8, 1.8), "(parameters)"),
    )
    hard: ClassVar = {"rise_m": 0.03}

    rise_m: float = RISE_M
    """Height of a step [m]."""

    @property
    def objective(self) -> str:
        return (
            f"Climb three steps, each about {1000 * self.rise_m:g} mm high and {TREAD_M:g} m deep, that begin "
            f"{FIRST_EDGE_M:g} m ahead, and stay for {self.hold_s:g} s beyond the third edge."
        )

    @property
    def edits(self) -> Edits:
        boxes = self._steps(self.rise_m, TREAD_M)
        return {f"geom/{box.name}": {box.field.removeprefix("geom_"): box.value} for box in boxes}

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=f"Rise and tread +-{100 * (SIZE_FACTOR[1] - 1):g} %.",
            progress=(
                "Nine tenths for the way to the third edge, one for height: for more, policies stand tall and stay."
            ),
            success=(
                "The centre of mass is past the third edge, by four fifths of all steps higher than at its lowest, "
                "and not off the side."
            ),
            violation=LEAVES_LANE,
            failure=f"{STARTS_BEYOND} {OUT_OF_LANE}",
        )

    @property
    def target(self) -> tuple[Mark, ...]:
        return (Mark(element="geom", name="goal"),)

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        rise_m, tread_m = self.rise_m * rng.uniform(*SIZE_FACTOR), TREAD_M * rng.uniform(*SIZE_FACTOR)
        words = f"rise {1000 * rise_m:.1f} mm, tread {1000 * tread_m:.0f} mm"
        return Variation(self._steps(rise_m, tread_m), {"rise_m": (rise_m,), "tread_m": (tread_m,)}, words)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        tread, rise = readings.parameters["tread_m"] / TREAD_M, readings.parameters["rise_m"] / RISE_M
        return np.column_stack([super().observe(readings, state), tread, rise])

    def reset_state(self, readings: Readings) -> TaskState:
        """Return start and height of the centre of mass, and whether a part of the robot is beyond the first edge."""
        there, beyond = in_lane(readings), starts_beyond(readings, FIRST_EDGE_M)
        return {"start": there[:, 0], "lowest": there[:, 2], "beyond": beyond}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        """Return the lowest height of the centre of mass so far: a body that sinks at first is measured from there."""
        return {**state, "lowest": np.minimum(state["lowest"], in_lane(readings)[:, 2])}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        there, last_edge_m = in_lane(readings), _last_edge_m(readings)
        way = share(there[:, 0] - state["start"], last_edge_m - state["start"])
        return 0.9 * way + 0.1 * share(there[:, 2] - state["lowest"], _climb_m(readings))

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        there = in_lane(readings)
        up = there[:, 2] - state["lowest"] >= _climb_m(readings)
        return (there[:, 0] > _last_edge_m(readings)) & up & (np.abs(there[:, 1]) < LANE_HALF_WIDTH_M)

    def losses(self, readings: Readings, state: TaskState) -> dict[str, BoolArray]:
        return {**super().losses(readings, state), STARTS_BEYOND: state["beyond"] > 0.0}

    def _steps(self, rise_m: float, tread_m: float) -> tuple[Change, ...]:
        """Return the changes that place the boxes of the steps and of the mark on the last step."""
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
