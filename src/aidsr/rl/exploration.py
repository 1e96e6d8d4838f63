"""How much noise a policy explores with while it learns."""

from __future__ import annotations

import math

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

from aidsr.rl.recipe import Recipe

__all__ = ["Exploration"]


class Exploration(BaseCallback):
    """Lets the bonus for entropy fall evenly to nothing over the budget, and noise grow no larger than at the start.

    Actions are clipped to their range, so noise beyond it costs nothing more. With a bonus it then grows without end,
    and what was learned holds only with the noise.
    """

    def __init__(self, recipe: Recipe) -> None:
        super().__init__()
        self._bonus, self._most_log_std = recipe.entropy_bonus, math.log(recipe.action_noise_std)

    def _on_rollout_start(self) -> None:
        assert isinstance(self.model, PPO)
        self.model.ent_coef = self._bonus * (1.0 - self.num_timesteps / self.locals["total_timesteps"])
        with torch.no_grad():
            self.model.policy.log_std.clamp_(max=self._most_log_std)

    def _on_step(self) -> bool:
        return True
