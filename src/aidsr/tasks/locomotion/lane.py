"""What the tasks of locomotion share: a body seen in the lane it travels along, and what stands in that lane."""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import excess
from aidsr.tasks.task import Memory, Task
from aidsr.tasks.variation import Change

__all__ = ["LANE_HALF_WIDTH_M", "LaneTask", "box_between", "in_lane", "outline_in_lane", "turned_lane"]

LANE_HALF_WIDTH_M = 0.3
LOST_M = LANE_HALF_WIDTH_M + 0.1
"""A robot whose centre of mass is that far from the lane's middle has left it for good."""

Corner = tuple[float, float, float]


@dataclass(frozen=True)
class LaneTask(Task, ABC):
    """A free robot travels along a lane.

    Features: centre of mass along the lane, to its left and over the ground (0-2), its velocity likewise (3-5), the
    lane's forward direction in world x and y (6-7).
    """

    base: ClassVar = "free"
    sensors: ClassVar[tuple[TaskSensor, ...]] = (
        TaskSensor(name="com_position", quantity="center_of_mass"),
        TaskSensor(name="com_velocity", quantity="center_of_mass_velocity"),
    )

    def features(self, readings: Readings, memory: Memory) -> FloatArray:
        """See the table of the task."""
        del memory
        velocity = _along(readings, readings["com_velocity"])
        return np.column_stack([in_lane(readings), velocity, readings["lane_forward"][:, :2]])

    def begin(self, readings: Readings) -> Memory:
        """Where the centre of mass starts."""
        return {"start": in_lane(readings)}

    def violation(self, readings: Readings) -> FloatArray:
        """The centre of mass leaves the lane."""
        return excess(np.abs(in_lane(readings)[:, 1]), LANE_HALF_WIDTH_M, full=LOST_M)

    def failed(self, readings: Readings, memory: Memory) -> BoolArray:
        """The centre of mass is 0.1 m outside the lane."""
        del memory
        return np.abs(in_lane(readings)[:, 1]) >= LOST_M


def in_lane(readings: Readings) -> FloatArray:
    """Return the centre of mass along the lane, to its left, and over the ground, (n, 3) [m]."""
    return _along(readings, readings["com_position"] - readings["lane_position"])


def outline_in_lane(readings: Readings) -> FloatArray:
    """Return the middles of the outline's balls along the lane, to its left, and over the ground, (n, p, 3) [m]."""
    return _along(readings, readings.body.center_m - readings["lane_position"][:, None])


def turned_lane(rng: np.random.Generator, most_deg: float) -> Change:
    """Return the lane turned about its start by up to `most_deg` to either side."""
    half = np.deg2rad(rng.uniform(-most_deg, most_deg)) / 2
    return Change("body_quat", "lane", (np.cos(half), 0.0, 0.0, np.sin(half)))


def box_between(name: str, low_m: Corner, high_m: Corner) -> tuple[Change, Change]:
    """Return the changes that let a box reach from one corner to the opposite one, in the frame of its body."""
    low, high = np.array(low_m), np.array(high_m)
    return Change("geom_size", name, tuple((high - low) / 2)), Change("geom_pos", name, tuple((high + low) / 2))


def _along(readings: Readings, vectors: FloatArray) -> FloatArray:
    """Return world vectors (n, 3) or (n, p, 3) in the lane's axes; the lane lies level."""
    axes = np.stack([readings["lane_forward"], readings["lane_left"]], axis=1)
    level = np.einsum("n...k,njk->n...j", vectors, axes)
    return np.concatenate([level, vectors[..., 2:]], axis=-1)
