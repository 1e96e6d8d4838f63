"""A policy at one moment of its training."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import torch
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.vec_env import VecNormalize

from aidsr.learn.rl.policy import Normalisation
from aidsr.learn.rl.training_folder import NORMALISATION_FILE


@dataclass(frozen=True)
class Snapshot:
    """Weights of all networks, and the normalisation with which they were used."""

    weights: Mapping[str, torch.Tensor]
    normalisation: Normalisation

    @classmethod
    def of(cls, policy: BasePolicy, env: VecNormalize) -> Self:
        """Return the present state of a training."""
        weights = {name: value.clone() for name, value in policy.state_dict().items()}
        return cls(weights, Normalisation.of(env))

    def restore(self, policy: BasePolicy, env: VecNormalize) -> None:
        """Restore this state in a training."""
        policy.load_state_dict(self.weights)
        self.normalisation.restore(env)

    def save(self, folder: Path) -> None:
        """Write the snapshot into a new folder."""
        folder.mkdir()
        torch.save(dict(self.weights), folder / "weights.pth")
        (folder / NORMALISATION_FILE).write_text(self.normalisation.to_json(), encoding="utf-8")

    @classmethod
    def load(cls, folder: Path) -> Self | None:
        """Return the snapshot that `save` wrote, None if there is none. Only numbers are read, no Python objects."""
        if not folder.exists():
            return None
        weights = torch.load(folder / "weights.pth", map_location="cpu", weights_only=True)
        return cls(weights, Normalisation.from_json((folder / NORMALISATION_FILE).read_text(encoding="utf-8")))
