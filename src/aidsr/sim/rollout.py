"""Many short simulations at once, stepped on native threads and looked at frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError
from numpy.typing import NDArray

__all__ = ["Recording", "Simulation", "integration_state", "simulate"]

Array = NDArray[np.float64]

_FATAL = [
    int(mujoco.mjtWarning.mjWARN_INERTIA),
    int(mujoco.mjtWarning.mjWARN_BADQPOS),
    int(mujoco.mjtWarning.mjWARN_BADQVEL),
    int(mujoco.mjtWarning.mjWARN_BADQACC),
    int(mujoco.mjtWarning.mjWARN_BADCTRL),
]
"""Warnings after which the numbers mean nothing. Source: MuJoCo documentation, Simulation, "Diverging"."""

_STEPS_FOR_ACCELERATION = 3


@dataclass(frozen=True)
class Simulation:
    """One simulation to run.

    Attributes:
        model: Its model; all models of a batch are variants of one, with equal sizes. Automatic reset must be off.
        state: Where it starts, (n_state,) of `mjSTATE_INTEGRATION`.
        ctrl: Controls held during each frame, (n_frames, nu).
    """

    model: mujoco.MjModel
    state: Array
    ctrl: Array


@dataclass(frozen=True)
class Recording:
    """What a batch of simulations did. Leading axes are simulation and frame.

    A simulation that fails stops there; its later frames repeat its last good one.

    Attributes:
        frame_s: Simulated time between frames [s].
        fields: Recorded fields of MjData at the end of each frame, (n_sims, n_frames, ...).
        fastest: Largest absolute `qvel` within each frame, (n_sims, n_frames, nv) [m/s or rad/s].
        speed_m_s: Largest speed of each body's centre of mass within each frame, (n_sims, n_frames, nbody).
        acceleration_m_s2: Acceleration of each centre of mass at the end of each frame, (n_sims, n_frames, nbody).
        good_frames: Frames each simulation went through, (n_sims,); n_frames for one that never failed.
        failures: What stopped each simulation, "" for one that never failed.
        states: State at the end, (n_sims, n_state).
    """

    frame_s: float
    fields: dict[str, Array]
    fastest: Array
    speed_m_s: Array
    acceleration_m_s2: Array
    good_frames: NDArray[np.int64]
    failures: tuple[str, ...]
    states: Array

    def failed(self, simulation: int) -> bool:
        """Whether a simulation was stopped before its end."""
        return bool(self.failures[simulation])


def integration_state(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the state a simulation can start from, (n_state,)."""
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    return state


def simulate(
    simulations: Sequence[Simulation], *, frame_steps: int, fields: Sequence[str], threads: int = 2
) -> Recording:
    """Run simulations side by side; the result does not depend on the number of threads.

    Args:
        simulations: What to run, at least one, all with the same number of frames.
        frame_steps: Time steps in a frame, at least 3 for the acceleration.
        fields: MjData fields to keep, see `mujoco.batch.DATA_FIELDS`.
        threads: Native threads, this one included.

    Source: `mujoco.batch.Batch`. Against `mujoco.rollout` it also records derived fields, so that no simulation has to
    be walked through a second time for positions in the world.
    """
    if frame_steps < _STEPS_FOR_ACCELERATION:
        raise ValueError(f"a frame needs at least {_STEPS_FOR_ACCELERATION} time steps, got {frame_steps}")
    run = _Run(simulations, frame_steps, tuple(fields), threads)
    for frame in range(simulations[0].ctrl.shape[0]):
        if not run.alive.size:
            break
        run.advance(frame)
    return run.finish()


class _Run:
    """The arrays of one call of `simulate` while it runs."""

    def __init__(
        self, simulations: Sequence[Simulation], frame_steps: int, fields: tuple[str, ...], threads: int
    ) -> None:
        model = simulations[0].model
        count, frames = len(simulations), simulations[0].ctrl.shape[0]
        self.batch = Batch(model, nsim=count, nthread=threads)
        self.batch.set_models([simulation.model for simulation in simulations])
        self.batch.state[:] = np.stack([simulation.state for simulation in simulations])
        self.ctrl = np.stack([simulation.ctrl for simulation in simulations])
        self.timestep_s, self.frame_steps = float(model.opt.timestep), frame_steps
        self.fields, self.wanted = fields, tuple(dict.fromkeys((*fields, "qpos", "qvel", "xipos")))
        template = mujoco.MjData(model)
        self.shapes = {name: np.asarray(getattr(template, name)).shape for name in self.wanted}
        self.buffers: dict[str, Array] = {}
        self.kept = {name: np.zeros((count, frames, *self.shapes[name])) for name in fields}
        self.fastest = np.zeros((count, frames, model.nv))
        self.speed = np.zeros((count, frames, model.nbody))
        self.acceleration = np.zeros((count, frames, model.nbody))
        self.good_frames = np.full(count, frames)
        self.failures = [""] * count
        self.alive = np.arange(count)

    def advance(self, frame: int) -> None:
        """Run one frame of those still alive, keep what the good ones did and drop the others."""
        self.batch.ctrl[self.alive] = self.ctrl[self.alive, frame]
        before = self._fatal_warnings()
        errors: dict[int, str] = {}
        try:
            self.batch.rollout(self.frame_steps, record=self.wanted, ids=self.alive, out=self._buffers())
        except SimulationError as error:
            errors = {int(simulation): self.batch.error(int(simulation)) for simulation in error.ids}
        records = self._buffers()
        warned = self._fatal_warnings() > before
        finite = np.isfinite(records["qpos"]).all(axis=(1, 2)) & np.isfinite(records["qvel"]).all(axis=(1, 2))
        good = finite & ~warned & ~np.isin(self.alive, list(errors))
        self._keep(records, good, frame)
        if not good.all():
            self._drop({int(sim): errors.get(int(sim), "diverged") for sim in self.alive[~good]}, frame)

    def _fatal_warnings(self) -> NDArray[np.int64]:
        """How many of the fatal kinds of warning each simulation still alive has had."""
        return np.asarray(self.batch.warning[self.alive][:, _FATAL, 1].sum(axis=1))

    def _buffers(self) -> dict[str, Array]:
        """Arrays for one frame of everything recorded, made anew when a simulation was dropped."""
        count = self.alive.size
        if not self.buffers or len(self.buffers["qpos"]) != count:
            self.buffers = {
                name: np.zeros((count, self.frame_steps, *shape)) for name, shape in self.shapes.items()
            }
        return self.buffers

    def _keep(self, records: dict[str, Array], good: NDArray[np.bool_], frame: int) -> None:
        rows = self.alive[good]
        for name in self.fields:
            self.kept[name][rows, frame] = records[name][good, -1]
        self.fastest[rows, frame] = np.abs(records["qvel"][good]).max(axis=1)
        velocity = np.diff(records["xipos"][good], axis=1) / self.timestep_s
        self.speed[rows, frame] = np.linalg.norm(velocity, axis=-1).max(axis=1)
        change = (velocity[:, -1] - velocity[:, -2]) / self.timestep_s
        self.acceleration[rows, frame] = np.linalg.norm(change, axis=-1)

    def _drop(self, reasons: dict[int, str], frame: int) -> None:
        for simulation, reason in reasons.items():
            self.failures[simulation] = reason
            self.good_frames[simulation] = frame
            for kept in (*self.kept.values(), self.fastest, self.speed, self.acceleration):
                kept[simulation, frame:] = kept[simulation, frame - 1] if frame else 0.0
        self.alive = np.array([i for i in self.alive if int(i) not in reasons], dtype=int)

    def finish(self) -> Recording:
        return Recording(
            frame_s=self.frame_steps * self.timestep_s,
            fields=self.kept,
            fastest=self.fastest,
            speed_m_s=self.speed,
            acceleration_m_s2=self.acceleration,
            good_frames=self.good_frames,
            failures=tuple(self.failures),
            states=np.array(self.batch.state),
        )
