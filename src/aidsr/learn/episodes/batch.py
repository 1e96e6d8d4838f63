"""Parallel episodes of one task: all simulations advance in one native call, and all values are arrays."""

from __future__ import annotations

import contextlib
import copy
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch, SimulationError
from numpy.typing import NDArray

from aidsr.core.artifacts import ExceededLimit
from aidsr.learn.episodes.actions import ActionMap
from aidsr.learn.episodes.cable_friction import REFRESH_S, CableFriction
from aidsr.learn.episodes.perturbation import DelayLine, PerturbedModels, perturbation_of
from aidsr.learn.episodes.proprioception import Proprioception
from aidsr.sim.divergence import batch_diverged, warnings_ignored
from aidsr.sim.jacobian import choose_jacobian
from aidsr.sim.structure import read_structure
from aidsr.tasks import Reader, Readings, Task, Variation, apply_to_batch
from aidsr.tasks.condition import Condition
from aidsr.tasks.readings import BoolArray, FloatArray
from aidsr.tasks.scoring import merge, reset, score

OBSERVATION_LIMIT = 1e6
"""Observations are clipped to this magnitude, so that the last one before a divergence fits into single precision. Our
choice: far above any meaningful length, speed or force."""


@dataclass(frozen=True)
class StepResult:
    """Result of one control step of n episodes; arrays are (n,) unless stated otherwise.

    Rows of episodes that had ended before the step are zero or False.
    """

    observation: NDArray[np.float32]
    """Observations, (n, n_observations)."""
    reward: FloatArray
    """Reward of the step, (n,)."""
    progress: FloatArray
    """Progress after the step, (n,), 0 to 1."""
    violation: FloatArray
    """Violation of the task's limits, by which its penalty is scaled, (n,), 0 to 1."""
    success: BoolArray
    """The goal was held long enough; the episode ends."""
    failure: BoolArray
    """A rule of the task ends the episode as failed."""
    diverged: BoolArray
    """The simulation diverged; the episode ends."""
    truncated: BoolArray
    """The time limit alone ends the episode."""
    time_s: FloatArray
    """Time since the beginning of the episode [s]."""

    @property
    def terminated(self) -> BoolArray:
        """Whether success, failure or divergence ended the episode."""
        return self.success | self.failure | self.diverged

    @property
    def done(self) -> BoolArray:
        """Whether the episode ended for any reason."""
        return self.terminated | self.truncated


class Episodes:
    """Parallel episodes of a task in one scene. An episode that has ended stands still until it is reset.

    Args:
        model: The compiled scene; it is copied.
        task: Task that defines observation and score.
        actions: Mapping of actions to actuators.
        variations: Variation of each episode, possibly with a perturbation; their number is the number of episodes.
        threads: Native threads, including the calling one; 0 takes all processors. The results do not depend on it.
        smoothing: Share of the previous action that is kept in the next, 0 to below 1.
        record: Fields of MjData to record in every physics step, see `recorded`.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        task: Task,
        actions: ActionMap,
        variations: Sequence[Variation],
        *,
        threads: int = 0,
        smoothing: float = 0.0,
        record: Sequence[str] = (),
    ) -> None:
        if not 0.0 <= smoothing < 1.0:
            raise ValueError(f"smoothing out of range: {smoothing}; use 0 to below 1")
        self.model = copy.copy(model)
        # after an automatic reset, a diverged simulation would look like a new one
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
        choose_jacobian(self.model)
        self.task, self.actions, self.n, self.smoothing = task, actions, len(variations), smoothing
        self.batch = Batch(self.model, nsim=self.n, nthread=threads)
        self.structure = read_structure(self.model)
        self.physics_steps = max(1, round(task.control_dt_s / self.model.opt.timestep))
        self.time_limit_s = np.full(self.n, task.time_limit_s)
        """Time at which each episode is truncated [s]; a reset restores the task's time limit."""
        self.running = np.zeros(self.n, dtype=np.bool_)
        self.variations = list(variations)
        self.recorded: dict[str, FloatArray] = {}
        """Fields recorded in the last control step, (n_running, physics_steps, ...) each; their rows are the episodes
        in `stepped`."""
        self.stepped: NDArray[np.intp] = np.arange(0)
        """Indices of the episodes that the last control step advanced."""
        self._record = ("sensordata", *record)
        self._reader = Reader.of(task, self.model)
        self._body = Proprioception.of(self.model, self.structure)
        self._last_action = np.tile(actions.rest, (self.n, 1))
        self._held = self._last_action.copy()
        self._age_steps = np.zeros(self.n, dtype=np.int64)
        self._base = actions.base.playback(self.n) if actions.base else None
        self._models = PerturbedModels(self.batch, self.structure)
        self._delay = DelayLine(actions.rest, self.n, task.control_dt_s)
        self._friction: CableFriction | None = None
        self._cable_friction = np.zeros(self.n)
        self._template = mujoco.MjData(self.model)
        self._bind_outputs()
        self._apply(np.arange(self.n))
        readings = self._read(self._sensordata[:, None])
        self._state, self._readings = reset(task, readings), readings
        self.observation = self._observe(readings)
        """Present observations, (n, n_observations)."""

    @property
    def progress(self) -> FloatArray:
        """Present progress of each episode, (n,), 0 to 1."""
        return self._state.progress

    @property
    def applied_action(self) -> FloatArray:
        """Action applied in the last control step, after smoothing and correction, (n, k), -1 to 1."""
        return self._last_action

    @property
    def holds(self) -> BoolArray:
        """Whether the goal holds at present, (n,), for any duration; success requires `hold_s`."""
        return np.asarray(self.held_s > 0.0)

    @property
    def held_s(self) -> FloatArray:
        """Time for which the goal has held without a break, (n,) [s]."""
        return self._state.held_s

    def exceeded_limits(self, index: int) -> tuple[ExceededLimit, ...]:
        """Return the limits that an episode has violated so far."""
        return self.task.exceeded_limits({name: value[index] for name, value in self._state.task_state.items()})

    def conditions(self) -> tuple[Condition, ...]:
        """Return the conditions of the task's stages as they are after the last control step."""
        return self.task.conditions(self._readings, self._state.task_state)

    def lost_by(self, index: int) -> str:
        """Return the sentences of the rules by which an episode failed in the last control step."""
        losses = self.task.losses(self._readings, self._state.task_state)
        return " ".join(sentence for sentence, lost in losses.items() if lost[index])

    def copy_state(self, index: int, data: mujoco.MjData) -> None:
        """Copy the present state of an episode to a simulation, so that `mj_forward` computes its forces.

        The state includes activations: without them, winches with a time constant would not pull.
        """
        for field in ("qpos", "qvel", "act", "ctrl"):
            getattr(data, field)[:] = self.batch.bind(field)[index]

    def _bind_outputs(self) -> None:
        """Bind the derived fields that are read, so that MuJoCo copies them out."""
        fields = ["sensordata", "ten_length", "ten_velocity", "actuator_force", "cvel", "xipos", "subtree_com"]
        for field in [*fields, *(["geom_xpos", "geom_xmat"] if self.task.needs_outline else [])]:
            self.batch.bind(field)
        self._sensordata = np.zeros((self.n, self.model.nsensordata))

    def reset(self, ids: NDArray[np.intp], variations: Sequence[Variation]) -> NDArray[np.float32]:
        """Reset some episodes and return the observations of all, (n, n_observations).

        Args:
            ids: Indices of the episodes, in ascending order.
            variations: One variation for each of them.
        """
        for index, variation in zip(ids.tolist(), variations, strict=True):
            self.variations[index] = variation
        self._apply(ids)
        which = np.isin(np.arange(self.n), ids)
        readings = self._readings = self._read(self._sensordata[:, None])
        self._state = merge(self._state, reset(self.task, readings), which)
        self.observation = np.where(which[:, None], self._observe(readings), self.observation)
        return self.observation

    def _apply(self, ids: NDArray[np.intp]) -> None:
        variations = [self.variations[i] for i in ids.tolist()]
        perturbations = [perturbation_of(variation) for variation in variations]
        self._cable_friction[ids] = [one.cable_friction for one in perturbations]
        if self._friction is None and self._cable_friction.any():
            self._friction = CableFriction(self.batch, self.structure)
        self._models.restore(ids)
        with warnings_ignored():
            apply_to_batch(variations, self.batch, ids.tolist())
        self._models.write(ids, perturbations)
        self._delay.reset(ids, perturbations)
        self.running[ids] = True
        self.time_limit_s[ids] = self.task.time_limit_s
        self._last_action[ids] = self.actions.rest
        self._age_steps[ids] = 0
        self._sensordata[ids] = self.batch.bind("sensordata")[ids]

    def step(self, action: NDArray[np.floating]) -> StepResult:
        """Advance every running episode by one control step.

        Args:
            action: Actions of the policy, (n, n_actions), -1 to 1. They are ignored while an earlier action is held. In
                a scene with a base motion, they correct that motion.
        """
        clipped: FloatArray = np.clip(np.asarray(action, dtype=np.float64), -1.0, 1.0)
        is_due = self._age_steps % self.actions.hold_steps == 0
        self._held = np.where(is_due[:, None], clipped, self._held)
        requested = self._held
        if self._base is not None:
            time_s = self._age_steps.astype(np.float64) * self.task.control_dt_s
            requested = self.actions.corrected(self._base.at(time_s, self.observation), self._held)
        running = self.running.copy()
        self._age_steps += running
        applied = self.smoothing * self._last_action + (1.0 - self.smoothing) * requested
        self._last_action = np.where(running[:, None], applied, self._last_action)
        samples, diverged = self._simulate(running)
        readings = self._readings = self._read(samples)
        after, scored = score(self.task, self._state, readings, requested)
        good = running & ~diverged
        self._state = merge(self._state, after, good)
        # the readings of a diverged simulation are meaningless: its last observation is kept
        self.observation = np.where(good[:, None], self._observe(readings), self.observation)
        success, failure = good & scored.success, good & scored.failure & ~scored.success
        over = readings.time_s > self.time_limit_s - self.task.control_dt_s / 2
        result = StepResult(
            observation=self.observation,
            reward=np.where(good, scored.reward, 0.0),
            progress=np.where(running, self._state.progress, 0.0),
            violation=np.where(good, scored.violation, 0.0),
            success=success,
            failure=failure,
            diverged=diverged,
            truncated=good & over & ~success & ~failure,
            time_s=np.where(running, readings.time_s, 0.0),
        )
        self.running = running & ~result.done
        return result

    def _simulate(self, running: BoolArray) -> tuple[FloatArray, BoolArray]:
        """Run the physics of one control step; return samples, (n, steps, nsensordata), and divergence, (n,)."""
        self.stepped = ids = np.flatnonzero(running)
        ctrl = self.batch.bind("ctrl")
        for name, value in self.task.script(self._read(self._sensordata[:, None])).items():
            ctrl[ids, self.model.actuator(name).id] = value[ids]
        arriving = self._delay.send(self._last_action)
        ctrl[np.ix_(ids, np.array(self.actions.actuators))] = self.actions.ctrl(arriving)[ids]
        samples = np.repeat(self._sensordata[:, None], self.physics_steps, axis=1)
        failed = np.zeros(self.n, dtype=np.bool_)
        if ids.size:
            self.recorded, failed = self._rollout(ids)
            samples[ids] = self.recorded["sensordata"]
        diverged = running & (batch_diverged(self.batch) | failed)
        samples[diverged] = self._sensordata[diverged, None]
        self._sensordata = samples[:, -1].copy()
        return samples, diverged

    def _rollout(self, ids: NDArray[np.intp]) -> tuple[dict[str, FloatArray], BoolArray]:
        """Return the recorded fields, (n_running, steps, ...) each, and whether each simulation had an error, (n,)."""
        shapes = {name: getattr(self._template, name).shape for name in self._record}
        out = {name: np.zeros((ids.size, self.physics_steps, *shape)) for name, shape in shapes.items()}
        if self._friction is None or not self._cable_friction[ids].any():
            return out, self._advance(ids, self.physics_steps, out)
        failed = np.zeros(self.n, dtype=np.bool_)
        at_once = max(1, round(REFRESH_S / self.model.opt.timestep))
        for first in range(0, self.physics_steps, at_once):
            self._friction.apply(ids, self._cable_friction[ids])
            steps = min(at_once, self.physics_steps - first)
            part = {name: np.zeros((ids.size, steps, *shape)) for name, shape in shapes.items()}
            failed |= self._advance(ids, steps, part)
            for name, values in part.items():
                out[name][:, first : first + steps] = values
        return out, failed

    def _advance(self, ids: NDArray[np.intp], steps: int, out: dict[str, FloatArray]) -> BoolArray:
        """Run some physics steps; return whether each simulation had an error, (n,)."""
        # errors of single simulations are in batch.status
        with warnings_ignored(), contextlib.suppress(SimulationError):
            self.batch.rollout(steps, record=self._record, ids=ids, out=out)
        return np.asarray(self.batch.status != 0)

    def _read(self, samples: FloatArray) -> Readings:
        outline = self.task.needs_outline
        return self._reader.read(
            samples,
            self.batch.bind("time").copy(),
            self.variations,
            self.batch.bind("geom_xpos") if outline else None,
            self.batch.bind("geom_xmat") if outline else None,
        )

    def _observe(self, readings: Readings) -> NDArray[np.float32]:
        """Return proprioception, last action and the task's features, (n, n_observations)."""
        features = self.task.observe(readings, self._state.task_state)
        seen = np.concatenate([self._body.read(self.batch), self._last_action, features], axis=1)
        return np.asarray(np.clip(np.nan_to_num(seen), -OBSERVATION_LIMIT, OBSERVATION_LIMIT), dtype=np.float32)
