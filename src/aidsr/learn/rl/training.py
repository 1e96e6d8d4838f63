"""Training of one policy on batched simulations, stored in a folder and resumed where it stopped."""

from __future__ import annotations

import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from aidsr.core.config import BUDGET_STEPS
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.overlap_meter import rollout_without_overlap
from aidsr.learn.episodes.perturbation import randomized
from aidsr.learn.episodes.rollout import EpisodeOutcomes, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.behavior_cloning import clone_probe_motion
from aidsr.learn.rl.fallback_motion import is_clearly_better, record_fallback_motion
from aidsr.learn.rl.policy import Normalisation, TrainedPolicy, network_options, one_torch_thread
from aidsr.learn.rl.recipe import Recipe
from aidsr.learn.rl.training_config import Stopped, TrainingConfig
from aidsr.learn.rl.training_folder import (
    CONFIG_FILE,
    NORMALISATION_FILE,
    POLICY_FILE,
    PROBE_FILE,
    RESULT_FILE,
    SCENE_FILE,
    TrainingFolder,
    TrainingResult,
)
from aidsr.sim.structure import read_structure
from aidsr.tasks import Variation

if TYPE_CHECKING:
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecNormalize

    from aidsr.learn.rl.curve_point import CurvePoint
    from aidsr.learn.rl.snapshot import Snapshot
    from aidsr.learn.rl.soft_actor_critic import SoftActorCritic

DEVELOPMENT = 2**31
"""Number of development variations to sample from: so many that a policy learns the task, not a few scenes. Those from
this index on are never sampled."""

_TEST_EPISODES = 20
"""Number of development episodes that test whether training is saturated and which policy is kept."""


def train(
    scene: TaskScene,
    folder: Path,
    *,
    steps: int = BUDGET_STEPS,
    seed: int = 0,
    recipe: Recipe | None = None,
    minutes: float | None = None,
    threads: int = 0,
    tensorboard: bool = False,
    listen: Callable[[CurvePoint], None] = lambda _point: None,
) -> TrainingResult:
    """Train a policy, or resume where an earlier call with the same folder stopped.

    Args:
        scene: Scene to train in.
        folder: Path that becomes the training's folder, see `TrainingFolder`.
        steps: Budget of control steps over all simulations; training ends earlier when success is saturated.
        seed: Seed of the network, of exploration and of the variations.
        recipe: Hyperparameters; those of the paper by default.
        minutes: Additional budget of wall time [min], without evaluation.
        threads: Native threads for physics; 0 takes all processors.
        tensorboard: Whether to write logs for TensorBoard into the folder as well.
        listen: Called with every point of the learning curve.

    Raises:
        FolderInUseError: The folder holds another training, or another process trains in it.
        UserError: The folder holds a training of an earlier version, or the recipe's script does not fit this scene.
    """
    home = TrainingFolder(folder)
    config = TrainingConfig.of(scene, steps=steps, seed=seed, recipe=recipe, minutes=minutes)
    if (finished := home.finished(config)) is not None:
        return finished
    config.recipe.acting_in(scene)  # raises an error for an invalid script before anything is written
    with home.locked(), one_torch_thread():
        if (finished := home.finished(config)) is not None:  # another process has just finished it
            return finished
        if (home / CONFIG_FILE).exists():
            home.log_event("resumed", versions=config.versions)
            config = home.read(CONFIG_FILE, TrainingConfig)
        else:
            home.write(SCENE_FILE, scene.mjcf)
            home.write(CONFIG_FILE, config.model_dump_json(indent=2) + "\n")
            home.log_event("started")
        if config.recipe.searches(config.steps) and not (home / PROBE_FILE).exists():
            config = record_fallback_motion(home, scene, config, threads)
        training = _Training(config.recipe.acting_in(scene), home, config, threads, tensorboard, listen)
        if config.beaten is None:
            stopped = training.run()
            if not training.needs_fallback(stopped):
                return training.finish(stopped)
            home.log_event("beaten", success_share=training.share, motion_share=config.motion_share)
            training.checkpoint()  # counts of learning, also if the process is killed from here on
            config = config.with_the_motion().model_copy(update={"beaten": stopped})
            home.write(CONFIG_FILE, config.model_dump_json(indent=2) + "\n")
            training = _Training(config.recipe.acting_in(scene), home, config, threads, tensorboard, listen)
        training.play_fallback()
        assert config.beaten is not None
        return training.finish(config.beaten)


class _Training:
    """State of one call of `train`; it is loaded from the checkpoint if there is one, unless a motion beat it."""

    def __init__(
        self,
        scene: TaskScene,
        home: TrainingFolder,
        config: TrainingConfig,
        threads: int,
        tensorboard: bool,
        listen: Callable[[CurvePoint], None] = lambda _point: None,
    ) -> None:
        from stable_baselines3.common.vec_env import VecNormalize

        from aidsr.learn.rl.callbacks import History
        from aidsr.learn.rl.vector_env import BatchedVecEnv

        self.scene, self.home = scene, home
        self.config, self.threads, self.listen = config, threads, listen
        self.most_s = np.inf if config.minutes is None else 60.0 * config.minutes
        recipe, self._resumed = config.recipe, home.recover_folder("checkpoint") and config.beaten is None
        self.history = History.of(recipe)
        if self._resumed:
            self.history = History.from_json(home.read_json("checkpoint/history.json"), recipe)
        # a resumed training must not sample the same episodes again
        self.rng = np.random.default_rng([config.seed, self.history.steps])
        self._best: Snapshot | None = None
        self._structure = read_structure(scene.model)
        first = [self._sample_variation() for _ in range(recipe.simulations)]
        self.env = BatchedVecEnv(
            self._episodes(first),
            self._sample_variation,
            patience_s=recipe.patience_s,
            overlap_penalty=recipe.overlap_penalty,
        )
        self.normalised: VecNormalize = VecNormalize(
            self.env, gamma=recipe.gamma, norm_reward=recipe.algorithm == "ppo"
        )
        self.model = self._make_model(str(home / "tensorboard") if tensorboard else None)
        if self._resumed:
            self._load(home / "checkpoint")

    def _load(self, saved: Path) -> None:
        """Restore the state that `_save` wrote, except the history."""
        from aidsr.learn.rl.snapshot import Snapshot
        from aidsr.learn.rl.soft_actor_critic import SoftActorCritic

        self.history.resumed += 1
        Normalisation.from_json((saved / NORMALISATION_FILE).read_text("utf-8")).restore(self.normalised)
        self.model.set_parameters(str(saved / POLICY_FILE), device="cpu")
        self.model.num_timesteps = self.history.steps // self.config.recipe.hold_steps
        if isinstance(self.model, SoftActorCritic):
            self.model.load_replay_buffer_from(saved / "memory")
        self._best = Snapshot.load(saved / "best")

    def _sample_variation(self) -> Variation:
        index = int(self.rng.integers(DEVELOPMENT))
        if self.config.recipe.randomize:
            return randomized(self.scene.task, self._structure, index)
        return self.scene.task.variation("development", index)

    def _episodes(self, variations: list[Variation]) -> Episodes:
        scene, smoothing = self.scene, self.config.recipe.smoothing
        return Episodes(scene.model, scene.task, scene.actions, variations, threads=self.threads, smoothing=smoothing)

    def _make_model(self, tensorboard: str | None) -> PPO | SoftActorCritic:
        from stable_baselines3 import PPO

        from aidsr.learn.rl.soft_actor_critic import SoftActorCritic

        recipe, seed = self.config.recipe, int(self.rng.integers(2**31))
        if recipe.algorithm == "sac":
            return SoftActorCritic.of(recipe, self.normalised, self.config.steps, seed, tensorboard)
        return PPO(
            "MlpPolicy",
            self.normalised,
            n_steps=recipe.rollout_steps,
            batch_size=recipe.batch_size,
            n_epochs=recipe.epochs,
            learning_rate=recipe.learning_rate_when,
            gamma=recipe.gamma,
            gae_lambda=recipe.gae_lambda,
            clip_range=recipe.clip_range,
            ent_coef=recipe.entropy_bonus,
            policy_kwargs=dict(network_options(recipe)),
            tensorboard_log=tensorboard,
            seed=seed,
            device="cpu",
        )

    def _begin(self) -> None:
        """Start a training that has no checkpoint yet: PPO may first imitate a motion."""
        if self.config.recipe.from_probe and self.config.recipe.algorithm == "ppo":
            self._imitate_probe()
        else:
            self.history.wall_s = self.config.probe_s

    def _imitate_probe(self) -> None:
        """Imitate the best motion of a probe, as part of the budget."""
        from stable_baselines3 import PPO

        assert isinstance(self.model, PPO)  # only called for a recipe of PPO
        began, seed = time.perf_counter(), int(self.rng.integers(2**31))
        asked = {"steps": self.config.steps, "seed": seed, "threads": self.threads}
        report, steps = clone_probe_motion(self.scene, self.model, self.normalised, **asked)
        self.home.write(PROBE_FILE, report.model_dump_json(indent=2) + "\n")
        self.history.steps, self.history.wall_s = steps, time.perf_counter() - began
        self.model.num_timesteps = steps
        self.home.log_event("probed", steps=steps, ended=report.best.episode.ended, motion=report.best.motion.summary)

    def run(self) -> Stopped:
        """Train to the end of the budget or until the policy is saturated, and return why training ended."""
        from aidsr.learn.rl.callbacks import TrainingCallback
        from aidsr.learn.rl.exploration import Exploration

        recipe, history = self.config.recipe, self.history
        if not self._resumed:
            self._begin()
        callback = TrainingCallback(
            history,
            recipe,
            self.config.steps,
            self.home,
            checkpoint=self.checkpoint,
            saturated=self._saturated,
            improved=self._keep_best,
            listen=self.listen,
            begin=lambda: self.env.desynchronize(self.rng),
            most_s=self.most_s,
        )
        if recipe.script and not history.steps:
            self._test_script()
            if self._suffices(history.success_share):
                return "saturated"
        if recipe.script and recipe.from_probe:  # where a searched motion is the policy, nothing is learned
            return "saturated"
        left = (self.config.steps - history.steps) // recipe.hold_steps
        exploration = [Exploration(recipe)] if recipe.algorithm == "ppo" else []
        try:
            if left > 0 and history.wall_s < self.most_s:
                self.model.learn(left, callback=[*exploration, callback], reset_num_timesteps=False)
        except KeyboardInterrupt:
            self.checkpoint()
            raise
        if callback.is_saturated:
            return "saturated"
        if callback.is_hopeless:
            return "hopeless"
        self._keep_better()
        return "time" if history.wall_s >= self.most_s else "budget"

    def _keep_better(self) -> None:
        """Keep the last policy, or the best snapshot if that succeeds in more of the same new variations.

        The success share reported for the training is the one in these variations, because the largest of many earlier
        shares is biased upwards.
        """
        from aidsr.learn.rl.snapshot import Snapshot

        if self.config.recipe.algorithm == "ppo" or not self.history.won:
            return
        variations = self._fresh_variations()
        kept = self._test(variations)
        if self._best is not None:
            last = Snapshot.of(self.model.policy, self.normalised)
            self._best.restore(self.model.policy, self.normalised)
            best = self._test(variations)
            shares = {"success_share": float(kept.success.mean()), "best": float(best.success.mean())}
            if shares["best"] > shares["success_share"]:
                self.home.log_event("restored", **shares)
                kept = best
            else:
                last.restore(self.model.policy, self.normalised)
        self._report(kept)

    def _report(self, course: EpisodeOutcomes) -> None:
        """Report the success of these episodes, as a point of the learning curve."""
        from aidsr.learn.rl.callbacks import append_to_curve

        history = self.history
        history.recent.clear()
        for row in range(_TEST_EPISODES):
            history.count_outcome(course, row)
        point = history.point(history.steps / max(history.wall_s, 1e-9))
        append_to_curve(self.home, point)
        self.listen(point)

    def needs_fallback(self, stopped: Stopped) -> bool:
        """Return whether the searched motion succeeds more often than the learned policy, by more than chance.

        Both were tested in new variations, unless the policy never succeeded.
        """
        if not self.config.motion or stopped == "saturated":
            return False
        return is_clearly_better(self.config.motion_share, self.share)

    @property
    def share(self) -> float:
        """Share of new variations in which the policy succeeded at the end; 0 if it never succeeded."""
        return self.history.success_share if self.history.won else 0.0

    def play_fallback(self) -> None:
        """Test the policy that plays the searched motion unchanged, and add the result to the counts of learning."""
        from aidsr.learn.rl.callbacks import History

        learned = History.from_json(self.home.read_json("checkpoint/history.json"), self.config.recipe)
        self.history = replace(learned, recent=deque(maxlen=learned.recent.maxlen))
        self.model.num_timesteps = learned.steps // self.config.recipe.hold_steps
        self._test_script()

    def _keep_best(self) -> None:
        from aidsr.learn.rl.snapshot import Snapshot

        self._best = Snapshot.of(self.model.policy, self.normalised)

    def _saturated(self) -> bool:
        """Return whether the policy without noise succeeds in new development variations."""
        is_saturated = self._suffices(float(self._test(self._fresh_variations()).success.mean()))
        # the last step, still to be taken, must not change the tested normalisation
        self.normalised.training = not is_saturated
        return is_saturated

    def _suffices(self, share: float) -> bool:
        """Return whether a policy with this success share needs no more training."""
        return share >= self.config.recipe.saturation

    def _fresh_variations(self) -> list[Variation]:
        return [self._sample_variation() for _ in range(_TEST_EPISODES)]

    def _test(self, variations: list[Variation]) -> EpisodeOutcomes:
        """Evaluate the policy, charge the steps to the budget, log the test, and return the outcomes."""
        course = self._evaluate(variations)
        self._charge(course)
        self.home.log_event("tested", steps=self.history.steps, success_share=float(course.success.mean()))
        return course

    def _evaluate(self, variations: list[Variation]) -> EpisodeOutcomes:
        """Play variations with the policy, without noise; if deep overlap is penalized, it is no success."""
        policy = TrainedPolicy.of(self.model.policy, Normalisation.of(self.normalised))
        self.model.policy.set_training_mode(False)
        play = rollout_without_overlap if self.config.recipe.overlap_penalty else rollout
        return play(self._episodes(variations), policy)

    def _charge(self, course: EpisodeOutcomes) -> None:
        """Count the steps of tests towards the budget of SAC; the paper's PPO does not pay for them."""
        if self.config.recipe.algorithm == "sac":
            action_s = self.scene.task.control_dt_s * self.config.recipe.hold_steps
            self.model.num_timesteps += round(float(course.time_s.sum()) / action_s)

    def _test_script(self) -> None:
        """Test the script before anything is learned; it is the policy to return to when learning makes it worse."""
        from aidsr.learn.rl.soft_actor_critic import SoftActorCritic

        history, began = self.history, time.perf_counter()
        course = self._test(self._fresh_variations())
        assert isinstance(self.model, SoftActorCritic)  # a recipe with a script is always SAC
        self.model.learning_starts += self.model.num_timesteps  # nothing was learned in these steps
        history.wall_s += time.perf_counter() - began
        history.steps = self.model.num_timesteps * self.config.recipe.hold_steps
        self._report(course)
        history.best_share = history.success_share
        self._keep_best()

    def checkpoint(self) -> None:
        """Save the state from which another process can go on."""
        with self._saved() as saved:
            self.home.replace_folder("checkpoint", saved)
        self.home.log_event("checkpoint", steps=self.history.steps)

    @contextmanager
    def _saved(self) -> Iterator[Path]:
        """Save the state in a temporary folder, and return the folder."""
        with tempfile.TemporaryDirectory(dir=self.home.path, prefix=".checkpoint-") as made:
            self._save(Path(made) / "checkpoint")
            yield Path(made) / "checkpoint"

    def _save(self, folder: Path) -> None:
        from aidsr.learn.rl.soft_actor_critic import SoftActorCritic

        saved = TrainingFolder(folder)
        saved.write(NORMALISATION_FILE, Normalisation.of(self.normalised).to_json())
        saved.write_json("history.json", self.history.to_json())
        self.model.save(folder / POLICY_FILE, exclude=["ep_info_buffer", "ep_success_buffer"])
        if isinstance(self.model, SoftActorCritic):
            self.model.save_replay_buffer_to(folder / "memory")
        if self._best is not None:
            self._best.save(folder / "best")

    def finish(self, stopped: Stopped) -> TrainingResult:
        """Write the policy and the result of its training, and return the result."""
        history = self.history
        result = TrainingResult(
            steps=history.steps,
            wall_s=round(history.wall_s, 2),
            episodes=history.episodes,
            diverged_episodes=history.diverged,
            success_share=history.success_share if history.recent else None,
            stopped=stopped,
            resumed=history.resumed,
        )
        if self.config.beaten is None:
            self.checkpoint()
            self._publish(self.home / "checkpoint")
        else:  # the checkpoint keeps the counts of the learning, which another process would need
            with self._saved() as saved:
                self._publish(saved)
        self.home.write(RESULT_FILE, result.model_dump_json(indent=2) + "\n")
        self.home.log_event("finished", **result.model_dump(mode="json"))
        self.home.remove_folder("checkpoint")
        return result

    def _publish(self, saved: Path) -> None:
        """Copy the policy from a saved state into the training's folder."""
        for name in (NORMALISATION_FILE, POLICY_FILE):
            self.home.write(name, (saved / name).read_bytes())
