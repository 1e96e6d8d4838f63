"""Search for a motion script (waypoints for each group, plus a sinusoid), starting from a known motion.

A motion of the probe has one ramp for all groups. Tasks of several steps, such as approaching, closing and lifting,
need groups that act one after the other, which a script can express.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Self

import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import EpisodeResult
from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.episodes.rollout import EpisodeOutcomes, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop.fitness import fitness_of
from aidsr.learn.openloop.motion import Motion, Motions
from aidsr.learn.openloop.script_policy import script_policy
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.tasks import Variation
from aidsr.tasks.readings import FloatArray

WAYPOINTS = 6
"""Number of waypoints of each group, evenly spaced over the duration of the search's scripts. Our choice: three steps
of a task, each with a hold."""
GENERATION = 12
_PARENTS = 3
"""Number of best scripts so far from which new ones are made. Our choice."""
_SMALL, _ANEW = 0.3, 0.4
"""Standard deviation of a small change of an action, and share of changes that replace the action instead."""
_DETUNED = 0.15
"""Standard deviation of the logarithm of the factors by which amplitudes and frequencies are changed."""


@dataclass(frozen=True)
class Scripts:
    """A batch of n scripts for k groups, as arrays."""

    times_s: FloatArray
    """Times of the waypoints (w,)."""
    actions: FloatArray
    """Actions at the waypoints, -1 to 1 (n, k, w)."""
    amplitude: FloatArray
    """Amplitudes of the sinusoids (n, k)."""
    frequency_hz: FloatArray
    """Frequencies of the sinusoids (n, k)."""
    phase_rad: FloatArray
    """Phases of the sinusoids (n, k)."""

    @classmethod
    def of(cls, motion: Motion, horizon_s: float) -> Self:
        """Return the script that approximates a motion, as a batch of one."""
        times_s = np.linspace(0.0, horizon_s, WAYPOINTS)
        motions = Motions.of([motion])
        ramp = np.clip((times_s - motions.begin_s[0]) / motions.ramp_s[0], 0.0, 1.0)
        actions = motions.first[0][:, None] + motions.change[0][:, None] * ramp
        return cls(times_s, actions[None], motions.amplitude, motions.frequency_hz, motions.phase_rad)

    @classmethod
    def joined(cls, parts: list[Self]) -> Self:
        """Return several batches joined into one."""
        arrays = [np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(cls)[1:]]
        return cls(parts[0].times_s, *arrays)

    def row(self, index: int) -> Self:
        """Return one script as a batch of one."""
        return type(self)(self.times_s, *(getattr(self, one.name)[index : index + 1] for one in fields(self)[1:]))

    def at(self, time_s: float) -> FloatArray:
        """Return the actions at a time, -1 to 1 (n, k)."""
        step = self.times_s[1]
        before = min(int(time_s / step), WAYPOINTS - 2)
        share = min(time_s / step - before, 1.0)
        base = (1 - share) * self.actions[:, :, before] + share * self.actions[:, :, before + 1]
        swing = self.amplitude * np.sin(2 * np.pi * self.frequency_hz * time_s + self.phase_rad)
        return np.asarray(np.clip(base + swing, -1.0, 1.0))

    def changed(self, rng: np.random.Generator) -> Self:
        """Return a mutated copy of a batch of one script.

        Some groups are changed over a range of waypoints, and the amplitudes and frequencies of all sinusoids.
        """
        actions = self.actions.copy()
        k = actions.shape[1]
        for group in rng.permutation(k)[: 1 + rng.integers(min(k, 3))]:
            begin = int(rng.integers(WAYPOINTS))
            end = int(rng.integers(begin, WAYPOINTS)) + 1
            if rng.random() < _ANEW:
                actions[0, group, begin:end] = rng.uniform(-1.0, 1.0)
            else:
                actions[0, group, begin:end] += _SMALL * rng.standard_normal()
        scale = np.exp(_DETUNED * rng.standard_normal((2, 1, k)))
        return type(self)(
            self.times_s,
            np.clip(actions, -1.0, 1.0),
            self.amplitude * scale[0],
            self.frequency_hz * scale[1],
            self.phase_rad,
        )

    def text(self, names: list[str]) -> str:
        """Return the first script in the notation of `aidsr.learn.openloop.script`."""
        lines = []
        for group, name in enumerate(names):
            points = ", ".join(f"t={t:.4g} {a:.3g}" for t, a in zip(self.times_s, self.actions[0, group], strict=True))
            if np.ptp(self.actions[0, group]) < 5e-4:
                points = f"{self.actions[0, group, 0]:.3g}"
            line = f"{name.removeprefix(ROBOT_PREFIX)}: {points}"
            if self.amplitude[0, group]:
                line += (
                    f"; amplitude {self.amplitude[0, group]:.3g} hz {self.frequency_hz[0, group]:.4g} phase "
                    f"{np.rad2deg(self.phase_rad[0, group]):.1f}"
                )
            lines.append(line)
        return "\n".join(lines)


class _Played:
    """Policy that plays a batch of scripts, one in each episode."""

    def __init__(self, scripts: Scripts, control_dt_s: float) -> None:
        self._scripts, self._control_dt_s, self._steps = scripts, control_dt_s, 0

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return the next actions (n, k)."""
        del observation
        self._steps += 1
        return self._scripts.at((self._steps - 1) * self._control_dt_s)


@dataclass(frozen=True)
class FoundScript:
    """The best script of a search as text, the result of its full episode, and the number of scripts tried."""

    script: str
    episode: EpisodeResult
    tried: int


def search_script(
    scene: TaskScene, motion: Motion, *, variation: int, seed: int, max_steps: int, longest_s: float
) -> FoundScript:
    """Search for the best script by an evolutionary search, and play its text form for a full episode.

    The search ends at a success or when the physics steps are used up.

    Args:
        scene: The robot in the environment of its task.
        motion: Motion to start from.
        variation: Index of the development variation.
        seed: Seed of the random generator.
        max_steps: Largest number of physics steps of all simulations together.
        longest_s: Duration for which scripts of the search are played, at most the task's time limit [s].
    """
    rng, task = np.random.default_rng(seed), scene.task
    chosen = task.variation("development", variation)
    horizon_s, step_s = min(longest_s, task.time_limit_s), float(scene.model.opt.timestep)
    left = max_steps - round(task.time_limit_s / step_s)
    known, fitness, tried = [Scripts.of(motion, horizon_s)], np.array([-np.inf]), 0
    while fitness.max() <= 1.0 and (count := min(GENERATION, int(left * step_s / horizon_s))) > 1:
        parents = [known[index] for index in np.argsort(-fitness, kind="stable")[:_PARENTS]]
        new = [parents[int(rng.integers(len(parents)))].changed(rng) for _ in range(count - (tried == 0))]
        new = [known[0], *new] if not tried else new
        outcomes = _play(scene, Scripts.joined(new), [chosen] * count, horizon_s)
        known, fitness = (
            (new, fitness_of(outcomes))
            if not tried
            else (
                [*known, *new],
                np.concatenate([fitness, fitness_of(outcomes)]),
            )
        )
        tried += count
        left -= round(float(outcomes.time_s.sum()) / step_s)
    script = known[int(fitness.argmax())].text([group.name for group in scene.actions.groups])
    episodes = Episodes(scene.model, task, scene.actions, [chosen], threads=1)
    return FoundScript(script, rollout(episodes, script_policy(scene, script)).result(0, variation), tried)


def _play(scene: TaskScene, scripts: Scripts, variations: list[Variation], seconds: float) -> EpisodeOutcomes:
    """Play scripts until one succeeds or all end."""
    episodes = Episodes(scene.model, scene.task, scene.actions, variations, threads=1)
    episodes.time_limit_s[:] = seconds

    def stop_all(result: StepResult) -> None:
        if result.success.any():
            episodes.running = np.zeros_like(episodes.running)

    return rollout(episodes, _Played(scripts, scene.task.control_dt_s), stop_all)
