"""Short training that only returns the verdict: what a policy achieves with a robot in little time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from aidsr.core.artifacts import ActuatorGroup, Evaluation
from aidsr.core.config import LEAST_EPISODES
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tasks import Level

if TYPE_CHECKING:
    from aidsr.learn.episodes.scene import TaskScene

_LIMITS = Limits(wall_s=14_400.0, cpu_s=14_400.0, memory_mib=16_384)
"""Limits of the child process. Our choice: many times what a training of 100,000 steps takes; torch alone maps several
GiB."""


@isolated(limits=_LIMITS)
def train_briefly(
    mjcf: str,
    *,
    steps: int,
    groups: Sequence[ActuatorGroup] = (),
    task: str = "",
    level: Level = "standard",
    goal: Path | None = None,
) -> Evaluation:
    """Train a policy for some steps in an isolated process and evaluate it on development variations it never saw.

    Held-out variations are reserved for the score, because designers read the result of this evaluation.

    Args:
        mjcf: MJCF of the scene.
        steps: Control steps of the training.
        groups: Actuators that act together.
        task: Name of the task.
        level: Level of the task.
        goal: File of a user-defined goal, instead of a task.

    Raises:
        UserError: There is no such task, or the scene does not belong to it.
        MjcfError: The scene cannot be loaded.
        IsolationError: Training exceeded its limits.
    """
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.tasks import goal_task, load_task, read_goal

    about = goal_task(read_goal(goal), mjcf) if goal else load_task(task, level)
    return evaluate_briefly(TaskScene.of(mjcf, about, groups=groups), steps)


def evaluate_briefly(scene: TaskScene, steps: int) -> Evaluation:
    """Train a policy as `train_briefly` does, in this process, and return its evaluation."""
    from aidsr.learn.rl.evaluation import evaluate
    from aidsr.learn.rl.policy import one_torch_thread
    from aidsr.learn.rl.recipe import PROTOCOLS
    from aidsr.learn.rl.trained import FinishedTraining
    from aidsr.learn.rl.training import train

    with TemporaryDirectory() as home:
        folder = Path(home, "training")
        train(scene, folder, steps=steps, recipe=PROTOCOLS["best"], threads=1)
        trained = FinishedTraining.load(folder)
        with one_torch_thread():
            evaluation, _ = evaluate(
                trained.scene,
                trained.policy,
                episodes=LEAST_EPISODES,
                threads=1,
                smoothing=trained.config.recipe.smoothing,
                training=trained.result,
                split="development",
            )
    return evaluation
