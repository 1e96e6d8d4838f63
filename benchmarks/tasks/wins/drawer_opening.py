"""Drawer opening: an arm with a hook at its tip reaches over a bar, moves down behind it, and pulls by bending."""

from __future__ import annotations

import numpy as np
from benchmarks.tasks.wins.limbs import Cable, Limb, arched, robot
from benchmarks.tasks.wins.script import Script
from benchmarks.tasks.wins.servo import Servo

from aidsr.core.artifacts import Robot
from aidsr.tasks import Task
from aidsr.tasks.readings import FloatArray

CLEAR_M = 0.055
"""Height of the hook's middle above a bar when it passes over it [m]."""
BEFORE_M = 0.205
"""Forward position at which the hook moves up and down in front of the drawers [m]."""
DEPTH_M = 0.008
"""Depth of the hook's middle below the bar's middle while it pulls [m]."""
PITCH_RAD = -0.1
"""Pitch of the tip [rad]: it points down a little, so that the hook holds."""


class DrawerOpening(Script):
    """An arm of three sections that bends in one plane; a servo controls the tip's position and pitch."""

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
        """Reset the state for n new episodes."""
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
                # the target is now another drawer
                self.phase[row], self.left[row] = "raise", tip
            self.bar[row] = bar
            goal = self._goal(row, tip, bar, shut=features[5] < 0.0)
            step = 0.25 * np.clip(goal - tip, -0.02, 0.02)
            pitch_rad = np.arctan2(axes[2, 2], axes[0, 2])
            turn = -0.15 * np.clip(PITCH_RAD - pitch_rad, -0.5, 0.5)
            # an error of 0.1 rad counts as much as one of 10 mm
            rows = np.stack([moves[0], moves[2], 0.1 * moves[4]])
            action[row] = self.servo.drive(row, rows, np.array([*step, 0.1 * turn]))
        return action

    def _goal(self, row: int, tip: FloatArray, bar: FloatArray, *, shut: bool) -> FloatArray:
        """Return the hook's target, forwards and up (2,) [m]; switch to the next phase when the hook is there."""
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
