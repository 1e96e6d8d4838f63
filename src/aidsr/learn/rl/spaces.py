"""What Gymnasium is told of observations and actions."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from aidsr.learn.episodes.batch import OBSERVED_LIMIT, Episodes

__all__ = ["action_space", "observation_space"]


def observation_space(episodes: Episodes) -> spaces.Box[Any]:
    """Return the space of one simulation's observations, (n_observations,)."""
    return spaces.Box(-OBSERVED_LIMIT, OBSERVED_LIMIT, episodes.observation.shape[1:], np.float32)


def action_space(episodes: Episodes) -> spaces.Box[Any]:
    """Return the space of one simulation's actions, (n_actions,)."""
    return spaces.Box(-1.0, 1.0, (episodes.actions.size,), np.float32)
