"""Which motions are tried: random ones of three kinds, then the cross-entropy method around the best."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from aidsr.learn.openloop.motion import Motions
from aidsr.tasks.readings import FloatArray

MotionKind = Literal["pull", "swing", "both", "gait", "hold"]
"""Ramps from one value to another; sinusoids about a value; sinusoids on ramps; from rest, sinusoids of some groups
with a frequency for each, while the others stay at rest; ramps from rest to a value that is kept."""

MOTION_KINDS: tuple[MotionKind, ...] = ("pull", "swing", "both")
"""Those of `aidsr probe`, by which bodies of the benchmark are compared."""
ALL_KINDS: tuple[MotionKind, ...] = (*MOTION_KINDS, "gait")
WORKING_KINDS: tuple[MotionKind, ...] = ("hold", "pull", "both")
"""Those tried with a goal of one's own. Our choice: most are met by going somewhere and staying there."""
TRAVELLING_KINDS: tuple[MotionKind, ...] = ("swing", "both", "gait")
"""And where the robot itself has to get somewhere."""

_ELITE = 0.25
"""Elite fraction: share of the motions of a kind from which the next generation is sampled.

Source: de Boer et al. 2005, "A tutorial on the cross-entropy method", where 1 to 10 % of much larger samples are kept.
"""
_LEAST_SPREAD = 0.1
"""Of the search around its elite, in actions and in natural logarithms of times and frequencies. Our choice."""
_CLOSE = 0.3
"""Share of the elite's spread with which the very best motion is varied. Our choice: touch has narrow optima."""
_AT_REST = 0.4
"""Share of the groups that a random ramp leaves at rest. Our choice: a body bends to one side when few of its tendons
are pulled."""
_RATIOS = (0.5, 1.0, 1.0, 1.0, 2.0)
"""Of a group's frequency to the gait's: half a stroke, mostly one, or two while the others make one. Our choice."""
_FREQUENCY_HZ = (0.3, 3.0)
_FIRST_RAMP_S = 0.1
"""Our choice: what winches and bodies of this size can follow."""


@dataclass(frozen=True)
class MotionSpace:
    """Motions as rows of numbers, among which the search moves.

    Columns: first, change, sine and cosine of each group, then the logarithms of frequency [Hz], begin and ramp [s].
    Sine and cosine stand for amplitude and phase, because a phase has no mean. A gait has k frequencies, one for each
    group.
    """

    rest: FloatArray
    """Actions at which the controls are nearest to 0, (k,)."""
    longest_s: float
    """How long a motion is played."""

    def sample(self, kind: MotionKind, count: int, rng: np.random.Generator) -> FloatArray:
        """Return random motions of a kind, (count, 4 k + 3); of gaits (count, 5 k + 2)."""
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
        """Return new motions around the best of one kind: half about their mean, half close about the very best.

        Args:
            rows: Motions so far, as `sample` returns them.
            fitness: Their fitness, (n,).
            count: How many new ones.
            rng: Draws them.
            most: Motions of the elite at most; without it the elite grows with all that was played, and so does its
                spread.
        """
        size = max(2, int(_ELITE * fitness.size))
        elite = rows[np.argsort(-fitness, kind="stable")[: size if most is None else min(size, most)]]
        spread = np.maximum(elite.std(axis=0), _LEAST_SPREAD)
        half = np.arange(count)[:, None] % 2 == 0
        about, scale = np.where(half, elite.mean(axis=0), elite[0]), np.where(half, 1.0, _CLOSE)
        drawn = about + scale * spread * rng.standard_normal((count, rows.shape[1]))
        # a number in which no motion of the kind differs is none of the kind's
        return np.asarray(np.where(np.ptp(rows, axis=0) > 0.0, drawn, rows[0]))

    def motions(self, rows: FloatArray) -> Motions:
        """Return rows of numbers as motions."""
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
    """Return natural logarithms spread evenly over a span, (count,); its lower end where it ends before that."""
    low, high = span
    return rng.uniform(np.log(low), np.log(max(low, high)), count)
