"""What the tasks of locomotion share: a body seen in the lane it travels along."""

from __future__ import annotations

import numpy as np

from aidsr.tasks.readings import FloatArray, Readings
from aidsr.tasks.variation import Change

__all__ = ["LANE_HALF_WIDTH_M", "body_in_lane", "lane_features", "turned_lane"]

LANE_HALF_WIDTH_M = 0.3


def body_in_lane(readings: Readings) -> FloatArray:
    """Return the centre of mass along the lane, to its left, and over the ground, (n, 3) [m]."""
    return _along(readings, readings["com_position"] - readings["lane_position"])


def lane_features(readings: Readings) -> FloatArray:
    """Return place and speed of the centre of mass in the lane, and the lane's direction, (n, 8)."""
    velocity = _along(readings, readings["com_velocity"])
    return np.column_stack([body_in_lane(readings), velocity, readings["lane_forward"][:, :2]])


def turned_lane(rng: np.random.Generator, most_deg: float) -> Change:
    """Return the lane turned about its start by up to `most_deg` to either side."""
    half = np.deg2rad(rng.uniform(-most_deg, most_deg)) / 2
    return Change("body_quat", "lane", (np.cos(half), 0.0, 0.0, np.sin(half)))


def _along(readings: Readings, vector: FloatArray) -> FloatArray:
    """Return world vectors (n, 3) in the lane's axes; the lane lies level."""
    forward = np.einsum("nk,nk->n", vector, readings["lane_forward"])
    left = np.einsum("nk,nk->n", vector, readings["lane_left"])
    return np.column_stack([forward, left, vector[:, 2]])
