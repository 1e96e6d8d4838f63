"""How much noise a policy explores with while it learns."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, cast

import torch
from stable_baselines3.common.callbacks import BaseCallback

from aidsr.learn.rl.recipe import Recipe

if TYPE_CHECKING:
    from stable_baselines3 import PPO


class Exploration(BaseCallback):
    """Lets a policy explore freely with a bonus for entropy, and takes both from it in the last part of the budget.

    Actions are clipped to their range, so noise beyond it costs nothing more, and with a bonus it grows to several
    times the range. That finds motions which smaller noise does not, but they hold only with the noise. In the last
    part there is no bonus, and the largest noise that is left to the policy falls evenly, in its logarithm, to
    `Recipe.final_noise_std`.
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
