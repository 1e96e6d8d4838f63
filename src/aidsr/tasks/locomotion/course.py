"""Lanes in which falling back loses the episode: a robot that rolls back and forth at random gets anywhere in time."""

from __future__ import annotations

from abc import ABC

import numpy as np

from aidsr.tasks.locomotion.base import OUT_OF_LANE, LaneTask, in_lane, outline_in_lane
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.task import TaskState

MOST_BACK_M = 0.05
"""Largest distance of the centre of mass behind its farthest position so far [m]. Our choice: sinusoidal gaits of the
built-in crawlers and worms that make progress fall back by 13 mm at most, and a ring under random actions rarely gets
far without falling back more."""
FELL_BACK = f"The centre of mass is {MOST_BACK_M:g} m behind the farthest it has been."
FALLS_BACK = f"{OUT_OF_LANE} {FELL_BACK}"


class OneWayTask(LaneTask, ABC):
    """A free robot travels along a lane and must not fall back far."""

    def reset_state(self, readings: Readings) -> TaskState:
        """Return the start of the centre of mass in the lane, and its farthest position along the lane."""
        there = in_lane(readings)
        return {"start": there, "farthest": there[:, 0]}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        return {**state, "farthest": np.maximum(state["farthest"], in_lane(readings)[:, 0])}

    def losses(self, readings: Readings, state: TaskState) -> dict[str, BoolArray]:
        fell_back = in_lane(readings)[:, 0] < state["farthest"] - MOST_BACK_M
        return {**super().losses(readings, state), FELL_BACK: fell_back}


def front_m(readings: Readings) -> FloatArray:
    """Return the position of the foremost part along the lane, (n,) [m]."""
    return readings.body.foremost_m(outline_in_lane(readings)[:, :, 0])


def rear_m(readings: Readings) -> FloatArray:
    """Return the position of the rearmost part along the lane, (n,) [m]."""
    return readings.body.rearmost_m(outline_in_lane(readings)[:, :, 0])


def starts_beyond(readings: Readings, begin_m: float) -> FloatArray:
    """Return 1 if a part of the robot is beyond the beginning of what it has to pass, otherwise 0, (n,)."""
    return np.asarray(front_m(readings) > begin_m, dtype=np.float64)
