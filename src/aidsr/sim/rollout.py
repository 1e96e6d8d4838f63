"""Many short simulations in parallel, stepped on native threads and recorded frame by frame."""

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
"""Largest size of the data recorded in one chunk, unless a single frame is larger. It is a fraction of a processor's
cache, so that reducing the data is fast."""
TOO_LITTLE_MEMORY = "MuJoCo's memory is too small for its contacts and constraints"
"""Failure of a simulation in which MuJoCo left out contacts or constraints, or stopped, for lack of memory."""
_TIME = int(mujoco.mjtState.mjSTATE_TIME)


@dataclass(frozen=True)
class Simulation:
    """One simulation to run.

    Attributes:
        model: Model; all models of a batch are variants of one model, with equal sizes. Automatic reset must be off.
        state: Initial state, (n_state,) of `mjSTATE_INTEGRATION`.
        ctrl: Controls, constant during each frame, (n_frames, nu).
    """

    model: mujoco.MjModel
    state: Array
    ctrl: Array


@dataclass(frozen=True)
class Recording:
    """Recorded data of a batch of simulations. The leading axes are simulation and frame.

    A simulation stops when it fails; its remaining frames repeat its last good frame.

    Attributes:
        frame_s: Simulated time between frames [s].
        fields: Recorded fields of MjData at the end of each frame, (n_sims, n_frames, ...).
        fastest: Largest absolute `qvel` within each frame, (n_sims, n_frames, nv) [m/s or rad/s].
        speed_m_s: Largest speed of each body's centre of mass within each frame, (n_sims, n_frames, nbody).
        acceleration_m_s2: Acceleration of each centre of mass at the end of each frame, (n_sims, n_frames, nbody).
        good_frames: Number of frames that each simulation completed, (n_sims,); n_frames if it did not fail.
        failures: Reason for the failure of each simulation, "" if it did not fail.
        states: Final states, (n_sims, n_state).
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
        """Return whether a simulation failed before its last frame ended."""
        return bool(self.failures[simulation])


def integration_state(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the state of `data` in the form in which a simulation can start from it, (n_state,)."""
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    return state


def simulate(
    simulations: Sequence[Simulation], *, frame_steps: int, fields: Sequence[str], threads: int = 2
) -> Recording:
    """Run simulations in parallel; the result does not depend on the number of threads.

    Args:
        simulations: At least one simulation; all have the same number of frames.
        frame_steps: Time steps per frame, at least 3, which the acceleration needs.
        fields: Names of the MjData fields to record, see `mujoco.batch.DATA_FIELDS`.
        threads: Number of native threads, including the calling one.

    Raises:
        ValueError: `frame_steps` is below 3.

    Source: `mujoco.batch.Batch`. Unlike `mujoco.rollout` it records derived fields, so world positions need no second
    pass through the simulation.
    """
    if frame_steps < _STEPS_FOR_ACCELERATION:
        raise ValueError(f"a frame needs at least {_STEPS_FOR_ACCELERATION} time steps, got {frame_steps}")
    run = _Run(simulations, frame_steps, tuple(fields), threads)
    for first in range(0, run.frames, run.chunk):
        if run.alive.size:
            run.advance(first, min(run.chunk, run.frames - first))
    return run.finish()


class _Run:
    """State of one call of `simulate`. Frames are simulated in chunks whose recorded data fits into `_CHUNK_BYTES`."""

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
        """Run the next `count` frames of the simulations that have not failed; record them and drop new failures."""
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
        """Return the recording buffers of one chunk; they are reallocated when their size changes."""
        steps, rows = count * self.frame_steps, self.alive.size
        if not self.buffers or self.buffers["qpos"].shape[:2] != (rows, steps):
            self.buffers = {name: np.zeros((rows, steps, *shape)) for name, shape in self.shapes.items()}
            self.buffers[_TIME] = np.zeros((rows, steps, 1))
        return self.buffers

    def _fatal_warnings(self) -> NDArray[np.int64]:
        """Return the number of fatal warnings so far of each simulation that has not failed."""
        return np.asarray(self.batch.warning[self.alive][:, FATAL_WARNINGS, 1].sum(axis=1))

    def _keep(self, records: dict[str | int, Array], first: int, count: int) -> None:
        """Reduce each frame of a chunk to the values at its end and its largest speeds."""
        frames = slice(first, first + count)
        rows = self.alive if self.alive.size < len(self.failures) else slice(None)
        by_frame = {
            name: values.reshape(self.alive.size, count, self.frame_steps, *values.shape[2:])
            for name, values in records.items()
        }
        for name in self.fields:
            self.kept[name][rows, frames] = by_frame[name][:, :, -1]
        self.fastest[rows, frames] = np.abs(by_frame["qvel"]).max(axis=2)
        displacement = np.diff(by_frame["xipos"], axis=2)
        self.speed[rows, frames] = (
            np.sqrt(np.einsum("...i,...i", displacement, displacement).max(axis=2)) / self.timestep_s
        )
        change = displacement[:, :, -1] - displacement[:, :, -2]
        self.acceleration[rows, frames] = np.sqrt(np.einsum("...i,...i", change, change)) / self.timestep_s**2

    def _drop(self, simulation: int, frame: int, reason: str) -> None:
        """Mark a simulation as failed in a frame; this and all later frames repeat the frame before it."""
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
    """Return the number of steps of a failed simulation before the first bad one.

    After the bad step, time no longer advances or values are not finite.
    """
    time_s = records[_TIME][row, :, 0]
    advanced = 1 + int(np.count_nonzero(np.diff(time_s) > 0))
    finite = np.isfinite(records["qpos"][row]).all(axis=1) & np.isfinite(records["qvel"][row]).all(axis=1)
    return min(advanced - 1, len(finite) if finite.all() else int(np.argmin(finite)))
