"""A trained policy: the network, and the normalisation of its observations."""

from __future__ import annotations

import contextlib
import hashlib
import json
import warnings
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from pickle import UnpicklingError
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from aidsr.core.errors import UserError
from aidsr.learn.rl.recipe import Recipe
from aidsr.learn.rl.training_folder import NORMALISATION_FILE, POLICY_FILE
from aidsr.tasks.readings import FloatArray

if TYPE_CHECKING:
    from stable_baselines3.common.policies import BasePolicy
    from stable_baselines3.common.vec_env import VecNormalize

_MAX_BYTES = 64 * 2**20
"""Maximum size of a policy, unpacked, and of its normalisation [bytes]. Our choice: a hundred times what a usual
network takes."""
_ACTOR, _CRITICS = "actor.", ("critic.", "critic_target.")
"""Prefixes of the names of a SAC policy's weights in Stable-Baselines3."""
_UNREADABLE = (ValueError, TypeError, RuntimeError, EOFError, RecursionError, NotImplementedError, UnpicklingError)
"""Exceptions raised when files that should contain weights or JSON contain something else; the first also covers JSON
and text."""


@dataclass(frozen=True)
class Normalisation:
    """Running statistics of observations and returns, as VecNormalize of Stable-Baselines3 keeps them."""

    mean: FloatArray
    """Mean of each observation, (n_observations,)."""
    var: FloatArray
    count: float
    return_mean: float
    return_var: float
    return_count: float
    clip: float
    epsilon: float

    @classmethod
    def of(cls, env: VecNormalize) -> Self:
        """Return the statistics of a training."""
        seen, returns = env.obs_rms, env.ret_rms
        assert not isinstance(seen, dict)  # observations are a single array
        return cls(
            mean=seen.mean,
            var=seen.var,
            count=float(seen.count),
            return_mean=float(returns.mean),
            return_var=float(returns.var),
            return_count=float(returns.count),
            clip=env.clip_obs,
            epsilon=env.epsilon,
        )

    def restore(self, env: VecNormalize) -> None:
        """Restore these statistics in a training."""
        assert not isinstance(env.obs_rms, dict)  # observations are a single array
        env.obs_rms.mean, env.obs_rms.var, env.obs_rms.count = self.mean.copy(), self.var.copy(), self.count
        env.ret_rms.mean, env.ret_rms.var = np.array(self.return_mean), np.array(self.return_var)
        env.ret_rms.count = self.return_count

    def apply(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return normalised observations, the input of the network, (n, n_observations) as given; -clip to clip."""
        return np.clip((observation - self.mean) / np.sqrt(self.var + self.epsilon), -self.clip, self.clip)

    def to_json(self) -> str:
        """Return the statistics as JSON."""
        plain = {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in vars(self).items()}
        return json.dumps(plain) + "\n"

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Return the statistics that `to_json` wrote.

        Raises:
            ValueError, TypeError, KeyError: The text holds something else.
        """
        plain = json.loads(text)
        try:
            arrays = {name: np.array(plain[name], dtype=float) for name in ("mean", "var")}
            numbers = {name: float(value) for name, value in plain.items() if name not in arrays}
        except OverflowError:
            raise ValueError("the normalisation has an integer that no float can hold") from None
        if arrays["mean"].ndim != 1 or arrays["var"].shape != arrays["mean"].shape:
            raise ValueError("the normalisation is not one number for each observation")
        if not np.isfinite([*arrays["mean"], *arrays["var"], *numbers.values()]).all():
            raise ValueError("the normalisation has a number that is not finite")
        return cls(mean=arrays["mean"], var=arrays["var"], **numbers)


def _text_within_limit(path: Path) -> str:
    if path.stat().st_size > _MAX_BYTES:
        raise UserError(f"{path} has more than {_MAX_BYTES // 2**20} MiB; train the policy again")
    return path.read_text(encoding="utf-8")


def network_options(recipe: Recipe) -> dict[str, Any]:
    """Return the options of Stable-Baselines3 that define the network of a recipe."""
    from aidsr.learn.rl.fused_adam import FusedAdam

    options = {"net_arch": list(recipe.hidden_sizes), "optimizer_class": FusedAdam}
    if recipe.algorithm == "sac":
        return options
    epsilon = {"eps": 1e-5}  # default of Stable-Baselines3 for PPO
    return options | {"log_std_init": float(np.log(recipe.action_noise_std)), "optimizer_kwargs": epsilon}


@contextlib.contextmanager
def one_torch_thread() -> Iterator[None]:
    """Limit torch to one thread: for networks this small, more threads only wait for each other."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@dataclass(frozen=True)
class TrainedPolicy:
    """A trained policy that acts without noise."""

    network: BasePolicy
    """Network that acts: the actor of soft actor-critic, without its critics; the whole policy of PPO."""
    normalisation: Normalisation

    @classmethod
    def of(cls, policy: BasePolicy, normalisation: Normalisation) -> Self:
        """Return a trained policy with the acting part of a Stable-Baselines3 policy."""
        from stable_baselines3.sac.policies import SACPolicy

        return cls(policy.actor if isinstance(policy, SACPolicy) else policy, normalisation)

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return actions for observations, (n, n_observations) -> (n, n_groups), -1 to 1; see `Policy`."""
        action, _ = self.network.predict(self.normalisation.apply(observation).astype(np.float32), deterministic=True)
        return np.asarray(action, dtype=np.float64)

    @property
    def fingerprint(self) -> str:
        """SHA-256 of weights and normalisation: the same policy has the same fingerprint in any file."""
        digest = hashlib.sha256(self.normalisation.to_json().encode())
        for name, weights in sorted(self.network.state_dict().items()):
            digest.update(name.encode() + weights.numpy(force=True).tobytes())
        return digest.hexdigest()

    @classmethod
    def load(cls, folder: Path, recipe: Recipe, n_actions: int) -> Self:
        """Return the policy in a folder.

        Only numbers are read from its policy.zip, never the Python objects that such a file may also contain.

        Args:
            folder: Folder with policy.zip and normalisation.json.
            recipe: Hyperparameters with which the policy was trained.
            n_actions: Number of values in an action.

        Raises:
            UserError: There is no such policy, or it belongs to another robot.
        """
        import torch
        from stable_baselines3.common.policies import ActorCriticPolicy
        from stable_baselines3.sac.policies import SACPolicy

        try:
            normalisation = Normalisation.from_json(_text_within_limit(folder / NORMALISATION_FILE))
            with zipfile.ZipFile(folder / POLICY_FILE) as archive:
                if archive.getinfo("policy.pth").file_size > _MAX_BYTES:
                    raise UserError(f"the policy in {folder} has more than {_MAX_BYTES // 2**20} MiB; train it again")
                content = BytesIO(archive.read("policy.pth"))
            with warnings.catch_warnings(
                action="ignore"
            ):  # warnings about files that torch did not write; loading them then fails
                weights = torch.load(content, map_location="cpu", weights_only=True)
        except (OSError, KeyError, zipfile.BadZipFile) as error:
            raise UserError(f"no trained policy in {folder}: {error}") from None
        except _UNREADABLE as error:
            reason = str(error).strip().partition("\n")[0]
            raise UserError(f"the policy in {folder} cannot be read ({reason}); train it again") from None
        seen = spaces.Box(-np.inf, np.inf, normalisation.mean.shape, np.float32)
        done = spaces.Box(-1.0, 1.0, (n_actions,), np.float32)
        kind = ActorCriticPolicy if recipe.algorithm == "ppo" else SACPolicy
        options = network_options(recipe) | {"optimizer_class": _NoOptimizer}
        policy = cls.of(kind(seen, done, lambda _: recipe.learning_rate, **options), normalisation)
        try:
            policy.network.load_state_dict(_that_act(weights))
        except (RuntimeError, TypeError, AttributeError):
            raise UserError(
                f"the policy in {folder} was trained for a robot with other actuators, or with another recipe"
            ) from None
        return policy


class _NoOptimizer:
    """Placeholder for the optimizer of a finished policy: creating a real one loads torch's compiler for 2 s."""

    def __init__(self, *_: object, **__: object) -> None:
        pass


def _that_act(weights: dict[str, Any]) -> dict[str, Any]:
    """Return the weights of the actor, with its names, if there is an actor; else all weights."""
    of_actor = {name.removeprefix(_ACTOR): each for name, each in weights.items() if name.startswith(_ACTOR)}
    return of_actor or weights


def without_critics(weights: bytes) -> bytes:
    """Return a policy.pth without the critics of soft actor-critic; it acts in the same way."""
    import torch

    kept = torch.load(BytesIO(weights), map_location="cpu", weights_only=True)
    small = BytesIO()
    torch.save({name: each for name, each in kept.items() if not name.startswith(_CRITICS)}, small)
    return small.getvalue()
