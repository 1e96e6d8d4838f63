"""The networks of soft actor-critic, with an average of its actors."""

from __future__ import annotations

import copy

import torch
from stable_baselines3.common.type_aliases import Schedule
from stable_baselines3.sac.policies import Actor, SACPolicy


class AveragedPolicy(SACPolicy):
    """Its average of the actors' weights is what acts without noise, in training and afterwards.

    An actor that follows its values from one update to the next wins today what it loses tomorrow; their average is a
    steadier policy. Source: Polyak and Juditsky 1992, "Acceleration of stochastic approximation by averaging".
    """

    averaged: Actor

    def _build(self, lr_schedule: Schedule) -> None:
        super()._build(lr_schedule)
        self.averaged = copy.deepcopy(self.actor).requires_grad_(False)
        self.averaged.set_training_mode(False)

    @torch.no_grad()
    def average(self, rate: float) -> None:
        """Move the average to the actor by this share of what is between them; 1 makes it the actor itself."""
        torch._foreach_lerp_(tuple(self.averaged.parameters()), tuple(self.actor.parameters()), rate)
