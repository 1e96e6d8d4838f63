"""Choice of the motions that are tried: random ones of several kinds, then the cross-entropy method around the best."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from aidsr.learn.openloop.motion import Motions
from aidsr.tasks.readings import FloatArray

MotionKind = Literal["pull", "swing", "both", "gait", "hold"]
"""Kinds of motions:

- pull: ramps from one value to another;
- swing: sinusoids about a value;
- both: sinusoids on top of ramps;
- gait: from rest, sinusoids of some groups, each with its own frequency, while the other groups stay at rest;
- hold: ramps from rest to a value that is then kept.
"""

MOTION_KINDS: tuple[MotionKind, ...] = ("pull", "swing", "both")
"""Kinds that `aidsr probe` tries at the tasks of the benchmark, where robots are compared by them."""
ALL_KINDS: tuple[MotionKind, ...] = (*MOTION_KINDS, "gait")
WORKING_KINDS: tuple[MotionKind, ...] = ("hold", "pull", "both")
"""Kinds tried with a user-defined goal. Our choice: most goals are met by moving somewhere and staying there."""
TRAVELLING_KINDS: tuple[MotionKind, ...] = ("swing", "both", "gait")
"""Kinds tried with a user-defined goal that requires the robot itself to travel."""

_ELITE = 0.25
"""Elite fraction: share of the motions of a kind from which the next generation is sampled.

Source: de Boer et al. 2005, "A tutorial on the cross-entropy method", where 1 to 10 % of much larger samples are kept.
"""
_LEAST_SPREAD = 0.1
"""Smallest standard deviation of the search around its elite, in actions and in natural logarithms of times and
frequencies. Our choice."""
_CLOSE = 0.3
"""Share of the elite's standard deviation with which the single best motion is varied. Our choice: contact tasks have
narrow optima."""
_AT_REST = 0.4
"""Share of the groups that a random ramp or gait leaves at rest. Our choice: a robot bends to one side when few of its
tendons are pulled."""
_RATIOS = (0.5, 1.0, 1.0, 1.0, 2.0)
"""Ratios of a group's frequency to the gait's frequency: usually equal, sometimes half or double. Our choice."""
_FREQUENCY_HZ = (0.3, 3.0)
_FIRST_RAMP_S = 0.1
"""Shortest ramp [s]. Our choice: what winches and robots of this size can follow."""


@dataclass(frozen=True)
class MotionSpace:
    """Search space, in which every motion is a row of numbers.

    Columns: first value, change, sine and cosine part of each group, then the logarithms of frequency [Hz], start of
    the ramp [s] and duration of the ramp [s]. Sine and cosine parts represent amplitude and phase, because phases
    cannot be averaged. A gait has k frequencies, one for each group.
    """

    rest: FloatArray
    """Action of each group at which its controls are nearest to 0, (k,)."""
    longest_s: float
    """Maximum duration of a motion [s]."""

    def sample(self, kind: MotionKind, count: int, rng: np.random.Generator) -> FloatArray:
        """Return random motions of one kind, (count, 4 k + 3); for gaits, (count, 5 k + 2)."""
        k = self.rest.size
        if kind == "gait":
            return self._gaits(count, rng)
        first, change, sine, cosine = np.zeros((4, count, k))
        first += self.rest
        if kind == "hold":
            ends = np.where(rng.random((count, k)) < _AT_REST, self.rest, rng.uniform(-1.0, 1.0, (count, k)))
            times = [np.zeros(count), np.full(count, np.log(_FIRST_RAMP_S))]
            times += [_log_uniform(rng, (0.3, 0.2 * self.longest_s), count)]
            return np.concatenate([first, ends - first, sine, cosine, np.stack(times, axis=1)], axis=1)
        if kind in ("swing", "both"):
            amplitude, phase = rng.uniform(0.2, 2.0, (count, k)), rng.uniform(0.0, 2 * np.pi, (count, k))
            sine, cosine = amplitude * np.cos(phase), amplitude * np.sin(phase)
            first = self.rest + rng.uniform(-1.0, 1.0, (count, k))
        if kind in ("pull", "both"):
            ends = np.where(rng.random((2, count, k)) < _AT_REST, self.rest, rng.uniform(-1.0, 1.0, (2, count, k)))
            first = ends[0] if kind == "pull" else first
            change = ends[1] - ends[0]
        times = [_log_uniform(rng, _FREQUENCY_HZ, count)]
        times += [_log_uniform(rng, (_FIRST_RAMP_S, part * self.longest_s), count) for part in (0.5, 0.3)]
        return np.concatenate([first, change, sine, cosine, np.stack(times, axis=1)], axis=1)

    def _gaits(self, count: int, rng: np.random.Generator) -> FloatArray:
        """Return random gaits, (count, 5 k + 2)."""
        k = self.rest.size
        moving = rng.random((count, k)) >= _AT_REST
        amplitude, phase = rng.uniform(0.2, 1.0, (count, k)) * moving, rng.uniform(0.0, 2 * np.pi, (count, k))
        first = np.tile(self.rest, (count, 1))
        change = np.where(moving, rng.uniform(-1.0, 1.0, (count, k)) - first, 0.0)
        sine, cosine = amplitude * np.cos(phase), amplitude * np.sin(phase)
        frequency = _log_uniform(rng, _FREQUENCY_HZ, count)[:, None] + np.log(rng.choice(_RATIOS, (count, k)))
        begin, ramp = np.full((2, count, 1), np.log(_FIRST_RAMP_S))
        return np.concatenate([first, change, sine, cosine, frequency, begin, ramp], axis=1)

    def refine(
        self, rows: FloatArray, fitness: FloatArray, count: int, rng: np.random.Generator, *, most: int | None = None
    ) -> FloatArray:
        """Return new motions of one kind: half around the mean of the elite, half close to the single best motion.

        Args:
            rows: Motions played so far, as `sample` returns them.
            fitness: Fitness of these motions, (n,).
            count: Number of new motions.
            rng: Random generator.
            most: Maximum size of the elite. Without it, the elite and its spread grow with the number of motions
                played.
        """
        size = max(2, int(_ELITE * fitness.size))
        elite = rows[np.argsort(-fitness, kind="stable")[: size if most is None else min(size, most)]]
        spread = np.maximum(elite.std(axis=0), _LEAST_SPREAD)
        half = np.arange(count)[:, None] % 2 == 0
        about, scale = np.where(half, elite.mean(axis=0), elite[0]), np.where(half, 1.0, _CLOSE)
        drawn = about + scale * spread * rng.standard_normal((count, rows.shape[1]))
        # a column in which all motions of a kind are equal is not a parameter of that kind
        return np.asarray(np.where(np.ptp(rows, axis=0) > 0.0, drawn, rows[0]))

    def motions(self, rows: FloatArray) -> Motions:
        """Return the motions that rows of numbers represent: (n, 4 k + 3), or (n, 5 k + 2) for gaits."""
        k = self.rest.size
        first, change, sine, cosine = (rows[:, i * k : (i + 1) * k] for i in range(4))
        frequency, (begin, ramp) = np.exp(rows[:, 4 * k : -2]), np.exp(rows[:, -2:]).T
        return Motions(
            first=first,
            change=change,
            amplitude=np.hypot(sine, cosine),
            phase_rad=np.arctan2(cosine, sine),
            frequency_hz=np.clip(frequency, *_FREQUENCY_HZ),
            begin_s=begin,
            ramp_s=np.maximum(ramp, _FIRST_RAMP_S),
        )


def _log_uniform(rng: np.random.Generator, span: tuple[float, float], count: int) -> FloatArray:
    """Return natural logarithms drawn evenly from a span, (count,); the lower end where the upper end is below it."""
    low, high = span
    return rng.uniform(np.log(low), np.log(max(low, high)), count)
