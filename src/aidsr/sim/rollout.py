"""Many short simulations at once, stepped on native threads and recorded frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError
from numpy.typing import NDArray

from aidsr.sim.divergence import FATAL_WARNINGS, FULL_WARNINGS, numbers_failed

Array = NDArray[np.float64]

_STEPS_FOR_ACCELERATION = 3
_CHUNK_BYTES = 8 * 2**20
"""Memory of what is recorded between two looks: a share of a processor's cache, so that reducing it stays quick."""
TOO_LITTLE_MEMORY = "MuJoCo's memory is too small for its contacts and constraints"
"""Failure of a simulation in which MuJoCo left some out, or stopped."""
_TIME = int(mujoco.mjtState.mjSTATE_TIME)


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

    Source: `mujoco.batch.Batch`. Unlike `mujoco.rollout` it records derived fields, so that no simulation has to be
    walked through a second time for positions in the world.
    """
    if frame_steps < _STEPS_FOR_ACCELERATION:
        raise ValueError(f"a frame needs at least {_STEPS_FOR_ACCELERATION} time steps, got {frame_steps}")
    run = _Run(simulations, frame_steps, tuple(fields), threads)
    for first in range(0, run.frames, run.chunk):
        if run.alive.size:
            run.advance(first, min(run.chunk, run.frames - first))
    return run.finish()


class _Run:
    """The arrays of one call of `simulate` while it runs. A chunk is as many frames as fit into bounded memory."""

    def __init__(
        self, simulations: Sequence[Simulation], frame_steps: int, fields: tuple[str, ...], threads: int
    ) -> None:
        model = simulations[0].model
        count, self.frames = len(simulations), simulations[0].ctrl.shape[0]
        self.batch = Batch(model, nsim=count, nthread=threads)
        self.batch.set_models([simulation.model for simulation in simulations])
        self.batch.state[:] = np.stack([simulation.state for simulation in simulations])
        self.ctrl = np.stack([simulation.ctrl for simulation in simulations])
        self.timestep_s, self.frame_steps, self.fields = float(model.opt.timestep), frame_steps, fields
        template = mujoco.MjData(model)
        wanted = dict.fromkeys((*fields, "qpos", "qvel", "xipos"))
        self.shapes = {name: np.asarray(getattr(template, name)).shape for name in wanted}
        numbers = count * frame_steps * sum(int(np.prod(shape)) for shape in self.shapes.values())
        self.chunk = max(1, min(self.frames, _CHUNK_BYTES // (8 * max(1, numbers))))
        self.kept = {name: np.zeros((count, self.frames, *self.shapes[name])) for name in fields}
        self.fastest = np.zeros((count, self.frames, model.nv))
        self.speed = np.zeros((count, self.frames, model.nbody))
        self.acceleration = np.zeros((count, self.frames, model.nbody))
        self.good_frames = np.full(count, self.frames)
        self.failures = [""] * count
        self.alive = np.arange(count)
        self.buffers: dict[str | int, Array] = {}

    def advance(self, first: int, count: int) -> None:
        """Run some frames of those still alive, keep what was good and drop those that failed."""
        ctrl = np.repeat(self.ctrl[self.alive, first : first + count], self.frame_steps, axis=1)
        records = self._buffers(count)
        before = self._fatal_warnings()
        errors: dict[int, str] = {}
        try:
            self.batch.rollout(ctrl.shape[1], control=ctrl, record=list(records), ids=self.alive, out=records)
        except SimulationError as error:
            errors = {int(simulation): self.batch.error(int(simulation)) for simulation in error.ids}
        warned = (self._fatal_warnings() > before) | np.isin(self.alive, list(errors))
        good = np.full(self.alive.size, count)
        for row in np.flatnonzero(numbers_failed(warned, records["qvel"])):
            good[row] = _good_steps(records, int(row)) // self.frame_steps
        self._keep(records, first, count)
        for simulation, frames in zip(self.alive.tolist(), good.tolist(), strict=True):
            if frames < count:
                reason = errors.get(simulation, "diverged")
                if "out of memory" in reason or self.batch.warning[simulation, FULL_WARNINGS, 1].any():
                    reason = TOO_LITTLE_MEMORY
                self._drop(simulation, first + frames, reason)
        self.alive = self.alive[good == count]

    def _buffers(self, count: int) -> dict[str | int, Array]:
        """Arrays for one chunk of everything recorded, reallocated when its size changes."""
        steps, rows = count * self.frame_steps, self.alive.size
        if not self.buffers or self.buffers["qpos"].shape[:2] != (rows, steps):
            self.buffers = {name: np.zeros((rows, steps, *shape)) for name, shape in self.shapes.items()}
            self.buffers[_TIME] = np.zeros((rows, steps, 1))
        return self.buffers

    def _fatal_warnings(self) -> NDArray[np.int64]:
        """How many of the fatal kinds of warning each simulation still alive has had."""
        return np.asarray(self.batch.warning[self.alive][:, FATAL_WARNINGS, 1].sum(axis=1))

    def _keep(self, records: dict[str | int, Array], first: int, count: int) -> None:
        """Reduce each frame of a chunk to its end and its extremes."""
        frames = slice(first, first + count)
        rows = self.alive if self.alive.size < len(self.failures) else slice(None)
        by_frame = {
            name: values.reshape(self.alive.size, count, self.frame_steps, *values.shape[2:])
            for name, values in records.items()
        }
        for name in self.fields:
            self.kept[name][rows, frames] = by_frame[name][:, :, -1]
        self.fastest[rows, frames] = np.abs(by_frame["qvel"]).max(axis=2)
        way = np.diff(by_frame["xipos"], axis=2)
        self.speed[rows, frames] = np.sqrt(np.einsum("...i,...i", way, way).max(axis=2)) / self.timestep_s
        change = way[:, :, -1] - way[:, :, -2]
        self.acceleration[rows, frames] = np.sqrt(np.einsum("...i,...i", change, change)) / self.timestep_s**2

    def _drop(self, simulation: int, frame: int, reason: str) -> None:
        """Let a simulation end before a frame: what follows repeats the frame before it."""
        self.failures[simulation] = reason
        self.good_frames[simulation] = frame
        for kept in (*self.kept.values(), self.fastest, self.speed, self.acceleration):
            kept[simulation, frame:] = kept[simulation, frame - 1] if frame else 0.0

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


def _good_steps(records: dict[str | int, Array], row: int) -> int:
    """Steps of a failed simulation before the bad one: after it time stands still, or numbers are not finite."""
    time_s = records[_TIME][row, :, 0]
    advanced = 1 + int(np.count_nonzero(np.diff(time_s) > 0))
    finite = np.isfinite(records["qpos"][row]).all(axis=1) & np.isfinite(records["qvel"][row]).all(axis=1)
    return min(advanced - 1, len(finite) if finite.all() else int(np.argmin(finite)))
