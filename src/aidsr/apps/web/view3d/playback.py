"""What a view plays: a live simulation that a person commands, or a recorded motion."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.apps.web.view3d.display_model import DisplayModel
from aidsr.apps.web.view3d.frames import Snapshot
from aidsr.apps.web.view3d.motions import Array, Motion
from aidsr.sim.contact_forces import ContactForces
from aidsr.sim.divergence import FATAL_WARNINGS, numbers_failed
from aidsr.sim.drive import set_act
from aidsr.sim.tendon_tension import tensions_n

SPEED_BOUNDS = (0.02, 4.0)
"""Minimum and maximum speed [times real time]."""
_CHUNK_STEPS = 5
_PAST_FRAMES = 1500
"""Number of frames of the live simulation that can be played back. Our choice: a minute."""


@dataclass(frozen=True, eq=False)
class _Moment:
    """The state of the live simulation at one time."""

    time_s: float
    qpos: Array
    tension_n: Array
    ctrl: Array
    contacts: Array


class Playback:
    """One model in motion.

    Attributes:
        shown: The model.
        motion: Motion that is played back; None while the simulation is live.
        runs: Whether time advances.
        speed: Requested speed [times real time].
        pace: Recently reached speed [times real time]; below `speed` where the machine is too slow.
        time_s: Time of the simulation, or in the motion [s].
        trouble: Why the simulation stopped, as a message to the person; empty where it did not.
    """

    def __init__(self, shown: DisplayModel) -> None:
        self.shown = shown
        self.motion: Motion | None = None
        self.runs, self.speed, self.pace, self.time_s, self.trouble = True, 1.0, 0.0, 0.0, ""
        self._data = mujoco.MjData(shown.model)
        self._contacts = ContactForces(shown.model, np.array(shown.structure.geoms, np.intp))
        self._drag = mujoco.MjvPerturb()
        self._owed_s = 0.0
        self._past: deque[_Moment] = deque(maxlen=_PAST_FRAMES)
        self.go_live()

    def go_live(self) -> None:
        """Switch to the live simulation and reset it, with the neutral command for every actuator."""
        self.motion = None
        self._begin()
        model, data = self.shown.model, self._data
        data.ctrl[:] = self.shown.neutral
        set_act(model, data, self.shown.neutral)
        mujoco.mj_forward(model, data)

    def play_back(self, motion: Motion) -> None:
        """Play a motion from its beginning."""
        self.motion = motion
        self._begin()
        self.seek(0.0)

    def reset(self) -> None:
        """Go back to the beginning of the simulation or the motion."""
        if self.motion is None:
            self.go_live()
        else:
            self.play_back(self.motion)

    def resume(self) -> None:
        """Resume playing; a motion that has ended starts again."""
        self.runs = True
        if self.motion is not None and self.time_s >= self.motion.duration_s:
            self.seek(0.0)

    def command(self, ctrl: Mapping[int, float]) -> None:
        """Set some commands, by their index in MuJoCo's `ctrl`; a motion is replaced by the live simulation.

        Raises:
            ValueError: An index does not exist, or a command is not finite.
        """
        if not all(0 <= at < self.shown.model.nu and math.isfinite(value) for at, value in ctrl.items()):
            raise ValueError(f"expected finite commands for {self.shown.model.nu} controls, found {dict(ctrl)}")
        if self.motion is not None or self.trouble:
            self.go_live()
        self.runs = True
        for at, value in ctrl.items():
            self._data.ctrl[at] = value

    def drag(self, body: str, point: Array, to: Array) -> None:
        """Pull a body of the live simulation by one of its points with a spring, as MuJoCo's viewer does.

        Args:
            body: Name of the body.
            point: Point at which the body was grabbed, (3,), in world coordinates at that time [m].
            to: Point to which it is pulled, (3,), in world coordinates [m].

        Raises:
            ValueError: There is no such body, or a motion is played back.
        """
        index = mujoco.mj_name2id(self.shown.model, mujoco.mjtObj.mjOBJ_BODY, body)
        if index < 1 or self.motion is not None:
            raise ValueError(f"{body[:80]} cannot be dragged here")
        if self._drag.select != index or not self._drag.active:
            self._drag.select, self._drag.active = index, int(mujoco.mjtPertBit.mjPERT_TRANSLATE)
            turned = self._data.xmat[index].reshape(3, 3)
            self._drag.localpos = turned.T @ (point - self._data.xpos[index])
            self.shown.lines.begin_drag(self._data, self._drag)
        self._drag.refselpos = to
        self.runs = True

    def let_go(self) -> None:
        """End dragging."""
        self._drag.active = 0
        self._data.xfrc_applied[:] = 0.0

    def look_back(self) -> Motion | None:
        """Return the recent past of the live simulation as a motion; None where there is none."""
        if self.motion is not None or len(self._past) < 2:
            return None
        past = list(self._past)
        times = np.array([one.time_s for one in past])
        frame_s = (times[-1] - times[0]) / (len(past) - 1)
        nearest = np.abs(times[:, None] - times[0] - frame_s * np.arange(len(past))).argmin(axis=0)
        rows = [past[int(at)] for at in nearest]
        contacts = [np.insert(one.contacts, 0, index, axis=1) for index, one in enumerate(rows)]
        return Motion(
            float(frame_s),
            np.array([one.qpos for one in rows]),
            np.array([one.tension_n for one in rows]),
            np.array([one.ctrl for one in rows]),
            np.concatenate(contacts),
        )

    def seek(self, time_s: float) -> None:
        """Go to a time in the motion that is played back; a live simulation is left unchanged."""
        if self.motion is None:
            return
        self.time_s = min(max(time_s, 0.0), self.motion.duration_s)
        at = self.time_s / self.motion.frame_s
        before, after = math.floor(at), min(math.floor(at) + 1, len(self.motion.qpos) - 1)
        mixed = self.motion.qpos[before] + (at - before) * (self.motion.qpos[after] - self.motion.qpos[before])
        self._data.qpos[:] = mixed
        mujoco.mj_normalizeQuat(self.shown.model, self._data.qpos)
        mujoco.mj_fwdPosition(self.shown.model, self._data)

    def advance(self, wall_s: float, budget_s: float) -> None:
        """Advance time.

        Args:
            wall_s: Wall-clock time that has passed [s].
            budget_s: Maximum processor time to spend on it [s].
        """
        if not self.runs:
            return
        if self.motion is None:
            self._simulate(wall_s, budget_s)
            return
        self.pace = self.speed
        self.seek(self.time_s + wall_s * self.speed)
        self.runs = self.time_s < self.motion.duration_s

    def moment(self) -> Snapshot:
        """Return what is visible now."""
        model, data, motion = self.shown.model, self._data, self.motion
        if motion is None:
            tension, ctrl = tensions_n(model, data.ten_length, data.actuator_force), np.array(data.ctrl)
            contacts = self._contacts.read(data)
        else:
            row = min(round(self.time_s / motion.frame_s), len(motion.qpos) - 1)
            tension = np.zeros(model.ntendon) if motion.tension_n is None else motion.tension_n[row]
            ctrl = np.array(self.shown.neutral) if motion.ctrl is None else motion.ctrl[row]
            contacts = motion.contacts_at(row)
        poses, segments = self.shown.parts.poses(data), self.shown.lines.segments(data)
        return Snapshot(self.time_s, self.pace, poses, segments, tension, ctrl, contacts)

    def _begin(self) -> None:
        mujoco.mj_resetData(self.shown.model, self._data)
        self._past.clear()
        self.let_go()
        self.time_s, self.trouble, self._owed_s, self.runs = 0.0, "", 0.0, True

    def _simulate(self, wall_s: float, budget_s: float) -> None:
        model, data, end = self.shown.model, self._data, time.thread_time() + budget_s
        step_s = float(model.opt.timestep)
        wanted = math.floor((wall_s * self.speed + self._owed_s) / step_s)
        self._owed_s = min(wall_s * self.speed + self._owed_s - wanted * step_s, step_s)
        done = 0
        try:
            while done < wanted and time.thread_time() < end:
                steps = min(_CHUNK_STEPS, wanted - done)
                if self._drag.active:
                    data.xfrc_applied[:] = 0.0
                    mujoco.mjv_applyPerturbForce(model, data, self._drag)
                mujoco.mj_step(model, data, nstep=steps)
                done += steps
        except mujoco.FatalError as error:
            self._stop(str(error))
        # smoothed over about ten frames, so that the number can be read
        self.pace += 0.1 * (done * step_s / wall_s - self.pace)
        self.time_s = float(data.time)
        if done:
            self._remember()
        warned = np.array([any(data.warning[kind].number for kind in FATAL_WARNINGS)])
        if numbers_failed(warned, data.qpos[None])[0]:
            self._stop("the state grew without bound")

    def _remember(self) -> None:
        model, data = self.shown.model, self._data
        tension_n = tensions_n(model, data.ten_length, data.actuator_force)
        contacts = self._contacts.read(data)
        self._past.append(_Moment(self.time_s, data.qpos.copy(), tension_n, data.ctrl.copy(), contacts))

    def _stop(self, why: str) -> None:
        self.runs = False
        self.trouble = f"The simulation diverged at {self.time_s:.3g} s: {why}. Reset it to continue."
        if not np.isfinite(self._data.qpos).all():
            mujoco.mj_resetData(self.shown.model, self._data)
            mujoco.mj_forward(self.shown.model, self._data)
