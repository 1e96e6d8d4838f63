"""When a motion of the search is played no further: its variation is solved, or nothing comes of it any more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from aidsr.learn.episodes.batch import Episodes, Moment
from aidsr.learn.openloop.motion import Motions

__all__ = ["Stop"]

_MOVED = 0.005
"""Progress that counts as any. Our choice: a body that needs the whole time of its task gains several times as much in
the time that is waited for."""
_SETTLING_S = 1.0
"""Time that a body is given after its motion, and the hold of its task, to come somewhere. Our choice."""


class Stop:
    """Ends episodes early, looking on after every control step.

    A variation that a motion has solved needs no other motion; those still played in it end. A motion ends when its
    ramp is over and progress stood still for the hold of the task and a second, and one period longer if it swings.

    Args:
        episodes: Just begun; one motion is played in each.
        motions: Those motions.
        owners: Which variation each is searched for, (n,).
    """

    def __init__(self, episodes: Episodes, motions: Motions, owners: NDArray[np.intp]) -> None:
        self._episodes, self._owners = episodes, owners
        swings, ramps = motions.amplitude.any(axis=1), motions.change.any(axis=1)
        self._patience_s = episodes.task.hold_s + _SETTLING_S + np.where(swings, 1.0 / motions.frequency_hz, 0.0)
        self._moved_at_s = np.where(ramps, motions.begin_s + motions.ramp_s, 0.0)
        self._progress = np.zeros(episodes.n)

    def __call__(self, moment: Moment) -> None:
        """End what has nothing more to tell."""
        moved = np.abs(moment.progress - self._progress) > _MOVED
        self._progress = np.where(moved, moment.progress, self._progress)
        self._moved_at_s = np.where(moved, np.maximum(moment.time_s, self._moved_at_s), self._moved_at_s)
        still = moment.time_s - self._moved_at_s > self._patience_s
        solved = np.isin(self._owners, self._owners[moment.succeeded])
        self._episodes.running = self._episodes.running & ~(still | solved)
