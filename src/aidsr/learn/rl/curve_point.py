"""A point of a learning curve."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CurvePoint:
    """State of a training after some steps."""

    steps: int
    wall_s: float
    episodes: int
    """Ended so far. The first ones of all simulations are cut short at different times, see `BatchedVecEnv`, so that
    success is reported too low rather than too high before the task's time limit has passed once."""
    success_share: float
    """Of the last 100 episodes, with noise, or of SAC's last 20 without; nan before the first. Lost episodes end last,
    at the time limit, and so are missing at first."""
    progress: float
    """Mean at their ends."""
    reward: float
    """Mean of their sums."""
    diverged: int
    """Episodes in which the simulation diverged, so far."""
    steps_per_s: float
    """Since the point before."""
    won: int = 0
    """Episodes that succeeded so far, of SAC those without noise."""
