"""A finished training on disk: load it, evaluate it, and store the verdict in its folder."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Self

from aidsr.core.artifacts import Evaluation
from aidsr.core.config import VERDICT_EPISODES
from aidsr.core.errors import UserError
from aidsr.core.plain_tree import require_plain_tree
from aidsr.learn.episodes.policy_checks import EvaluationPoint, EvaluationRollout
from aidsr.learn.episodes.scene import TaskScene, read_mjcf_text
from aidsr.learn.rl.evaluation import evaluate
from aidsr.learn.rl.policy import TrainedPolicy, one_torch_thread
from aidsr.learn.rl.robustness import perturbed_episodes
from aidsr.learn.rl.training_config import TrainingConfig
from aidsr.learn.rl.training_folder import (
    CONFIG_FILE,
    CURVE_FILE,
    EVALUATION_FILE,
    RESULT_FILE,
    SCENE_FILE,
    TrainingFolder,
    TrainingResult,
)
from aidsr.tasks import BENCHMARK_VERSION, Level, Split, goal_task, is_current, load_task
from aidsr.tasks.goals import GOAL_VERSION
from aidsr.tasks.task import edit_environment


@dataclass(frozen=True)
class FinishedTraining:
    """A training that has ended, with its scene and policy."""

    folder: TrainingFolder
    config: TrainingConfig
    result: TrainingResult
    scene: TaskScene
    policy: TrainedPolicy

    @classmethod
    def load(cls, folder: Path) -> Self:
        """Return the training in a folder.

        Raises:
            UserError: There is none, it is not finished, an earlier version made it, or its task or scene has changed
                since.
        """
        require_plain_tree(folder)
        home = TrainingFolder(folder)
        try:
            config = home.read(CONFIG_FILE, TrainingConfig)
            result = home.read(RESULT_FILE, TrainingResult)
        except FileNotFoundError as error:
            missing = Path(error.filename).name
            trainings = sorted((*folder.glob("training/*/training.json"), *folder.glob("*/training.json")))
            advice = (
                f"Name one of its trainings: {trainings[-1].parent}" if trainings else "Train first, with aidsr train"
            )
            raise UserError(f"{folder} is not a finished training: {missing} not found. {advice}") from None
        except NotADirectoryError:
            raise UserError(f"{folder} is a file; give the folder of a finished training, as …/training/001") from None
        _check_version(folder, config)
        scene = TaskScene.of(
            folder / SCENE_FILE,
            goal_task(config.goal, read_mjcf_text(folder / SCENE_FILE)) if config.goal else config.task,
            level=config.level,
            grouping="off",
        ).with_actions(config.groups, config.groups_from)
        _check_scene(folder, config, scene)
        policy = TrainedPolicy.load(folder, config.recipe, scene.actions.size)
        return cls(home, config, result, config.recipe.acting_in(scene), policy)

    def scene_at(self, level: Level) -> TaskScene:
        """Return the scene with the environment of another level of the task.

        Raises:
            UserError: The task has no such level.
        """
        if self.config.goal is not None:
            raise UserError(f"a goal of your own has no level {level}; evaluate it without a level")
        task = load_task(self.config.task, level)
        scene = TaskScene.of(edit_environment(self.scene.mjcf, task.edits), task, grouping="off")
        return self.config.recipe.acting_in(scene.with_actions(self.config.groups, self.config.groups_from))


def _check_version(folder: Path, config: TrainingConfig) -> None:
    """Refuse to evaluate a policy on another task than it was trained for, before its scene is loaded.

    Raises:
        UserError: The benchmark, or the measurement of a user-defined goal, has changed since.
    """
    if config.goal is not None and config.goal_version != GOAL_VERSION:
        raise UserError(
            f"the policy in {folder} was trained for goals as an earlier version measured them; train it again, with "
            "aidsr train"
        )
    if config.goal is None and not is_current(config.task, config.benchmark_version):
        raise UserError(
            f"the policy in {folder} is of version {config.benchmark_version} of the benchmark, not "
            f"{BENCHMARK_VERSION}; train it again"
        )


def _check_scene(folder: Path, config: TrainingConfig, scene: TaskScene) -> None:
    """Refuse to evaluate a policy in another scene than the one it was trained in.

    Raises:
        UserError: The file has changed since.
    """
    if scene.fingerprint != config.scene_sha256:
        raise UserError(f"{folder / 'scene.xml'} has changed since the training; restore it, or train again")


def evaluate_training(
    folder: Path,
    *,
    episodes: int = VERDICT_EPISODES,
    level: Level | None = None,
    split: Split = "held_out",
    threads: int = 0,
    videos: bool = True,
    perturbed: bool | Literal["successful"] = False,
    listen: Callable[[EvaluationPoint], None] = lambda _point: None,
) -> Evaluation:
    """Evaluate a finished training; write verdict, curve, two recordings and videos into its folder.

    The verdict is on held-out variations at the level of the training. Any other evaluation goes into a file of its
    own, without pictures: evaluation_hard.json, evaluation_development.json. A verdict of the same policy that is there
    keeps its episodes with perturbations if it has as many episodes, and is not replaced by one with fewer.

    Args:
        folder: Folder of the training.
        episodes: Number of variations.
        level: Another level of its task.
        split: Another split of the variations.
        threads: Native threads; 0 takes all processors.
        videos: Whether to render the best and the median episode, if OpenGL is available.
        perturbed: Whether to play the same variations with each kind of perturbation as well; "successful" only if the
            verdict is success.
        listen: Called after every control step of the episodes.

    Raises:
        FolderInUseError: Another process trains, evaluates or renders in the folder.
        UserError: The folder holds no finished training, or a verdict of more episodes, or its task has no such level.
    """
    training = FinishedTraining.load(folder)
    level = level or training.config.level
    scene = training.scene if level == training.config.level else training.scene_at(level)
    other = [level] * (level != training.config.level) + [split] * (split != "held_out")
    before = None if other else _verdict_before(training, episodes)
    # the lock shows others that the verdict is in progress
    with one_torch_thread(), nullcontext() if other else training.folder.locked():
        evaluation, rolled = evaluate(
            scene,
            training.policy,
            episodes=episodes,
            threads=threads,
            smoothing=training.config.recipe.smoothing,
            training=training.result,
            split=split,
            listen=listen,
        )
        if evaluation.successful if perturbed == "successful" else perturbed:
            robustness = perturbed_episodes(
                scene,
                training.policy,
                evaluation,
                threads=threads,
                smoothing=training.config.recipe.smoothing,
            )
            evaluation = evaluation.model_copy(update={"perturbed": robustness})
        elif before is not None:
            evaluation = evaluation.model_copy(update={"perturbed": before.perturbed})
        written = evaluation.model_dump_json(indent=2) + "\n"
        if other:
            training.folder.write("_".join(["evaluation", *other]) + ".json", written)
            return evaluation
        _write_pictures(training, rolled)
        # a verdict means that everything is there except videos, which may take minutes and fail
        training.folder.write(EVALUATION_FILE, written)
        training.folder.log_event("evaluated", success_share=evaluation.success_share, valid=evaluation.valid)
        if videos:
            _write_films(training, rolled)
    return evaluation


def _verdict_before(training: FinishedTraining, episodes: int) -> Evaluation | None:
    """Return the verdict in a training's folder if it is of the same policy and number of episodes, otherwise None.

    Raises:
        UserError: The verdict there is of the same policy and has more episodes.
    """
    try:
        before = training.folder.read(EVALUATION_FILE, Evaluation)
    except (FileNotFoundError, UserError):  # none, or one of another version, which is replaced
        return None
    now = (training.scene.fingerprint, training.policy.fingerprint)
    if (before.scene_sha256, before.policy_sha256) != now:
        return None
    if len(before.episodes) > episodes:
        count = len(before.episodes)
        raise UserError(
            f"{training.folder / 'evaluation.json'} has a verdict of {count} episodes, and {episodes} are fewer; ask "
            f"for at least {count}, or remove the file"
        )
    return before if len(before.episodes) == episodes else None


def _write_pictures(training: FinishedTraining, rolled: EvaluationRollout) -> None:
    """Write the learning curve, and the best and the median episode as recordings."""
    from aidsr.learn.rl.pictures import curve_picture, episode_recordings

    home = training.folder
    if (home / CURVE_FILE).exists():  # behavior cloning may have used up the budget
        home.write("curve.png", curve_picture(home / CURVE_FILE))
    scene = training.scene
    for name, motion in episode_recordings(scene.mjcf, rolled, scene.task.control_dt_s).items():
        home.write(f"{name}.npz", motion)


def _write_films(training: FinishedTraining, rolled: EvaluationRollout) -> None:
    from aidsr.learn.rl.pictures import episode_videos

    scene = training.scene
    for name, film in episode_videos(scene.mjcf, rolled, scene.task.control_dt_s).items():
        training.folder.write(f"{name}.mp4", film)
