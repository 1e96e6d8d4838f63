"""Lanes that are travelled in one go: what rolls forth and back at random gets anywhere in time."""

from __future__ import annotations

from abc import ABC

import numpy as np

from aidsr.tasks.locomotion.base import OUT_OF_LANE, LaneTask, in_lane, outline_in_lane
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.task import TaskState

MOST_BACK_M = 0.05
"""How far the centre of mass may fall back behind the farthest it has come. Our choice: sinusoidal gaits of the
built-in crawlers and worms that get anywhere take back 13 mm at most, and a ring under random actions hardly ever gets
far without losing more."""
FELL_BACK = f"The centre of mass is {MOST_BACK_M:g} m behind the farthest it has been."
FALLS_BACK = f"{OUT_OF_LANE} {FELL_BACK}"


class OneWayTask(LaneTask, ABC):
    """A free robot travels along a lane and does not fall back far."""

    def reset_state(self, readings: Readings) -> TaskState:
        """Where the centre of mass starts, and the farthest it has been along the lane."""
        there = in_lane(readings)
        return {"start": there, "farthest": there[:, 0]}

    def update_state(self, readings: Readings, state: TaskState) -> TaskState:
        return {**state, "farthest": np.maximum(state["farthest"], in_lane(readings)[:, 0])}

    def losses(self, readings: Readings, state: TaskState) -> dict[str, BoolArray]:
        fell_back = in_lane(readings)[:, 0] < state["farthest"] - MOST_BACK_M
        return {**super().losses(readings, state), FELL_BACK: fell_back}


def front_m(readings: Readings) -> FloatArray:
    """Return where the foremost part is along the lane, (n,) [m]."""
    return np.asarray((outline_in_lane(readings)[:, :, 0] + readings.body.radius_m).max(axis=1))


def rear_m(readings: Readings) -> FloatArray:
    """Return where the rearmost part is along the lane, (n,) [m]."""
    return np.asarray((outline_in_lane(readings)[:, :, 0] - readings.body.radius_m).min(axis=1))


def starts_beyond(readings: Readings, begin_m: float) -> FloatArray:
    """Return 1 where a part of the robot is beyond the beginning of what it has to pass, else 0, (n,)."""
    return np.asarray(front_m(readings) > begin_m, dtype=np.float64)
