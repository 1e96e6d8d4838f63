"""Brushing: an arm moves from cell to cell without touching the wall, and presses on each cell by bending."""

from __future__ import annotations

import numpy as np
from benchmarks.tasks.wins.limbs import ROUND_DEG, Cable, Limb, arched, robot
from benchmarks.tasks.wins.script import Script
from benchmarks.tasks.wins.servo import Servo

from aidsr.core.artifacts import Robot
from aidsr.tasks import Task
from aidsr.tasks.manipulation.force_controlled_brushing import BAND_N
from aidsr.tasks.readings import FloatArray

PRESS_N = 0.6
"""Target force, in the middle of the allowed band [N]."""
LINGER_S = 0.8
"""Time for which a cell is pressed within the band [s], even after it is brushed: little of the contact time may be
outside of the band."""
CLEAR_M = 0.014
"""Distance from the wall on the way to another cell [m]."""


class ForceControlledBrushing(Script):
    """An arm of three sections that bend to all sides.

    A servo controls the tip's position and direction and, on the wall, its force.
    """

    @staticmethod
    def robot() -> Robot:
        """Return the robot."""
        cables = tuple(
            Cable(f"{section}_{angle_deg}", angle_deg, last, 12.0, 0.011)
            for section, last in (("near", 5), ("middle", 10), ("far", 15))
            for angle_deg in ROUND_DEG
        )
        tip = '<geom name="brush" size="0.009" density="400"/><site name="tip" pos="0 0 0.009"/>'
        arm = Limb(
            "arm",
            0.31,
            15,
            cables,
            0.007,
            0.3,
            0.03,
            tip,
            "",
            density=300.0,
            bends_deg=arched(15, 74.5),
            range_deg=120.0,
        )
        return robot('<geom type="cylinder" size="0.02 0.008" mass="0.05"/>', [arm], "tip")

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        self.servo = Servo(self.scene, damping=0.003)
        self.pressing, self.left_s = np.zeros(0, dtype=bool), np.zeros(0)
        half_m = 0.15 / getattr(task, "cells_a_side", 5)
        self.within_m, self.beyond_m = 0.4 * half_m, 0.73 * half_m
        """Distances from a cell's middle [m]: pressing begins within the first, and ends beyond the second."""

    def begin(self, n: int) -> None:
        """Reset the state for n new episodes."""
        self.servo.begin(n)
        self.pressing, self.left_s = np.zeros(n, dtype=bool), np.zeros(n)

    def actions(self, observation: FloatArray, seen: FloatArray, time_s: float) -> FloatArray:
        """Return the next actions, (n, n_actions)."""
        del time_s
        action = np.zeros((len(seen), len(self.names)))
        for row, features in enumerate(seen):
            to_cell, outward, force_n = features[:3], features[3:6], features[6]
            self.servo.look(observation[row])
            _, axes, moves = self.servo.site("robot/tip")
            away_m = -to_cell @ outward
            along = to_cell + away_m * outward
            step = self._step(row, along, float(away_m), float(force_n), outward)
            turn = np.cross(axes[:, 2], -outward)
            # the tip's direction has a small weight, and its rotation about its own axis none
            across = 0.01 * axes[:, :2].T
            rows = np.concatenate([moves[:3], across @ moves[3:]])
            action[row] = self.servo.drive(row, rows, np.concatenate([step, 0.15 * across @ turn]))
        return action

    def _step(self, row: int, along: FloatArray, away_m: float, force_n: float, outward: FloatArray) -> FloatArray:
        """Return the required motion of the tip in this control step, (3,) [m]."""
        far_m = float(np.linalg.norm(along))
        if not self.pressing[row] and far_m < self.within_m:
            self.pressing[row], self.left_s[row] = True, LINGER_S
        self.left_s[row] -= self.dt_s * (BAND_N[0] <= force_n <= BAND_N[1])
        # the cell is done, or the contact is lost
        if far_m > self.beyond_m and (self.left_s[row] <= 0.0 or force_n < 0.01):
            self.pressing[row] = False
        step = 0.25 * along * min(1.0, 0.024 / max(far_m, 1e-9))
        if not self.pressing[row]:
            lift = np.clip(0.25 * (CLEAR_M - away_m), -0.006, 0.006)
            return np.asarray((step if away_m > 0.004 else 0.0) + lift * outward)
        if force_n < 0.1:
            return np.asarray(0.3 * step * (far_m < self.beyond_m) - np.clip(0.3 * away_m, 0.003, 0.004) * outward)
        return np.asarray(-np.clip(0.0067 * (PRESS_N - force_n), -0.004, 0.002) * outward)
