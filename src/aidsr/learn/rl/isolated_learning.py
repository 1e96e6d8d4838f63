"""Training and evaluation of a scene in a child process with limits.

The scene is passed to the child as text. The results are written to the training's folder, the only place where the
child may change files.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Literal

from aidsr.core.artifacts import ActuatorGroup, Evaluation, Placement, Robot
from aidsr.learn.episodes.actions import Grouping
from aidsr.learn.episodes.policy_checks import EvaluationPoint
from aidsr.learn.rl.curve_point import CurvePoint
from aidsr.learn.rl.recipe import Recipe
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tasks import Level, Split
from aidsr.tasks.travelling_task import TravellingTask

_LIMITS = Limits(wall_s=14_400.0, cpu_s=math.inf, memory_mib=16_384, grace_s=60.0)
"""Limits of a training. Our choice: four hours to the next point of the curve, of which there are a hundred; torch
alone maps several GiB; a minute to save a checkpoint."""
_EVALUATION_LIMITS = Limits(wall_s=14_400.0, cpu_s=math.inf, memory_mib=16_384)
"""Limits of an evaluation. Our choice: many times what a thousand episodes and their videos take."""
_TORCH = ("aidsr.learn.rl.training", "aidsr.learn.rl.callbacks", "aidsr.learn.rl.trained")


@isolated
def describe_actions(
    scene: str, task: TravellingTask, level: Level, groups: tuple[ActuatorGroup, ...], grouping: Grouping
) -> str:
    """Return in words how many actuators of a scene are driven by how many numbers of an action.

    Raises:
        UserError: There is no such task, or the scene does not belong to it.
        MjcfError: The scene cannot be loaded.
    """
    from aidsr.learn.episodes.scene import TaskScene

    found = TaskScene.of(scene, task, level=level, groups=groups, grouping=grouping)
    return f"{found.task.name}: {len(found.actions.actuators)} actuators in {found.actions.size} actions"


def run_training(
    scene: str,
    task: TravellingTask,
    level: Level,
    groups: tuple[ActuatorGroup, ...],
    grouping: Grouping,
    home: Path,
    number: str,
    steps: int,
    seed: int,
    recipe: Recipe,
    minutes: float | None,
    threads: int,
    tensorboard: bool,
    again: bool,
    listen: Callable[[CurvePoint], None],
) -> Path:
    """Train a policy in this process and return its folder, see `aidsr.api.train_policy`.

    Args:
        scene: MJCF of the scene.
        task: A task or its name.
        level: Level of a task given by name.
        groups: Actuators that act together.
        grouping: Whether actuators are grouped, see `map_actions`.
        home: Existing folder of the trainings.
        number: Name of the training's folder; if empty, the last folder that holds this training, else the next one.
        steps: Budget of control steps.
        seed: Seed of the training.
        recipe: Hyperparameters of the training.
        minutes: Maximum wall time [min], None for no limit.
        threads: Native threads; 0 takes all processors.
        tensorboard: Whether to write logs for TensorBoard.
        again: Whether to train again in a new folder even if this training already exists.
        listen: Called with every point of the learning curve.

    Raises:
        FolderInUseError: Another process works on the same training.
    """
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.learn.rl import training
    from aidsr.learn.rl.training_config import TrainingConfig
    from aidsr.learn.rl.training_folder import FolderInUseError, folder_for

    found = TaskScene.of(scene, task, level=level, groups=groups, grouping=grouping)
    train = partial(
        training.train,
        found,
        steps=steps,
        seed=seed,
        recipe=recipe,
        minutes=minutes,
        threads=threads,
        tensorboard=tensorboard,
        listen=listen,
    )
    if number:
        train(home / number)
        return home / number
    config = TrainingConfig.of(found, steps=steps, seed=seed, recipe=recipe, minutes=minutes)
    next_folder = partial(folder_for, home, config, again=again)
    folder = next_folder()
    while True:
        try:
            train(folder)
        except FolderInUseError:
            taken, folder = folder, next_folder()
            if folder == taken:
                raise
        else:
            return folder


train_in_child = isolated(limits=_LIMITS, prepare=_TORCH)(run_training)


@isolated(limits=_EVALUATION_LIMITS, prepare=(*_TORCH, "aidsr.learn.rl.pictures", "aidsr.core.provenance:commit"))
def run_evaluation(
    folder: Path,
    episodes: int,
    level: Level | None,
    split: Split,
    threads: int,
    videos: bool,
    perturbed: bool | Literal["successful"],
    listen: Callable[[EvaluationPoint], None],
) -> Evaluation:
    """Evaluate a finished training, see `aidsr.learn.rl.trained.evaluate_training`."""
    from aidsr.learn.rl.trained import evaluate_training

    return evaluate_training(
        folder,
        episodes=episodes,
        level=level,
        split=split,
        threads=threads,
        videos=videos,
        perturbed=perturbed,
        listen=listen,
    )


@isolated(limits=_EVALUATION_LIMITS, prepare=_TORCH)
def run_policy(folder: Path, robot: Robot, environment: str, placement: Placement, episodes: int) -> float:
    """Return the success share of a trained policy with a changed robot, on held-out variations.

    Args:
        folder: Folder of the finished training.
        robot: Robot with the actuators of the robot that was trained.
        environment: MJCF of the environment.
        placement: Placement of the robot.
        episodes: Number of variations.

    Raises:
        UserError: There is no finished training, or the scene does not belong to its task.
        MjcfError: The robot cannot be loaded or placed.
    """
    from aidsr.learn.episodes.policy_checks import Replays
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.learn.rl.policy import one_torch_thread
    from aidsr.learn.rl.trained import FinishedTraining
    from aidsr.sim.assembly import assemble

    trained = FinishedTraining.load(folder)
    scene = assemble(robot, environment, placement, trained.scene.task.sensors)
    there = TaskScene.of(scene.mjcf, trained.scene.task, grouping="off")
    there = there.with_actions(trained.config.groups, trained.config.groups_from)
    there = trained.config.recipe.acting_in(there)
    variations = tuple(there.task.variation("held_out", index) for index in range(episodes))
    replays = Replays(there, trained.policy, variations, threads=1, smoothing=trained.config.recipe.smoothing)
    with one_torch_thread():
        return float(replays.play(there.model).success.mean())
