"""Travel around obstacles that block every straight path."""

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

GOAL_M = 1.1
OBSTACLES = 2
"""Number of obstacles: each is a barrier from a wall of the lane to past its middle, with a round post at its end."""
FIRST_M, SPACING_M, SHIFT_M = 0.45, 0.5, 0.03
"""Position of the first obstacle, distance between obstacles and largest shift of each, along the lane [m]."""
HEIGHT_M, HALF_THICK_M = 0.04, 0.02
POST_RADIUS_M = (0.02, 0.03)
SPREAD_M = 0.01
CLEAR_M = 0.10
"""Distance between an obstacle's end and the path by which progress is measured [m]. Our choice: half the width of a
robot of the usual size."""
STARTS_BEYOND = "A part of the robot starts beyond the first obstacle."


@dataclass(frozen=True)
class Obstacles(LaneTask):
    """The robot's centre of mass gets around two obstacles, each of which closes one half of the lane.

    Source: our choice; obstacles as high as the robots are thick, and walls beside the lane, so that the only way leads
    around one of them to the one side, and around the other to the other.
    """

    name: ClassVar = "locomotion/obstacles"
    time_limit_s: ClassVar = 60.0
    hold_s: ClassVar = 0.5
    stages: ClassVar = ((0.35, "at the first obstacle"), (0.8, "at the second one"), (1.0, "past both obstacles"))
    needs_outline: ClassVar = True
    required_names: ClassVar = (
        "mount",
        "ground",
        "lane",
        *(f"{part}_{number}" for number in range(1, OBSTACLES + 1) for part in ("barrier", "post")),
    )
    features: ClassVar = (
        *LaneTask.features,
        Feature(
            "centre of mass to where the way passes each obstacle, along and to the left each",
            "m",
            (-1.5, 1.5),
            "com_position, lane_*, (parameters)",
            size=2 * OBSTACLES,
        ),
    )
    hard: ClassVar = {"reach_m": 0.07}

    reach_m: float = 0.02
    """How far an obstacle reaches past the middle of the lane [m]; episodes vary it by up to 10 mm."""

    @property
    def objective(self) -> str:
        return (
            f"Travel {GOAL_M:g} m forward along a lane {2 * LANE_HALF_WIDTH_M:g} m wide between two walls, around two "
            f"obstacles {1000 * HEIGHT_M:g} mm high that reach about {1000 * self.reach_m:g} mm past its middle, one "
            f"from the left and one from the right, within {self.time_limit_s:g} s."
        )

    @property
    def edits(self) -> Edits:
        x, side = _places()
        edits: dict[str, dict[str, tuple[float, ...]]] = {}
        for change in _obstacles(x, side, np.full(OBSTACLES, self.reach_m), np.full(OBSTACLES, 0.025)):
            # posts have the same thickness at both levels
            if (change.field, change.name[:4]) != ("geom_size", "post"):
                edits.setdefault(f"geom/{change.name}", {})[change.field.removeprefix("geom_")] = change.value
        return edits

    @property
    def criteria(self) -> Criteria:
        return Criteria(
            variation=(
                f"Which of the obstacles reaches from the left; how far each does, +-{1000 * SPREAD_M:g} mm, and where "
                f"it stands, +-{1000 * SHIFT_M:g} mm."
            ),
            progress="Way to the finish line around the obstacles.",
            success="The centre of mass is past the finish line, inside the lane.",
            violation=LEAVES_LANE,
            failure=f"{STARTS_BEYOND} {OUT_OF_LANE}",
        )

    @property
    def target(self) -> tuple[Mark, ...]:
        return (Mark(element="geom", name="finish_line"),)

    def sample_variation(self, rng: np.random.Generator) -> Variation:
        x, side = _places()
        x = x + rng.uniform(-SHIFT_M, SHIFT_M, OBSTACLES)
        side = side * rng.choice([-1.0, 1.0])
        reach_m = self.reach_m + rng.uniform(-SPREAD_M, SPREAD_M, OBSTACLES)
        turns_m = np.column_stack([x, -side * (reach_m + CLEAR_M)])
        changes = _obstacles(x, side, reach_m, rng.uniform(*POST_RADIUS_M, OBSTACLES))
        words = "; ".join(
            f"obstacle {number + 1} from the {'left' if side[number] > 0 else 'right'}, {x[number]:.3f} m along, "
            f"{1000 * reach_m[number]:.0f} mm beyond the middle"
            for number in range(OBSTACLES)
        )
        return Variation(changes, {"turns_m": tuple(turns_m.ravel())}, words)

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        ways = _turns_m(readings) - in_lane(readings)[:, None, :2]
        return np.column_stack([super().observe(readings, state), ways.reshape(readings.n, -1)])

    def reset_state(self, readings: Readings) -> TaskState:
        """Return the length of the whole path, and whether a part of the robot starts beyond the first obstacle."""
        way_m = way_left_m(in_lane(readings)[:, :2], _turns_m(readings))
        return {"way": np.maximum(way_m, 1e-6), "beyond": starts_beyond(readings, FIRST_M - SHIFT_M)}

    def progress(self, readings: Readings, state: TaskState) -> FloatArray:
        left_m = way_left_m(in_lane(readings)[:, :2], _turns_m(readings))
        return share(state["way"] - left_m, state["way"])

    def is_success(self, readings: Readings, state: TaskState) -> BoolArray:
        del state
        there = in_lane(readings)
        return (there[:, 0] >= GOAL_M) & (np.abs(there[:, 1]) < LANE_HALF_WIDTH_M)

    def losses(self, readings: Readings, state: TaskState) -> dict[str, BoolArray]:
        return {**super().losses(readings, state), STARTS_BEYOND: state["beyond"] > 0.0}


def way_left_m(point_m: FloatArray, turns_m: FloatArray) -> FloatArray:
    """Return the length of the shortest path to the finish line around the obstacles' ends, (n,) [m].

    Args:
        point_m: Beginning of the path, along the lane and to its left, (n, 2) [m].
        turns_m: Point where the path passes each obstacle, (n, OBSTACLES, 2) [m]. Farther from the lane's middle than
            this point, the lane is open up to the wall.
    """
    (along_m, aside_m), last_m = point_m.T, turns_m[:, -1]
    after_m = GOAL_M - last_m[:, 0]
    is_open = (along_m >= last_m[:, 0]) | (np.sign(last_m[:, 1]) * (aside_m - last_m[:, 1]) >= 0.0)
    left_m = np.where(is_open, np.maximum(GOAL_M - along_m, 0.0), _distance_m(point_m, last_m) + after_m)
    for number in reversed(range(OBSTACLES - 1)):
        turn_m, next_m = turns_m[:, number], turns_m[:, number + 1]
        part = (turn_m[:, 0] - along_m) / np.maximum(next_m[:, 0] - along_m, 1e-9)
        passes_m = aside_m + part * (next_m[:, 1] - aside_m)
        is_open = np.sign(turn_m[:, 1]) * (passes_m - turn_m[:, 1]) >= 0.0
        straight_m = _distance_m(point_m, next_m) + after_m
        after_m = after_m + _distance_m(turn_m, next_m)
        around_m = _distance_m(point_m, turn_m) + after_m
        left_m = np.where(along_m < turn_m[:, 0], np.where(is_open, straight_m, around_m), left_m)
    return np.asarray(left_m)


def _distance_m(one_m: FloatArray, other_m: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(other_m - one_m, axis=1))


def _places() -> tuple[FloatArray, FloatArray]:
    """Return the nominal positions of the obstacles along the lane [m], and their sides: 1 left, -1 right."""
    numbers = np.arange(OBSTACLES, dtype=np.float64)
    return FIRST_M + SPACING_M * numbers, 1.0 - 2.0 * (numbers % 2.0)


def _turns_m(readings: Readings) -> FloatArray:
    return readings.parameters["turns_m"].reshape(readings.n, OBSTACLES, 2)


def _obstacles(x: FloatArray, side: FloatArray, reach_m: FloatArray, radius_m: FloatArray) -> tuple[Change, ...]:
    """Return the changes that place barriers and their posts."""
    changes: list[Change] = []
    for number in range(OBSTACLES):
        post_m = float(side[number] * (radius_m[number] - reach_m[number]))
        low_m, high_m = sorted((post_m, float(side[number]) * LANE_HALF_WIDTH_M))
        along_m, radius = float(x[number]), float(radius_m[number])
        corners = (along_m - HALF_THICK_M, low_m, 0.0), (along_m + HALF_THICK_M, high_m, HEIGHT_M)
        changes += box_between(f"barrier_{number + 1}", *corners)
        changes.append(Change("geom_size", f"post_{number + 1}", (radius, HEIGHT_M / 2, 0.0)))
        changes.append(Change("geom_pos", f"post_{number + 1}", (along_m, post_m, HEIGHT_M / 2)))
    return tuple(changes)
