"""How a policy is trained: one set of numbers for all tasks and bodies, and what a user may add."""

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
"""Part of the budget without a single success of the policy without noise, after which a training of SAC is hopeless.
Our choice, measured in benchmarks/learning."""


LEAST_SEARCHED = 10_000
"""Control steps of a training before which no motion is searched. Our choice: the search takes as many itself."""


class Recipe(Artifact):
    """PPO (Schulman et al. 2017) or SAC (Haarnoja et al. 2018) of Stable-Baselines3 on batched simulations.

    The defaults are those of PPO. Source: our choice, measured on an arm and a crawler (docs/learning.md): many
    simulations with short rollouts and a high learning rate learn several times faster from the same physics than the
    usual long rollouts.
    """

    algorithm: Literal["ppo", "sac"] = "ppo"
    simulations: Annotated[int, Field(ge=1)] = 64
    """Side by side."""
    rollout_steps: Annotated[int, Field(ge=1)] = 8
    """Control steps of each simulation between two updates."""
    batch_size: Annotated[int, Field(ge=2)] = 128
    epochs: Annotated[int, Field(ge=1)] = 10
    learning_rate: Annotated[float, Field(gt=0)] = 1e-3
    """At the start."""
    final_learning_rate: Annotated[float, Field(gt=0)] = 1e-4
    """At the end of the budget; it falls evenly, so that the policy that is kept is not one of many that come by."""
    gamma: Share = 0.97
    """Discount of one control step."""
    gae_lambda: Share = 0.95
    clip_range: Annotated[float, Field(gt=0)] = 0.2
    action_noise_std: Annotated[float, Field(gt=0)] = 0.6
    """Standard deviation of actions at the start; learned from there."""
    settling_noise_std: Annotated[float, Field(gt=0)] = 3.0
    """Largest standard deviation that is left to actions when settling begins. Our choice, see docs/learning.md."""
    final_noise_std: Annotated[float, Field(gt=0)] = 0.2
    """The same at the end of the budget, see `aidsr.learn.rl.exploration`."""
    settling: Share = 0.3
    """Part of the budget, at its end, in which noise is taken from the policy; 0 leaves it."""
    entropy_bonus: Annotated[float, Field(ge=0)] = 0.01
    """Weight of the policy's entropy in what is maximised, until the policy settles. Without it noise dies where it
    costs progress, and the policy stays where it has come to (docs/learning.md)."""
    hidden_sizes: Annotated[tuple[Annotated[int, Field(ge=1, le=4096)], ...], Field(max_length=8)] = (64, 64)
    """Of policy and of value, which share nothing."""
    smoothing: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """Share of the previous action that is kept in the next."""
    patience_s: Annotated[float, Field(gt=0)] = 5.0
    """A training episode is cut short, as at its time limit, when its progress has not grown for this long. Where
    nothing happens any more nothing is learned, and a budget holds few episodes of a minute."""
    saturation: Share = 0.95
    """Share of development episodes that succeed without noise when training ends before its budget."""
    randomize: bool = False
    """Whether each training episode differs from the model as a real robot may, see `perturbation.randomized`. Ours;
    the paper trains in the model."""
    from_probe: bool = False
    """Whether a probe searches a motion first. PPO begins with it (`aidsr.learn.rl.behavior_cloning`); with SAC it is
    the policy where learning does not beat it (`aidsr.learn.rl.rival_motion`). Ours; the paper starts from nothing."""
    script: str = ""
    """Motion that the policy corrects, in the notation of `aidsr.learn.openloop.script`; without one it begins with
    nothing. With `from_probe` it is the motion that was not beaten. SAC only. Source: residual policy learning, Silver
    et al. 2018."""
    correction: Annotated[float, Field(gt=0, le=2)] = 0.3
    """By how much the policy can change the action of the script, -1 to 1, either way. Our choice."""
    hold_steps: Annotated[int, Field(ge=1)] = 1
    """Control steps for which an action is held, in training and afterwards. Soft bodies filter out what changes
    faster, and a policy has fewer decisions to learn; `gamma` is then the discount of one held action."""
    updates: Annotated[int, Field(ge=1)] = 8
    """SAC only, as all below: updates after each step of all simulations."""
    target_rate: Annotated[float, Field(gt=0, le=1)] = 0.01
    """Share by which the target of the value moves with each update."""
    entropy_weight: Annotated[float, Field(gt=0)] = 0.05
    """Weight of the policy's entropy at the start; learned from there."""
    random_steps: Annotated[int, Field(ge=1)] = 4_500
    """Control steps of random actions before anything is learned, an eighth of the budget at most."""
    noiseless_simulations: Annotated[int, Field(ge=1)] = 8
    """Simulations in which the policy acts without noise. Their episodes tell how far it has come, and it learns from
    them as from the others."""
    stop_hopeless: bool = False
    """Whether a training ends where it is hopeless, see `is_hopeless`."""

    @model_validator(mode="before")
    @classmethod
    def _of_before(cls, plain: Any) -> Any:
        """Read a recipe of before, when PPO could correct a motion found by a search, if nothing was searched."""
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

        With an empty script it is this recipe.
        """
        return self.model_copy(update={"script": script, "from_probe": False}) if script else self

    def searches(self, steps: int) -> bool:
        """Return whether a motion is searched that a policy of SAC with this budget has to beat."""
        return self.algorithm == "sac" and self.from_probe and steps >= LEAST_SEARCHED

    def from_nothing(self) -> Recipe:
        """Return the recipe of a policy that has no motion, neither to correct nor to beat."""
        return self.model_copy(update={"script": "", "from_probe": False})

    def as_asked(self) -> Recipe:
        """Return the recipe without what a probe found."""
        return self.model_copy(update={"script": ""}) if self.from_probe else self

    def acting_in(self, scene: TaskScene) -> TaskScene:
        """Return the scene as a policy of this recipe acts in it: actions are held, and correct the script if any.

        Raises:
            UserError: The script cannot be read, or names a group that the scene does not have.
        """
        from aidsr.learn.openloop.script import parse_script

        held = scene.with_hold(self.hold_steps)
        if not self.script:
            return held
        names = [group.name for group in scene.actions.groups]
        played = parse_script(self.script).played_by(names, scene.actions.rest, scene.task.control_dt_s)
        return held.with_base(played, self.correction)

    def learning_rate_when(self, left: float) -> float:
        """Return the learning rate when a share of the budget is left; a last rollout goes beyond it, to below 0."""
        return self.final_learning_rate + (self.learning_rate - self.final_learning_rate) * max(left, 0.0)


def is_hopeless(algorithm: str, *, has_won: bool, steps: int, budget: int) -> bool:
    """Return whether a training will hardly succeed any more.

    Args:
        algorithm: Of its recipe. With PPO, nothing is hopeless: the rule was not measured there.
        has_won: Whether an episode without noise has succeeded.
        steps: Control steps so far.
        budget: Of control steps.
    """
    return algorithm == "sac" and not has_won and steps >= HOPELESS_AFTER * budget


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
        ),
    }
)


def recipe_of(
    protocol: Protocol,
    *,
    from_probe: bool = False,
    smoothing: float = 0.0,
    randomize: bool = False,
    stop_hopeless: bool = False,
    script: str = "",
) -> Recipe:
    """Return the recipe of a protocol with the options of a user.

    Raises:
        UserError: There is no such protocol, or the options do not go together.
    """
    if protocol not in PROTOCOLS:
        raise UserError(f'no protocol "{protocol}"; use {" or ".join(PROTOCOLS)}')
    if from_probe and protocol != "paper":
        raise UserError(
            'from_probe needs protocol "paper"; "best" searches a motion in any case, which the policy has to beat'
        )
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
