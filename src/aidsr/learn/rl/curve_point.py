"""A point of a learning curve."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CurvePoint:
    """State of a training after some steps."""

    steps: int
    wall_s: float
    episodes: int
    """Number of episodes that have ended so far. The first ones of all simulations are truncated at different times,
    see `BatchedVecEnv`, so that success is reported too low rather than too high until the task's time limit has passed
    once."""
    success_share: float
    """Success share of the last 100 episodes, with noise, or of SAC's last 20 without noise; nan before the first.
    Unsuccessful episodes end last, at the time limit, so they are missing at first."""
    progress: float
    """Mean progress at the end of these episodes."""
    reward: float
    """Mean sum of rewards of these episodes."""
    diverged: int
    """Number of episodes so far in which the simulation diverged."""
    steps_per_s: float
    """Control steps per second since the previous point."""
    won: int = 0
    """Number of episodes that succeeded so far; with SAC, of those without noise."""
