"""A short training of which only the verdict is wanted: what a policy makes of a body in little time."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from aidsr.core.artifacts import ActuatorGroup
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.evaluation import evaluate
from aidsr.learn.rl.policy import one_torch_thread
from aidsr.learn.rl.trained import FinishedTraining
from aidsr.learn.rl.training import train
from aidsr.tasks import goal_task, load_task, read_goal

__all__ = ["learn_in_worker"]


def learn_in_worker(argument: dict[str, Any]) -> dict[str, Any]:
    """Train a policy for some steps and return its evaluation on development variations it never saw, as plain values.

    Held-out ones are kept for the score: what is found here goes to those who design.

    Args:
        argument: `mjcf` of a scene, `groups` of actuators, `task` and `level` or the file of a `goal`, and `steps`.

    Raises:
        UserError: There is no such task, or the scene is not one of it.
        MjcfError: The scene cannot be loaded.
    """
    mjcf, goal = argument["mjcf"], argument["goal"]
    task = goal_task(read_goal(goal), mjcf) if goal else load_task(argument["task"], argument["level"])
    groups = [ActuatorGroup.model_validate(group) for group in argument["groups"]]
    with TemporaryDirectory() as home:
        folder = Path(home, "training")
        train(TaskScene.of(mjcf, task, groups=groups), folder, steps=argument["steps"], threads=1)
        trained = FinishedTraining.load(folder)
        with one_torch_thread():
            evaluation, _ = evaluate(
                trained.scene,
                trained.policy,
                threads=1,
                smoothing=trained.config.recipe.smoothing,
                training=trained.result,
                split="development",
            )
    return evaluation.model_dump(mode="json")
