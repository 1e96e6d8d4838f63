"""Robots that win the tasks out of sample."""

from __future__ import annotations

import numpy as np
from benchmarks.tasks.wins.limbs import ROUND_DEG, Cable, Limb, robot
from benchmarks.tasks.wins.script import Commands, Script

from aidsr.core.artifacts import Robot
from aidsr.tasks import Task
from aidsr.tasks.readings import FloatArray


class AroundCorners(Script):
    """The near part of the arm steers through the first opening; the far part bends towards the second."""

    NEAR, FAR, NEAR_N, FAR_N = 4, 15, 16.0, 8.0

    @staticmethod
    def robot() -> Robot:
        """Return the robot."""
        one = AroundCorners
        near = tuple(Cable(f"near_{a}", a, one.NEAR, one.NEAR_N, 0.012) for a in ROUND_DEG)
        far = tuple(Cable(f"far_{a + 45}", a + 45, one.FAR, one.FAR_N, 0.012) for a in ROUND_DEG)
        tip = '<geom size="0.010" density="250"/><site name="tip" pos="0 0 0.010"/>'
        arm = Limb("arm", 0.37, one.FAR, (*near, *far), 0.009, 0.4, 0.05, tip, 'pos="0 0 0.018"', density=250.0)
        return robot('<geom type="cylinder" size="0.02 0.008" mass="0.05"/>', [arm], "tip")

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        self.near = self.far = self.entered_m = np.zeros(1)

    def commands(self, seen: FloatArray, time_s: float) -> Commands:
        """Return actions by the actuators' names; a cable that is not named is slack."""
        tip_m, forward, feed_m = seen[:, :3], seen[:, 6:8], seen[:, 8]
        if not time_s:
            self.near, self.far, self.entered_m = np.zeros((len(seen), 2)), np.zeros((len(seen), 2)), feed_m
        inside = (np.abs(tip_m[:, 0]) < 0.13) & (np.abs(tip_m[:, 1]) < 0.09)
        zone = np.where(inside, (tip_m[:, 2] < 0.0).astype(int) + (tip_m[:, 2] < -0.17), 0)
        before = (zone == 0) | ((zone == 1) & (tip_m[:, 2] > -0.02))
        # from the first opening to the second along a slanting line
        aim_m = np.select([zone == 0, zone == 1], [0.065, np.maximum(0.06 + 0.8 * tip_m[:, 2], -0.085)], -0.075)
        error_m = np.stack([aim_m - tip_m[:, 0], -tip_m[:, 1]], axis=1)
        step = np.where(np.abs(error_m) > 0.006, np.clip(0.4 * error_m, -0.02, 0.02), 0.0)
        self.near = np.clip(np.where(before[:, None], self.near + step, self.near), -1.0, 1.0)
        self.far = np.clip(np.where(before[:, None], 0.9 * self.far, self.far + step), -1.0, 1.0)
        self.entered_m = np.where(before, feed_m, self.entered_m)
        # cables of the far part also bend the near part; the near cables compensate for this
        kept = np.clip(1.0 - (feed_m - self.entered_m) / 0.2, 0.0, 1.0)[:, None] * self.near
        near = self._pulls("near", kept - self.FAR_N / self.NEAR_N * self.far, forward, 0)
        aligned = np.select(
            [zone == 0, (zone == 1) & ~before], [abs(error_m[:, 0]) < 0.02, abs(error_m[:, 0]) < 0.03], 1
        )
        room = np.select([zone == 0, zone == 1], [tip_m[:, 2] > 0.03, tip_m[:, 2] > -0.135], 0)
        feed = np.where((aligned > 0) | (room > 0), 0.6, 0.0)
        return {**near, **self._pulls("far", self.far, forward, 45), "feed": feed}

    def _pulls(self, part: str, bend, forward, turned_deg: int) -> dict:
        """Return the tensions that bend a part towards a direction in the frame of the box."""
        left = np.stack([-forward[:, 1], forward[:, 0]], axis=1)
        world = bend[:, :1] * forward + bend[:, 1:] * left
        pulls = {}
        for angle_deg in (angle + turned_deg for angle in ROUND_DEG):
            angle = np.deg2rad(angle_deg)
            towards = np.array([np.cos(angle), -np.sin(angle)])  # the mount faces down: its y is the world's -y
            pulls[f"arm_{part}_{angle_deg}"] = -1.0 + 2.0 * np.clip(world @ towards, 0.0, 1.0)
        return pulls


class BallFromBowl(Script):
    """Three fingers are lowered around the ball, close, and are raised."""

    @staticmethod
    def robot() -> Robot:
        """Return the robot."""
        fingers = []
        for angle_deg in (0, 120, 240):
            x, y = (0.042 * f(np.deg2rad(angle_deg)) for f in (np.cos, np.sin))
            place = f'pos="{x:.6g} {y:.6g} 0.022" euler="0 0 {angle_deg}"'
            inside, tip = Cable("close", 180, 6, 5.0, 0.010), '<geom size="0.009" density="600"/>'
            fingers.append(
                Limb(f"finger_{angle_deg}", 0.13, 6, (inside,), 0.007, 0.12, 0.004, tip, place, axes=("0 1 0",))
            )
        palm = '<geom type="cylinder" size="0.05 0.006" mass="0.08"/><site name="palm" pos="0 0 0.12"/>'
        return robot(palm, fingers, "palm")

    def commands(self, seen: FloatArray, time_s: float) -> Commands:
        """Return actions by the actuators' names; a cable that is not named is slack."""
        lift = (
            np.clip((-0.134 - seen[:, 9]) / 0.02, -1.0, 1.0)
            if time_s < 3.2
            else np.clip((0.1 - seen[:, 9]) / 0.02, 0, 0.6)
        )
        pull = np.clip(-1.0 + 2.0 * (time_s - 2.0) / 0.8, -1.0, 1.0)
        return {"base_z": lift, **{f"finger_{angle_deg}_close": pull for angle_deg in (0, 120, 240)}}


class Incline(Script):
    """Four flippers row: they sweep back while pressed down, and forward while lifted."""

    up_m = 0.004

    @staticmethod
    def robot() -> Robot:
        """Return the robot."""
        flippers = []
        for side, left in (("left", 1), ("right", -1)):
            up, down = ("up", "down") if left > 0 else ("down", "up")
            for end, x in (("front", 0.05), ("rear", -0.05)):
                names = {"front": 0, "back": 180, down: 90, up: 270}
                cables = tuple(Cable(name, angle, 4, 10.0, 0.011) for name, angle in names.items())
                place = f'pos="{x} {0.055 * left} 0.020" euler="{-98 * left} 0 0"'
                tip = '<geom size="0.010" density="600"/>'
                flippers.append(Limb(f"{side}_{end}", 0.09, 4, cables, 0.008, 0.15, 0.008, tip, place))
        torso = (
            '<geom type="box" size="0.08 0.035 0.011" pos="0 0 0.013" mass="0.12"/><site name="torso" pos="0 0 0.02"/>'
        )
        return robot(torso, flippers, "torso")

    def commands(self, seen: FloatArray, time_s: float) -> Commands:
        """Return actions by the actuators' names; a cable that is not named is slack."""
        phase = 2 * np.pi * 0.7 * time_s
        aside_m = seen[:, 1]
        commands = {}
        for side, away in (("left", aside_m), ("right", -aside_m)):
            # the side to which the robot has strayed rows at full strength, the other side less
            sweep = np.clip(1.0 + 4.0 * np.minimum(away, 0.0), 0.2, 1.0)
            strengths = {"back": -np.cos(phase) * sweep, "front": np.cos(phase) * sweep}
            strengths |= {"down": np.sin(phase), "up": -np.sin(phase)}
            for end in ("front", "rear"):
                for cable, strength in strengths.items():
                    commands[f"{side}_{end}_{cable}"] = -1.0 + 2.0 * np.maximum(0.0, strength)
        return commands


class CrankTurning(Script):
    """The tip moves behind the pin, inside the pin's circle, and pushes it around; the arm bends towards the push."""

    @staticmethod
    def robot() -> Robot:
        """Return the robot."""
        cables = tuple(Cable(f"pull_{angle}", angle, 6, 25.0, 0.012) for angle in ROUND_DEG)
        tip = '<geom type="capsule" size="0.010" fromto="0 0 0 0 0 0.012" density="600"/>'
        tip += '<site name="tip" pos="0 0 0.015"/>'
        arm = Limb("arm", 0.197, 6, cables, 0.010, 5.0, 0.1, tip, 'pos="0 0 0.019"')
        return robot('<geom type="cylinder" size="0.02 0.008" mass="0.05"/>', [arm], "tip")

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        self.leaning = np.zeros((1, 2))

    def commands(self, seen: FloatArray, time_s: float) -> Commands:
        """Return actions by the actuators' names; a cable that is not named is slack."""
        del time_s
        angle, direction = np.arctan2(seen[:, 4], seen[:, 3]), seen[:, 6]
        tip_m = _on_circle(0.06, angle) - seen[:, 1:3]
        radius_m, at = np.linalg.norm(tip_m, axis=1), np.arctan2(-tip_m[:, 0], tip_m[:, 1])
        behind = (direction * (angle - at) + np.pi) % (2 * np.pi) - np.pi
        pushing = (behind > 0.12) & (behind < 0.9) & (np.abs(radius_m - 0.06) < 0.02)
        free = (radius_m < 0.03) | (np.abs(behind - 0.5) < 0.3)
        goal_m = np.where(free[:, None], _on_circle(0.06, angle - 0.5 * direction), _on_circle(0.015, at))
        goal_m = np.where(pushing[:, None], _on_circle(0.06, at + 0.5 * direction), goal_m)
        speed = np.clip((goal_m - tip_m) / 0.02, -1.0, 1.0)
        # slowly, otherwise the tip oscillates
        self.leaning = 0.95 * self.leaning + 0.05 * speed * pushing[:, None]
        lean = {0: -self.leaning[:, 1], 90: self.leaning[:, 0], 180: self.leaning[:, 1], 270: -self.leaning[:, 0]}
        pulls = {f"arm_pull_{one}": -1.0 + 0.8 * np.maximum(0.0, strength) for one, strength in lean.items()}
        return {"base_y": speed[:, 0], "base_z": speed[:, 1], **pulls}


def _on_circle(radius_m: float, angle):
    """Return points on a circle around the axle, sideways and up, (n, 2) [m]; angle 0 is the top."""
    return radius_m * np.stack([-np.sin(angle), np.cos(angle)], axis=1)
