"""Gymnasium spaces of observations and actions."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces

from aidsr.learn.episodes.batch import OBSERVATION_LIMIT, Episodes


def observation_space(episodes: Episodes) -> spaces.Box[Any]:
    """Return the space of one simulation's observations, (n_observations,)."""
    return spaces.Box(-OBSERVATION_LIMIT, OBSERVATION_LIMIT, episodes.observation.shape[1:], np.float32)


def action_space(episodes: Episodes) -> spaces.Box[Any]:
    """Return the space of one simulation's actions, (n_actions,)."""
    return spaces.Box(-1.0, 1.0, (episodes.actions.size,), np.float32)
