"""Common parts of the locomotion tasks: observation of the robot in its lane, and boxes placed in the lane."""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from aidsr.sim.task_sensors import TaskSensor
from aidsr.tasks.readings import BoolArray, FloatArray, Readings
from aidsr.tasks.shaping import excess
from aidsr.tasks.task import Feature, Task, TaskState
from aidsr.tasks.variation import Change

LANE_HALF_WIDTH_M = 0.3
OUTSIDE_M = 0.1
"""Distance of the centre of mass outside the lane at which the robot has left it irrecoverably [m]."""
LEAVES_LANE = "The centre of mass leaves the lane."
OUT_OF_LANE = f"The centre of mass is {OUTSIDE_M:g} m outside the lane."

Corner = tuple[float, float, float]


@dataclass(frozen=True)
class LaneTask(Task, ABC):
    """A free robot travels along a lane."""

    base: ClassVar = "free"
    sensors: ClassVar[tuple[TaskSensor, ...]] = (
        TaskSensor(name="com_position", quantity="center_of_mass"),
        TaskSensor(name="com_velocity", quantity="center_of_mass_velocity"),
    )
    features: ClassVar[tuple[Feature, ...]] = (
        Feature("centre of mass along the lane", "m", (-1, 5), "com_position, lane_position, lane_forward"),
        Feature("centre of mass to the left of the lane", "m", (-1, 1), "com_position, lane_position, lane_left"),
        Feature("centre of mass over the ground", "m", (0, 1), "com_position"),
        Feature("speed along the lane", "m/s", (-2, 2), "com_velocity, lane_forward"),
        Feature("speed to the left", "m/s", (-2, 2), "com_velocity, lane_left"),
        Feature("speed upwards", "m/s", (-2, 2), "com_velocity"),
        Feature("forward direction, world x and y", "", (-1, 1), "lane_forward", size=2),
    )

    def observe(self, readings: Readings, state: TaskState) -> FloatArray:
        del state
        velocity = _along(readings, readings["com_velocity"])
        return np.column_stack([in_lane(readings), velocity, readings["lane_forward"][:, :2]])

    def reset_state(self, readings: Readings) -> TaskState:
        return {"start": in_lane(readings)}

    def violation(self, readings: Readings) -> FloatArray:
        return excess(np.abs(in_lane(readings)[:, 1]), LANE_HALF_WIDTH_M, full=LANE_HALF_WIDTH_M + OUTSIDE_M)

    def losses(self, readings: Readings, state: TaskState) -> dict[str, BoolArray]:
        del state
        return {OUT_OF_LANE: np.abs(in_lane(readings)[:, 1]) >= LANE_HALF_WIDTH_M + OUTSIDE_M}


def in_lane(readings: Readings) -> FloatArray:
    """Return the position of the centre of mass along the lane, to its left, and above the ground, (n, 3) [m]."""
    return _along(readings, readings["com_position"] - readings["lane_position"])


def outline_in_lane(readings: Readings) -> FloatArray:
    """Return the centres of the outline's spheres along the lane, to its left, and above the ground, (n, p, 3) [m]."""
    return _along(readings, readings.body.center_m - readings["lane_position"][:, None])


def turned_lane(turn_deg: float) -> Change:
    """Return the change that turns the lane about its start; positive angles turn left."""
    half = np.deg2rad(turn_deg) / 2
    return Change("body_quat", "lane", (np.cos(half), 0.0, 0.0, np.sin(half)))


def box_between(name: str, low_m: Corner, high_m: Corner) -> tuple[Change, Change]:
    """Return the changes that make a box span two opposite corners, given in the frame of its body [m]."""
    low, high = np.array(low_m), np.array(high_m)
    return Change("geom_size", name, tuple((high - low) / 2)), Change("geom_pos", name, tuple((high + low) / 2))


def _along(readings: Readings, vectors: FloatArray) -> FloatArray:
    """Return world vectors (n, 3) or (n, p, 3) in the lane's axes; the lane is horizontal."""
    axes = np.stack([readings["lane_forward"], readings["lane_left"]], axis=1)
    level = np.einsum("n...k,njk->n...j", vectors, axes)
    return np.concatenate([level, vectors[..., 2:]], axis=-1)
