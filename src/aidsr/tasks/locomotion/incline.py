"""Go up an incline."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.tasks.locomotion.base import LANE_HALF_WIDTH_M, LEAVES_LANE, OUT_OF_LANE, LaneTask, box_between, in_lane
from aidsr.tasks.locomotion.course import starts_beyond
from aidsr.tasks.mark import Mark
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import share
from aidsr.tasks.task import FRICTION_ELSE, Criteria, Edits, Feature, TaskState, span
from aidsr.tasks.variation import Change, Variation

START_M = 0.35
"""Position of the beginning of the incline along the lane [m]: a robot of the usual size starts clear of it."""
LENGTH_M = 0.35
"""Length of the incline along its slope [m]."""
PLATEAU_M = 0.8
HALF_WIDTH_M = 0.45
THICKNESS_M = 0.02
"""Half of the ramp's thickness [m]."""
SPREAD_DEG = 2.0
FRICTION = (0.7, 1.1)
STARTS_BEYOND = "A part of the robot starts beyond the beginning of the incline."
CLIMBED = 0.8
"""Smallest share of the whole rise that counts as having climbed it."""


@dataclass(frozen=True)
class Incline(LaneTask):
    """The robot's centre of mass gets up an even incline and stays on the plateau.

    Source: our choice: friction of 0.7, the smallest here, holds a body at rest on a slope of 35 deg.
    """

    name: ClassVar = "locomotion/incline"
    time_limit_s: ClassVar = 60.0
    hold_s: ClassVar = 1.0
    stages: ClassVar = ((0.4, "before the incline"), (0.7, "half way up"), (1.0, "on the plateau"))
    needs_outline: ClassVar = True
    required_names: ClassVar = ("mount", "ground", "lane", "ramp", "plateau")
    features: ClassVar = (
        *LaneTask.features,
        Feature("slope of the incline", "", (0.1, 0.5), "(parameters)"),
        Feature("where the plateau begins, along the lane", "m", (0.6, 0.7), "(parameters)"),
    )
    hard: ClassVar = {"slope_deg": 25.0}

    slope_deg: float = 15.0
    """Slope of the incline, in the middle of its range of variation [deg]."""

    @property
    def objective(self) -> str:
        return (
            f"Ascend an incline of about {self.slope_deg:g} degrees, {LENGTH_M:g} m long, which begins {START_M:g} m "
            f"ahead, and remain on the plateau at its top for {self.hold_s:g} s, within {LANE_HALF_WIDTH_M:g} m to "
            "either side of the lane's middle line."
        )

    @property
    def edits(self) -> Edits:
        changes = ramp(np.deg2rad(self.slope_deg))
        return {
            f"geom/{name}": {c.field.removeprefix("geom_"): c.value for c in changes if c.name == name}
            for name in ("ramp", "plateau")
        }

    @property
    def criteria(self) -> Criteria:
        low, high = self.slope_deg - SPREAD_DEG, self.slope_deg + SPREAD_DEG
        return Criteria(
            variation=f"Slope {low:g} to {high:g} deg, friction {span(FRICTION)}.",
            progress="Nine tenths for the way to the plateau's edge, one for height.",
            success=f"Past the plateau's edge, up at least {100 * CLIMBED:g} % of its height, and inside the lane.",
            violation=LEAVES_LANE,
            failure=f"{STARTS_BEYOND} {OUT_OF_LANE}",
        )

    @property
    def target(self) -> tuple[Mark, ...]:
        return (Mark(element="geom", name="plateau"),)

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        slope = np.deg2rad(self.slope_deg + rng.uniform(-SPREAD_DEG, SPREAD_DEG))
        friction = (rng.uniform(*FRICTION), *FRICTION_ELSE)
        rough = tuple(Change("geom_friction", name, friction) for name in ("ground", "ramp", "plateau"))
        edge_m, rise_m = START_M + LENGTH_M * np.cos(slope), LENGTH_M * np.sin(slope)
        words = f"slope {np.rad2deg(slope):.1f} deg, friction {friction[0]:.2f}"
        parameters = {"slope": (np.tan(slope),), "edge_m": (edge_m,), "rise_m": (rise_m,)}
        return Variation((*ramp(slope), *rough), parameters, words)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        parameters = readings.parameters
        return np.column_stack([super().observe(readings, state), parameters["slope"], parameters["edge_m"]])

    def reset_state(self, readings: Readings) -> TaskState:
        start = in_lane(readings)
        return {"start": start, "lowest": start[:, 2], "beyond": starts_beyond(readings, START_M)}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        # height counts from the lowest point, so that sinking at the start is no disadvantage
        return {**state, "lowest": np.minimum(state["lowest"], in_lane(readings)[:, 2])}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        start_m = state["start"][:, 0]
        way = share(in_lane(readings)[:, 0] - start_m, readings.parameters["edge_m"][:, 0] - start_m)
        return 0.9 * way + 0.1 * np.minimum(way, share(self._climbed(readings, state), CLIMBED))

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        along_m, aside_m, _ = in_lane(readings).T
        there = (along_m >= readings.parameters["edge_m"][:, 0]) & (np.abs(aside_m) < LANE_HALF_WIDTH_M)
        return np.asarray(there & (self._climbed(readings, state) >= CLIMBED))

    def losses(self, readings: Readings, state: TaskState) -> dict[str, BoolArray]:
        return {**super().losses(readings, state), STARTS_BEYOND: state["beyond"] > 0.0}

    def _climbed(self, readings: Readings, state: TaskState) -> FloatArray:
        """Return the height of the centre of mass above its lowest point so far, as a share of the rise, (n,)."""
        return np.asarray((in_lane(readings)[:, 2] - state["lowest"]) / readings.parameters["rise_m"][:, 0])


def ramp(slope_rad: float) -> tuple[Change, ...]:
    """Return the changes that give the incline another slope, and the plateau the matching place and height."""
    cos, sin = float(np.cos(slope_rad)), float(np.sin(slope_rad))
    run_m, rise_m = LENGTH_M * cos, LENGTH_M * sin
    middle = (START_M + run_m / 2 + THICKNESS_M * sin, 0.0, rise_m / 2 - THICKNESS_M * cos)
    turn = (float(np.cos(slope_rad / 2)), 0.0, -float(np.sin(slope_rad / 2)), 0.0)
    edge_m = START_M + run_m
    top = box_between("plateau", (edge_m, -HALF_WIDTH_M, 0.0), (edge_m + PLATEAU_M, HALF_WIDTH_M, rise_m))
    return (Change("geom_pos", "ramp", middle), Change("geom_quat", "ramp", turn), *top)
