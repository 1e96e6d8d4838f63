"""Motions that are played back: the validator's tests of a robot, and recorded episodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.apps.web.view3d.display_model import DisplayModel
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sim.contact_forces import CONTACT_NUMBERS
from aidsr.sim.drive import Drive
from aidsr.sim.rollout import simulate
from aidsr.sim.structure import name_of
from aidsr.sim.tendon_tension import tensions_n
from aidsr.validation.battery import BatteryTest
from aidsr.validation.protocol import PlannedTests, Protocol, plan_tests

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Motion:
    """Positions over time, and other quantities, each None where it is unknown.

    Attributes:
        frame_s: Time between two rows [s].
        qpos: Positions as in MuJoCo, (n_frames, nq), finite.
        tension_n: Tension of each tendon, (n_frames, ntendon) [N].
        ctrl: Command of each control, (n_frames, nu).
        contacts: Contacts of the robot with anything else, (n, 7): frame, point (3) [m], force on the robot (3) [N].
        progress: Progress on the task, 0 to 1, (n_frames,).
        holds: Above 0 in frames in which the goal holds, (n_frames,).
        ended: How the episode ended, in a word; empty where that is unknown.
    """

    frame_s: float
    qpos: Array
    tension_n: Array | None = None
    ctrl: Array | None = None
    contacts: Array | None = None
    progress: Array | None = None
    holds: Array | None = None
    ended: str = ""

    @property
    def duration_s(self) -> float:
        """Time from the first to the last row [s]."""
        return (len(self.qpos) - 1) * self.frame_s

    def contacts_at(self, frame: int) -> Array:
        """Return point [m] and force on the robot [N] of each contact in a frame, (n, 6)."""
        if self.contacts is None:
            return np.zeros((0, CONTACT_NUMBERS))
        first, last = np.searchsorted(self.contacts[:, 0], (frame, frame + 1))
        return self.contacts[first:last, 1:]

    @classmethod
    def recorded(cls, model: mujoco.MjModel, frame_s: float, arrays: Mapping[str, Array], ended: str = "") -> Self:
        """Return a recorded motion, up to the first row with a position that is not finite.

        Args:
            model: The model that moves.
            frame_s: Time between two rows [s].
            arrays: Arrays, named like the attributes of this class; at least `qpos`.
            ended: See the class.

        Raises:
            ValueError: The arrays do not fit the model.
        """
        qpos = arrays["qpos"]
        if qpos.ndim != 2 or qpos.shape[1] != model.nq or not len(qpos) or not frame_s > 0:
            raise ValueError(f"expected positions of shape (n, {model.nq}) and their distance in s, found {qpos.shape}")
        broken = np.flatnonzero(~np.isfinite(qpos).all(axis=1))
        frames = int(broken[0]) if broken.size else len(qpos)
        wanted: dict[str, tuple[int, ...]] = {"tension_n": (len(qpos), model.ntendon), "ctrl": (len(qpos), model.nu)}
        wanted |= {"progress": (len(qpos),), "holds": (len(qpos),)}
        rest: dict[str, Array] = {}
        for name, shape in wanted.items():
            if name in arrays:
                if arrays[name].shape != shape or not np.isfinite(arrays[name]).all():
                    raise ValueError(f"expected {name} of shape {shape}, found {arrays[name].shape}")
                rest[name] = arrays[name][:frames]
        contacts = arrays.get("contacts")
        if contacts is not None:
            if contacts.ndim != 2 or contacts.shape[1] != 1 + CONTACT_NUMBERS or not np.isfinite(contacts).all():
                raise ValueError(f"expected contacts of shape (n, {1 + CONTACT_NUMBERS}), found {contacts.shape}")
            rest["contacts"] = contacts[np.argsort(contacts[:, 0], kind="stable")]
        return cls(frame_s, qpos[:frames], **rest, ended=ended)


class Tests:
    """The validator's battery of tests for the shown model; each test is simulated when it is first requested."""

    def __init__(self, shown: DisplayModel) -> None:
        self._shown = shown
        self._plan: PlannedTests | None = None
        protocol = Protocol()
        if shown.structure.moving and protocol.steps(shown.model, shown.structure) <= protocol.most_steps:
            self._plan = plan_tests(shown.model, shown.structure, protocol, threads=1)
        self._made: dict[int, Motion] = {}

    @property
    def labels(self) -> list[str]:
        """A label of each test, in words; empty where the robot does not survive settling or testing takes too long."""
        if self._plan is None:
            return []
        return [self._label(test, self._plan.drives) for test in self._plan.tests]

    def motion(self, index: int) -> Motion:
        """Return the motion that the validator simulates in a test.

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
            "rest": "All commands at rest",
            "all": "All actuators pull",
            "sweep": "Random commands",
        }
        if test.kind in words:
            return words[test.kind]
        drive = drives[test.drive]
        name = name_of(self._shown.model, mujoco.mjtObj.mjOBJ_ACTUATOR, drive.actuator).removeprefix(ROBOT_PREFIX)
        if test.kind == "released":
            return f"{name} pulls, the others are released"
        does = ("pulls" if test.command == drive.pull else "is released") if drive.on_tendon else f"to {test.command:g}"
        return f"{name} alone {does}"
