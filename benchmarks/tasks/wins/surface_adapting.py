"""Surface adapting: the arm's far half moves towards the surface until all of it lies on it and presses a little."""

from __future__ import annotations

import numpy as np
from benchmarks.tasks.wins.limbs import Cable, Limb, robot
from benchmarks.tasks.wins.script import Script
from benchmarks.tasks.wins.servo import Servo

from aidsr.core.artifacts import Robot
from aidsr.tasks import Task
from aidsr.tasks.reaching.surface_adapting import RADIUS_M
from aidsr.tasks.readings import FloatArray

SEGMENTS, FIRST = 18, 9
"""Number of segments of the arm, and index from 0 of the first one that is to lie on the surface."""
THICK_M = 0.006
PRESS_M, LIE_M = 0.04, 0.02
"""Target depths below the surface [m]: of the tip and one point before it, and of all other points."""


class SurfaceAdapting(Script):
    """An arm of three sections that bends in one plane, that of the surface's curve."""

    @staticmethod
    def robot() -> Robot:
        """Return the robot."""
        cables = tuple(
            Cable(f"{section}_{angle_deg}", angle_deg, last, 20.0, 0.010)
            for section, last in (("near", 6), ("middle", 12), ("far", 18))
            for angle_deg in (0, 180)
        )
        tip = f'<geom name="tip" size="{THICK_M}" density="200"/><site name="tip"/>'
        arm = Limb(
            "arm", 0.42, SEGMENTS, cables, THICK_M, 0.25, 0.05, tip, "", axes=("0 1 0",), density=250.0, range_deg=120.0
        )
        return robot('<geom type="cylinder" size="0.012 0.004" mass="0.02"/>', [arm], "tip")

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        self.servo = Servo(self.scene, damping=0.013, slackening=0.01, fastest=0.045)

    def begin(self, n: int) -> None:
        """Reset the state for n new episodes."""
        self.servo.begin(n)

    def actions(self, observation: FloatArray, seen: FloatArray, time_s: float) -> FloatArray:
        """Return the next actions, (n, n_actions)."""
        del time_s
        action = np.zeros((len(seen), len(self.names)))
        places = [*(f"robot/arm_{i}" for i in range(FIRST + 1, SEGMENTS + 1)), "robot/arm_end"]
        depth_m = np.full(len(places), LIE_M)
        depth_m[[-1, -5]] = PRESS_M
        for row, features in enumerate(seen):
            self.servo.look(observation[row])
            axis = self.servo.site("robot/tip")[0] + features[:3]
            rows, gaps_m = [], []
            for place in places:
                at, moves = self.servo.body(place)
                outward = (at - axis) * (1.0, 0.0, 1.0)
                far_m = np.linalg.norm(outward)
                rows.append(outward / far_m @ moves)
                gaps_m.append(far_m - features[6] * RADIUS_M[1] - THICK_M)
            wanted = -0.15 * np.clip(np.array(gaps_m) + depth_m, -0.02, 0.08)
            action[row] = self.servo.drive(row, np.stack(rows), wanted)
        return action
