"""Drawers: an arm whose tip is a hook reaches over a bar, goes down behind it, and pulls by bending."""

from __future__ import annotations

import numpy as np
from benchmarks.tasks.wins.limbs import Cable, Limb, arched, robot
from benchmarks.tasks.wins.script import Script
from benchmarks.tasks.wins.servo import Servo

from aidsr.core.artifacts import Robot
from aidsr.tasks import Task
from aidsr.tasks.readings import FloatArray

CLEAR_M = 0.055
"""The hook's middle over a bar, where it passes."""
BEFORE_M = 0.205
"""Where the hook goes up and down before the drawers."""
DEPTH_M = 0.008
"""Of the hook's middle below the bar's."""
PITCH_RAD = -0.1
"""The tip looks down a little, so that the hook holds."""


class DrawerOpening(Script):
    """Bends in one plane by three sections; the tip's place and pitch are servoed."""

    @staticmethod
    def robot() -> Robot:
        """Return the robot."""
        cables = tuple(
            Cable(f"{section}_{name}", angle_deg, last, 20.0, 0.012)
            for section, last in (("near", 5), ("middle", 10), ("far", 15))
            for name, angle_deg in (("down", 0), ("up", 180))
        )
        tip = '<geom name="hook" type="capsule" size="0.005" fromto="0 0 0 0.022 0 0" density="600"/>'
        tip += '<site name="hook" pos="0.017 0 0"/>'
        arm = Limb(
            "arm",
            0.275,
            15,
            cables,
            0.008,
            0.4,
            0.05,
            tip,
            "",
            axes=("0 1 0",),
            bends_deg=arched(15, 57.3),
            range_deg=120.0,
        )
        return robot('<geom type="cylinder" size="0.02 0.008" mass="0.05"/>', [arm], "hook")

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        self.servo = Servo(self.scene, damping=0.005)
        self.phase: list[str] = []
        self.left: list[FloatArray] = []
        self.bar: list[FloatArray] = []

    def begin(self, n: int) -> None:
        """Forget what was remembered of earlier episodes; n begin."""
        self.servo.begin(n)
        self.phase, self.left, self.bar = ["travel"] * n, [np.zeros(2)] * n, []

    def actions(self, observation: FloatArray, seen: FloatArray, time_s: float) -> FloatArray:
        """Return the next actions, (n, n_actions)."""
        del time_s
        action = np.zeros((len(seen), len(self.names)))
        for row, features in enumerate(seen):
            self.servo.look(observation[row])
            at, axes, moves = self.servo.site("robot/hook")
            tip, bar = at[[0, 2]], (at + features[:3])[[0, 2]]
            if len(self.bar) <= row:
                self.bar.append(bar)
            if abs(bar[1] - self.bar[row][1]) > 0.05:
                # another drawer is wanted
                self.phase[row], self.left[row] = "raise", tip
            self.bar[row] = bar
            goal = self._goal(row, tip, bar, shut=features[5] < 0.0)
            step = 0.25 * np.clip(goal - tip, -0.02, 0.02)
            pitch_rad = np.arctan2(axes[2, 2], axes[0, 2])
            turn = -0.15 * np.clip(PITCH_RAD - pitch_rad, -0.5, 0.5)
            # 0.1 rad weighs as much as 10 mm
            rows = np.stack([moves[0], moves[2], 0.1 * moves[4]])
            action[row] = self.servo.drive(row, rows, np.array([*step, 0.1 * turn]))
        return action

    def _goal(self, row: int, tip: FloatArray, bar: FloatArray, *, shut: bool) -> FloatArray:
        """Return where the hook is to go, forwards and up (2,), and go on to the next phase when it is there."""
        ahead, above = tip - bar
        phase = self.phase[row]
        if phase == "raise" and (tip[1] > self.left[row][1] + 0.040 or tip[0] < 0.23):
            phase = "back"
        if phase == "back" and tip[0] < 0.215:
            phase = "travel"
        if phase == "travel" and abs(above - CLEAR_M + 0.005) < 0.008:
            phase = "over"
        if phase == "over" and ahead > 0.012:
            phase = "down"
        if phase == "down" and above < 0.006:
            phase = "work"
        elif phase == "down" and ahead < 0.004 and above < 0.03:
            phase = "travel"
        if phase == "work" and ahead < 0.0:
            phase, self.left[row] = "back", tip - (0.0, CLEAR_M)
        elif phase == "work" and above > 0.02:
            phase = "over"
        self.phase[row] = phase
        return {
            "raise": self.left[row] + (0.0, CLEAR_M),
            "back": np.array([BEFORE_M, self.left[row][1] + CLEAR_M if tip[0] > 0.225 else tip[1]]),
            "travel": np.array([BEFORE_M, bar[1] + CLEAR_M - 0.005]),
            "over": np.add(bar, (0.018, 0.048)),
            "down": np.add(bar, (0.018, -0.002)),
            "work": np.array([tip[0] + (0.03 if shut else -0.03), bar[1] - DEPTH_M]),
        }[phase]
