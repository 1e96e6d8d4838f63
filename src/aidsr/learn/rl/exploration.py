"""Schedule of the exploration noise during PPO training."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, cast

import torch
from stable_baselines3.common.callbacks import BaseCallback

from aidsr.learn.rl.recipe import Recipe

if TYPE_CHECKING:
    from stable_baselines3 import PPO


class Exploration(BaseCallback):
    """Callback that first allows free exploration with an entropy bonus, and ends both in the last part of the budget.

    Actions are clipped to their range, so larger noise has no extra cost, and with a bonus it grows to several times
    the range. Such noise finds motions that smaller noise does not find, but they work only with the noise. In the last
    part there is no bonus, and the upper limit of the noise decreases exponentially to `Recipe.final_noise_std`.
    """

    def __init__(self, recipe: Recipe) -> None:
        super().__init__()
        self._recipe = recipe

    def _on_rollout_start(self) -> None:
        model, recipe = cast("PPO", self.model), self._recipe
        left = 1.0 - self.num_timesteps / self.locals["total_timesteps"]
        if left >= recipe.settling:
            model.ent_coef = recipe.entropy_bonus
            return
        model.ent_coef = 0.0
        first, last = math.log(recipe.settling_noise_std), math.log(recipe.final_noise_std)
        with torch.no_grad():
            model.policy.log_std.clamp_(max=last + (first - last) * left / recipe.settling)

    def _on_step(self) -> bool:
        return True
