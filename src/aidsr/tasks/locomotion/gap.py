"""Get across a gap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.locomotion.base import LEAVES_LANE, LaneTask, box_between, turned_lane
from aidsr.tasks.locomotion.course import FALLS_BACK, OneWayTask, front_m, rear_m, starts_beyond
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import TOUCH_N, BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import share
from aidsr.tasks.task import Criteria, Edits, Feature, TaskState, span
from aidsr.tasks.variation import Change, Variation, turn_words

EDGE_M = 1.0
"""Position of the gap's near edge along the lane [m]: far enough that no robot gets there by chance."""
DEPTH_M = 0.15
WIDTH_M = (0.06, 0.10)
TURN_DEG = 15.0
PAST_M = 0.02
LONG_M, HALF_WIDTH_M, THICK_M = 1.8, 0.5, 0.14
"""Length, half width and thickness of a platform [m]. It is 10 mm above the bottom: no robot crawls under it."""
STARTS_BEYOND = "A part of the robot starts beyond the near edge."
ON_THE_BOTTOM = "It touches the bottom."


@dataclass(frozen=True)
class Gap(OneWayTask):
    """Every part of the robot gets from before the near edge past the far one, without falling back far.

    Source: our choice, after EvoGym's terrains (gaps of a body length; Bhatia et al. 2021), eased towards the 0.15 body
    lengths that real soft robots cross.
    """

    name: ClassVar = "locomotion/gap"
    time_limit_s: ClassVar = 40.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((0.1, "moving forward"), (0.6, "at the gap"), (1.0, "on the far side"))
    decisive: ClassVar = "on the far side"
    needs_outline: ClassVar = True
    required_names: ClassVar = ("mount", "lane", "near_platform", "far_platform", "pit")
    sensors: ClassVar = (*LaneTask.sensors, TaskSensor(name="pit_force", quantity="contact_force", target="pit"))
    features: ClassVar = (
        *LaneTask.features,
        Feature("rearmost part along the lane", "m", (-1, 2), "(outline)"),
        Feature("foremost part along the lane", "m", (-1, 2), "(outline)"),
        Feature(f"width of the gap, 1 = {WIDTH_M[1]:.2f} m", "", (0.6, 1.5), "(parameters)"),
    )
    hard: ClassVar = {"narrowest_m": 0.15, "widest_m": 0.15}

    narrowest_m: float = WIDTH_M[0]
    widest_m: float = WIDTH_M[1]

    @property
    def objective(self) -> str:
        return (
            f"Get across a gap {self._width_mm} mm wide and {DEPTH_M:g} m deep that begins {EDGE_M:g} m ahead, with "
            f"every part at least {1000 * PAST_M:g} mm past the far edge, and never touch the bottom."
        )

    @property
    def edits(self) -> Edits:
        boxes = self._platforms((self.narrowest_m + self.widest_m) / 2)
        return {f"geom/{box.name}": {box.field.removeprefix("geom_"): box.value} for box in boxes}

    @property
    def criteria(self) -> Criteria:
        approach = f"irection of approach +-{TURN_DEG:g} deg."
        varies = self.narrowest_m < self.widest_m
        return Criteria(
            variation=f"Width {self._width_mm} mm, d{approach}" if varies else f"D{approach}",
            progress="Way of the rearmost part to beyond the far edge.",
            success="Every part is past the far edge.",
            violation=LEAVES_LANE,
            failure=f"{STARTS_BEYOND} {ON_THE_BOTTOM} {FALLS_BACK}",
        )

    @property
    def target(self) -> tuple[Mark, ...]:
        return (Mark(element="geom", name="finish_line"),)

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        width_m, turn_deg = rng.uniform(self.narrowest_m, self.widest_m), rng.uniform(-TURN_DEG, TURN_DEG)
        words = f"gap {1000 * width_m:.0f} mm wide, lane turned {turn_words(turn_deg)}"
        return Variation((*self._platforms(width_m), turned_lane(turn_deg)), {"width_m": (width_m,)}, words)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        width = readings.parameters["width_m"] / WIDTH_M[1]
        return np.column_stack([super().observe(readings, state), rear_m(readings), front_m(readings), width])

    def reset_state(self, readings: Readings) -> TaskState:
        beyond = starts_beyond(readings, EDGE_M)
        return {**super().reset_state(readings), "rear": rear_m(readings), "beyond": beyond}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        return share(rear_m(readings) - state["rear"], _goal_m(readings) - state["rear"])

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        del state
        return rear_m(readings) >= _goal_m(readings)

    def losses(self, readings: Readings, state: TaskState) -> dict[str, BoolArray]:
        own = {STARTS_BEYOND: state["beyond"] > 0.0, ON_THE_BOTTOM: readings.peak_force_n("pit_force") > TOUCH_N}
        return {**super().losses(readings, state), **own}

    @property
    def _width_mm(self) -> str:
        return span((self.narrowest_m, self.widest_m), 1000)

    def _platforms(self, width_m: float) -> tuple[Change, ...]:
        low, far = (EDGE_M - LONG_M, -HALF_WIDTH_M, -THICK_M), EDGE_M + width_m
        near = box_between("near_platform", low, (EDGE_M, HALF_WIDTH_M, 0.0))
        beyond = box_between("far_platform", (far, -HALF_WIDTH_M, -THICK_M), (far + LONG_M, HALF_WIDTH_M, 0.0))
        return (*near, *beyond, Change("geom_pos", "finish_line", (far + PAST_M, 0.0, 0.0)))


def _goal_m(readings: Readings) -> FloatArray:
    return EDGE_M + readings.parameters["width_m"][:, 0] + PAST_M
