"""Travel along a lane on flat ground."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.tasks.locomotion.base import LANE_HALF_WIDTH_M, LEAVES_LANE, in_lane, turned_lane
from aidsr.tasks.locomotion.course import FALLS_BACK, OneWayTask
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import share
from aidsr.tasks.task import FRICTION_ELSE, Criteria, Edits, TaskState, span
from aidsr.tasks.variation import Change, Variation, turn_words

FRICTION = (0.6, 1.2)
TURN_DEG = 15.0
GOAL_LENGTHS = 4.0
"""Distance to travel in lengths of the robot. A long robot must go four times its own length, so that unrolling or
falling over is not enough."""


@dataclass(frozen=True)
class FlatGround(OneWayTask):
    """The robot's centre of mass travels forward, without falling back far, and stays in the lane.

    Source: our choice; 1.5 m in 40 s is 0.04 m/s, and sinusoidal gaits of the built-in crawlers and worms reach 0.06 to
    0.2 m/s.
    """

    name: ClassVar = "locomotion/flat_ground"
    time_limit_s: ClassVar = 40.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((0.1, "moving forward"), (0.5, "half way"), (1.0, "at the goal"))
    required_names: ClassVar = ("mount", "ground", "lane")
    hard: ClassVar = {"goal_m": 3.0, "goal_lengths": 2 * GOAL_LENGTHS}

    goal_m: float = 1.5
    """Distance to travel [m]."""
    goal_lengths: float = GOAL_LENGTHS
    """Distance to travel in lengths of the robot; the larger of the two distances counts."""

    @property
    def objective(self) -> str:
        return (
            f"Travel {self.goal_m:g} m forward on flat ground within {self.time_limit_s:g} s, or "
            f"{self.goal_lengths:g} times the robot's own length if that is more, and stay within "
            f"{LANE_HALF_WIDTH_M:g} m to either side of the lane's middle line."
        )

    @property
    def edits(self) -> Edits:
        return {"geom/finish_line": {"pos": (self.goal_m, 0.0, 0.0)}}

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=f"Friction {span(FRICTION)}, lane turned by up to {TURN_DEG:g} deg to either side.",
            progress="Distance travelled forward.",
            success="The whole distance, and inside the lane.",
            violation=LEAVES_LANE,
            failure=FALLS_BACK,
        )

    @property
    def target(self) -> tuple[Mark, ...]:
        return (Mark(element="geom", name="finish_line"),)

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        friction, turn_deg = rng.uniform(*FRICTION), rng.uniform(-TURN_DEG, TURN_DEG)
        rough = Change("geom_friction", "ground", (friction, *FRICTION_ELSE))
        words = f"lane turned {turn_words(turn_deg)}, friction {friction:.2f}"
        return Variation((rough, turned_lane(turn_deg)), words=words)

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        return share(self._forward_m(readings, state), self._goal_m(readings))

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        inside = np.abs(in_lane(readings)[:, 1]) < LANE_HALF_WIDTH_M
        return (self._forward_m(readings, state) >= self._goal_m(readings)) & inside

    def _forward_m(self, readings: Readings, state: TaskState) -> FloatArray:
        return np.asarray(in_lane(readings)[:, 0] - state["start"][:, 0])

    def _goal_m(self, readings: Readings) -> float:
        return max(self.goal_m, self.goal_lengths * readings.length_m)
