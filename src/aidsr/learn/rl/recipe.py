"""Hyperparameters of training: one set for all tasks and robots, and the options of a user."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from aidsr.core.artifacts import Artifact
from aidsr.core.config import Protocol
from aidsr.core.errors import UserError

if TYPE_CHECKING:
    from aidsr.learn.episodes.scene import TaskScene

Share = Annotated[float, Field(ge=0, le=1)]

HOPELESS_AFTER = 0.7
"""Share of the budget after which a SAC training without a single success of the noise-free policy counts as hopeless.
Our choice, measured in benchmarks/learning."""


LEAST_TELLING = 10_000
"""Smallest budget of control steps that can tell whether a robot learns its task. Our choice: a sixth of the budget
with which `HOPELESS_AFTER` was measured."""

LEAST_SEARCHED = 10_000
"""Smallest budget of control steps with which a motion is searched. Our choice: the search itself takes as many."""


class Recipe(Artifact):
    """Hyperparameters of PPO (Schulman et al. 2017) or SAC (Haarnoja et al. 2018) with Stable-Baselines3.

    Training runs on batched simulations. The defaults are those of PPO. Source: our choice, measured on an arm and a
    crawler (docs/learning.md): many simulations with short rollouts and a high learning rate learn several times faster
    from the same physics than the usual long rollouts.

    A recipe has all fields, whatever its algorithm, and config.json stores them all. "PPO only" and "SAC only" mark the
    fields that the other algorithm ignores; they are then stored unused.
    """

    algorithm: Literal["ppo", "sac"] = "ppo"
    """PPO is protocol "paper", SAC is protocol "best"."""
    simulations: Annotated[int, Field(ge=1)] = 64
    """Number of parallel simulations."""
    rollout_steps: Annotated[int, Field(ge=1)] = 8
    """Control steps of each simulation between two updates. PPO only."""
    batch_size: Annotated[int, Field(ge=2)] = 128
    """Transitions of one gradient step."""
    epochs: Annotated[int, Field(ge=1)] = 10
    """Passes through each rollout. PPO only."""
    learning_rate: Annotated[float, Field(gt=0)] = 1e-3
    """Learning rate at the start."""
    final_learning_rate: Annotated[float, Field(gt=0)] = 1e-4
    """Learning rate at the end of the budget. It decreases linearly, so that the policy has stopped fluctuating when it
    is kept."""
    gamma: Share = 0.97
    """Discount factor of one control step."""
    gae_lambda: Share = 0.95
    """Decay of generalized advantage estimation (Schulman et al. 2016). PPO only."""
    clip_range: Annotated[float, Field(gt=0)] = 0.2
    """Largest change of the probability ratio that an update rewards. PPO only."""
    action_noise_std: Annotated[float, Field(gt=0)] = 0.6
    """Standard deviation of actions at the start; learned from there on. PPO only."""
    settling_noise_std: Annotated[float, Field(gt=0)] = 3.0
    """Upper limit of the actions' standard deviation when settling begins. PPO only. Our choice, see
    docs/learning.md."""
    final_noise_std: Annotated[float, Field(gt=0)] = 0.2
    """Upper limit of the actions' standard deviation at the end of the budget, see `aidsr.learn.rl.exploration`. PPO
    only."""
    settling: Share = 0.3
    """Last share of the budget, in which the noise of the policy is reduced; 0 keeps the noise. PPO only."""
    entropy_bonus: Annotated[float, Field(ge=0)] = 0.01
    """Weight of the policy's entropy in the objective until settling begins. Without it, noise vanishes where it costs
    progress, and the policy stops improving (docs/learning.md). PPO only; `entropy_weight` is that of SAC."""
    hidden_sizes: Annotated[tuple[Annotated[int, Field(ge=1, le=4096)], ...], Field(max_length=8)] = (64, 64)
    """Hidden layers of the policy and of the value network, which share no parameters."""
    smoothing: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """Share of the previous action that is kept in the next."""
    patience_s: Annotated[float, Field(gt=0)] = 5.0
    """Time without growing progress after which a training episode is truncated, as at its time limit [s]. Nothing is
    learned once nothing happens, and a budget holds only few episodes of a minute."""
    saturation: Share = 0.95
    """Share of development episodes that must succeed without noise for training to end before its budget."""
    randomize: bool = False
    """Whether each training episode differs from the model as a real robot may, see `perturbation.randomized`. An
    addition of this project; the paper trains in the unchanged model."""
    from_probe: bool = False
    """Whether a probe searches for a motion first. PPO begins with imitating it (`aidsr.learn.rl.behavior_cloning`);
    with SAC, the motion becomes the policy if learning does not beat it (`aidsr.learn.rl.fallback_motion`), and budgets
    below `LEAST_SEARCHED` have no search. Set in protocol "best", unless a script replaces the search; the option
    `from_probe` of a user sets it in "paper". An addition of this project; the paper starts without a motion."""
    script: str = ""
    """Motion that the policy corrects, in the notation of `aidsr.learn.openloop.script`; empty for none. With
    `from_probe` it is the motion that learning did not beat. SAC only. Source: residual policy learning, Silver et al.
    2018."""
    correction: Annotated[float, Field(gt=0, le=2)] = 0.3
    """Largest change of the script's action by the policy, in either direction, where actions are -1 to 1. SAC only,
    with a `script`. Our choice."""
    hold_steps: Annotated[int, Field(ge=1)] = 1
    """Control steps for which an action is held, in training and afterwards. Soft bodies filter out faster changes, and
    a policy has fewer decisions to learn; `gamma` is then the discount factor of one held action."""
    updates: Annotated[int, Field(ge=1)] = 8
    """Updates after each step of all simulations. SAC only."""
    target_rate: Annotated[float, Field(gt=0, le=1)] = 0.01
    """Share by which the target value network moves towards the value network in each update. SAC only."""
    entropy_weight: Annotated[float, Field(gt=0)] = 0.05
    """Weight of the policy's entropy at the start; learned from there on. SAC only."""
    random_steps: Annotated[int, Field(ge=1)] = 4_500
    """Largest number of control steps with random actions before learning begins; a training makes fewer if these are
    more than an eighth of its budget, 250 of 2,000. SAC only."""
    noiseless_simulations: Annotated[int, Field(ge=1)] = 8
    """Number of simulations in which the policy acts without noise. Their episodes measure its performance, and it also
    learns from them. SAC only."""
    overlap_penalty: Annotated[float, Field(ge=0)] = 0.0
    """Reward taken for each control step in which parts overlap deeply, which no valid policy does; 0, as with protocol
    "paper": overlap is ignored in training."""
    stop_hopeless: bool = False
    """Whether a training ends as soon as it is hopeless, see `is_hopeless`. SAC only."""

    @model_validator(mode="before")
    @classmethod
    def _of_before(cls, plain: Any) -> Any:
        """Read a recipe of an earlier version, in which PPO could correct a searched motion, if it searched none."""
        if isinstance(plain, dict) and plain.get("search_share") == 0.0:
            return {
                name: value for name, value in plain.items() if name not in ("search_share", "correction_noise_std")
            }
        return plain

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.algorithm == "sac" and self.noiseless_simulations >= self.simulations:
            raise ValueError("no simulation is left to explore in; let fewer be without noise")
        if self.algorithm == "ppo" and self.stop_hopeless:
            raise ValueError("when a training of PPO is hopeless was not measured; use SAC")
        if self.algorithm == "ppo" and self.script:
            raise ValueError("a policy of PPO corrects no script; use SAC")
        return self

    def beginning_with(self, script: str) -> Recipe:
        """Return the recipe of a policy that corrects a script; no other motion is searched.

        With an empty script, return this recipe.
        """
        return self.model_copy(update={"script": script, "from_probe": False}) if script else self

    def searches(self, steps: int) -> bool:
        """Return whether a SAC training with this budget first searches for a motion that the policy has to beat."""
        return self.algorithm == "sac" and self.from_probe and steps >= LEAST_SEARCHED

    def from_nothing(self) -> Recipe:
        """Return the recipe of a policy without a motion to correct or to beat."""
        return self.model_copy(update={"script": "", "from_probe": False})

    def starting_from(self, script: str, own: str) -> Recipe:
        """Return this recipe with the motion that a SAC policy starts from; a PPO recipe stays as it is.

        Args:
            script: The motion; "own" for the design's own, "none" for no motion at all, not even a searched one.
            own: Script of the design's author; "" for none, then this recipe's search for a motion remains.
        """
        if self.algorithm != "sac":
            return self
        return self.from_nothing() if script == "none" else self.beginning_with(own if script == "own" else script)

    def as_asked(self) -> Recipe:
        """Return the recipe as the user requested it, without the motion that a probe found."""
        return self.model_copy(update={"script": ""}) if self.from_probe else self

    def acting_in(self, scene: TaskScene) -> TaskScene:
        """Return the scene as a policy of this recipe acts in it: actions are held, and correct the script if any.

        Raises:
            UserError: The script cannot be read, or names a group or a feature that the scene does not have.
        """
        from aidsr.learn.openloop.script_policy import script_policy

        held = scene.with_hold(self.hold_steps)
        if not self.script:
            return held
        return held.with_base(script_policy(scene, self.script), self.correction)

    def learning_rate_when(self, left: float) -> float:
        """Return the learning rate for the remaining share of the budget, below 0 in a rollout beyond the budget."""
        return self.final_learning_rate + (self.learning_rate - self.final_learning_rate) * max(left, 0.0)


def is_hopeless(algorithm: str, *, has_succeeded: bool, steps: int, budget: int) -> bool:
    """Return whether a training is unlikely to succeed any more.

    It is false for budgets below `LEAST_TELLING`, far below those with which the rule was measured: their policy has
    hardly learned after 70 % of the budget, and may still succeed.

    Args:
        algorithm: Algorithm of its recipe. A PPO training is never hopeless, because the rule was not measured with
            PPO.
        has_succeeded: Whether an episode without noise has succeeded.
        steps: Control steps so far.
        budget: Budget of control steps.
    """
    if algorithm != "sac" or budget < LEAST_TELLING:
        return False
    return not has_succeeded and steps >= HOPELESS_AFTER * budget


PROTOCOLS: Mapping[Protocol, Recipe] = MappingProxyType(
    {
        "paper": Recipe(),
        "best": Recipe(
            algorithm="sac",
            simulations=32,
            hold_steps=3,
            batch_size=256,
            hidden_sizes=(128, 128),
            final_learning_rate=1e-3,
            from_probe=True,
            overlap_penalty=1.0,
        ),
    }
)


NAMED_SCRIPTS = ("own", "none")
"""Names of motions to start from, instead of the text of a script: the design's own, or none; see `starting_from`."""


def recipe_of(
    protocol: Protocol,
    *,
    from_probe: bool = False,
    smoothing: float = 0.0,
    randomize: bool = False,
    stop_hopeless: bool = False,
    script: str = "",
) -> Recipe:
    """Return the recipe of a protocol with the options of a user; `Recipe.starting_from` resolves "own" and "none".

    Raises:
        UserError: There is no such protocol, or the options are not compatible.
    """
    if protocol not in PROTOCOLS:
        raise UserError(f'no protocol "{protocol}"; use {" or ".join(PROTOCOLS)}')
    if from_probe and protocol != "paper":
        raise UserError(
            'from_probe needs protocol "paper"; "best" searches a motion in any case, which the policy has to beat'
        )
    script = "" if script in NAMED_SCRIPTS else script
    if script and protocol != "best":
        raise UserError('a policy that begins with a script needs protocol "best" (--protocol best)')
    if stop_hopeless and protocol != "best":
        raise UserError('stop_hopeless needs protocol "best", with which the rule was measured (--protocol best)')
    recipe = PROTOCOLS[protocol]
    options = {
        "from_probe": from_probe or recipe.from_probe,
        "smoothing": smoothing,
        "randomize": randomize,
        "stop_hopeless": stop_hopeless,
    }
    return recipe.model_copy(update=options).beginning_with(script)
