"""Motions that are played back: the validator's tests of a robot, and recorded episodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.apps.web.view3d.display_model import DisplayModel
from aidsr.apps.web.view3d.tendons import tensions_n
from aidsr.sim.drive import Drive
from aidsr.sim.rollout import simulate
from aidsr.sim.structure import name_of
from aidsr.validation.battery import BatteryTest
from aidsr.validation.protocol import PlannedTests, Protocol, plan_tests

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Motion:
    """Positions over time.

    Attributes:
        frame_s: Time between two rows [s].
        qpos: (n_frames, nq), finite.
        tension_n: (n_frames, ntendon) where it is known.
        ctrl: (n_frames, nu) where it is known.
    """

    frame_s: float
    qpos: Array
    tension_n: Array | None = None
    ctrl: Array | None = None

    @property
    def duration_s(self) -> float:
        """Time from the first to the last row [s]."""
        return (len(self.qpos) - 1) * self.frame_s

    @classmethod
    def recorded(cls, model: mujoco.MjModel, frame_s: float, qpos: Array) -> Self:
        """Return a motion from outside, up to where it stops being finite.

        Raises:
            ValueError: It does not fit the model.
        """
        if qpos.ndim != 2 or qpos.shape[1] != model.nq or not len(qpos) or not frame_s > 0:
            raise ValueError(f"expected positions of shape (n, {model.nq}) and their distance in s, found {qpos.shape}")
        broken = np.flatnonzero(~np.isfinite(qpos).all(axis=1))
        return cls(frame_s, qpos[: broken[0]] if broken.size else qpos)


class Tests:
    """The validator's battery for what is shown, each test simulated when it is first asked for."""

    def __init__(self, shown: DisplayModel) -> None:
        self._shown = shown
        self._plan: PlannedTests | None = None
        protocol = Protocol()
        if shown.structure.moving and protocol.steps(shown.model, shown.structure) <= protocol.most_steps:
            self._plan = plan_tests(shown.model, shown.structure, protocol, threads=1)
        self._made: dict[int, Motion] = {}

    @property
    def labels(self) -> list[str]:
        """What each test is, in words; none where the robot does not survive settling."""
        if self._plan is None:
            return []
        return [self._label(test, self._plan.drives) for test in self._plan.tests]

    def motion(self, index: int) -> Motion:
        """Return what the validator sees in a test.

        Raises:
            ValueError: There is no such test.
        """
        if self._plan is None or not 0 <= index < len(self._plan.tests):
            raise ValueError(f"there is no test {index} of this robot")
        if index not in self._made:
            self._made[index] = self._simulated(self._plan, index)
        return self._made[index]

    def _simulated(self, plan: PlannedTests, index: int) -> Motion:
        model, simulation = self._shown.model, plan.simulations[index]
        fields = ("qpos", "ten_length", "actuator_force")
        record = simulate([simulation], frame_steps=plan.frame_steps, fields=fields, threads=1)
        frames = max(1, int(record.good_frames[0]))
        qpos, length, force = (record.fields[name][0, :frames] for name in fields)
        tension = np.array([tensions_n(model, *row) for row in zip(length, force, strict=True)])
        return Motion(record.frame_s, qpos, tension, simulation.ctrl[:frames])

    def _label(self, test: BatteryTest, drives: tuple[Drive, ...]) -> str:
        words = {
            "reference": "All tendons slack",
            "rest": "Everything commanded to do nothing",
            "all": "Everything pulls",
            "sweep": "Random commands",
        }
        if test.kind in words:
            return words[test.kind]
        drive = drives[test.drive]
        name = name_of(self._shown.model, mujoco.mjtObj.mjOBJ_ACTUATOR, drive.actuator).removeprefix("robot/")
        if test.kind == "released":
            return f"{name} pulls, the others let go"
        does = ("pulls" if test.command == drive.pull else "lets go") if drive.on_tendon else f"to {test.command:g}"
        return f"{name} alone {does}"
