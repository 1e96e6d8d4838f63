"""A task as a Gymnasium environment: one simulation, based on the code of the batched one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import gymnasium
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import ActuatorGroup
from aidsr.learn.episodes.actions import Grouping
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.spaces import action_space, observation_space
from aidsr.learn.rl.training import DEVELOPMENT
from aidsr.tasks import TASKS, Level, Task, task_names

_Observation = NDArray[np.float32]


class TaskEnv(gymnasium.Env[_Observation, NDArray[np.float32]]):
    """Gymnasium environment with one robot and one task.

        import gymnasium
        import aidsr.learn.rl

        env = gymnasium.make("aidsr/ButtonPushing-v0", scene="runs/…/designs/1/final.xml")

    Actions are -1 to 1, one number for each actuator or group of actuators. The info of every step holds "progress",
    "violation", "is_success" and "diverged"; that of a reset holds "variation".

    Args:
        task: A task or its name.
        scene: MJCF of a robot in the task's environment, or the path of a file that holds it.
        level: Level of a task given by name.
        split: Split from which the variations of episodes are drawn; learning should see "development" only.
        groups: Actuators that act together, as the robot's author declares.
        grouping: Whether actuators are grouped, see `map_actions`.
        smoothing: Share of the previous action that is kept in the next.
        render_mode: None only, because nothing is rendered; `aidsr.render.pictures.video` renders motions.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012 - Gymnasium declares it like this

    def __init__(
        self,
        task: str | Task,
        scene: str | Path,
        *,
        level: Level = "standard",
        split: Literal["development", "held_out"] = "development",
        groups: Sequence[ActuatorGroup] = (),
        grouping: Grouping = "auto",
        smoothing: float = 0.0,
        render_mode: None = None,
    ) -> None:
        self.render_mode = render_mode
        self.scene = TaskScene.of(scene, task, level=level, groups=groups, grouping=grouping)
        self.split = split
        first = self.scene.task.variation(split, 0)
        self.episodes = Episodes(
            self.scene.model, self.scene.task, self.scene.actions, [first], threads=1, smoothing=smoothing
        )
        self.observation_space = observation_space(self.episodes)
        self.action_space = action_space(self.episodes)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[_Observation, dict[str, Any]]:
        """Reset to a new episode.

        Args:
            seed: Seed of the variations drawn from now on.
            options: {"variation": index} selects a variation.
        """
        super().reset(seed=seed)
        sampled = int(self.np_random.integers(DEVELOPMENT))
        index = (options or {}).get("variation", sampled)
        observation = self.episodes.reset(np.array([0]), [self.scene.task.variation(self.split, index)])
        return observation[0], {"variation": index}

    def step(self, action: NDArray[np.float32]) -> tuple[_Observation, float, bool, bool, dict[str, Any]]:
        """Advance by one control step."""
        result = self.episodes.step(np.asarray(action)[None])
        info = {
            "progress": float(result.progress[0]),
            "violation": float(result.violation[0]),
            "is_success": bool(result.success[0]),
            "diverged": bool(result.diverged[0]),
        }
        ends = bool(result.terminated[0]), bool(result.truncated[0])
        return result.observation[0], float(result.reward[0]), *ends, info


def environment_id(task: str, known: Sequence[str]) -> str:
    """Return the Gymnasium id of a task: "aidsr/ButtonPushing-v0" for "reaching/button_pushing".

    If a task of another package has the same name as another task, its id contains its category:
    "aidsr/Home.ButtonPushing-v0" for "home/button_pushing". The ids of the benchmark's own tasks never do.

    Args:
        task: Name of the task, CATEGORY/NAME.
        known: Names of all tasks.
    """
    category, _, name = task.rpartition("/")
    shared = task not in TASKS and sum(other.rpartition("/")[2] == name for other in known) > 1
    full = f"{category}.{name}" if shared else name
    return f"aidsr/{full.title().replace('_', '')}-v0"


def register_environments() -> None:
    """Register all tasks with `gymnasium.make`; importing `aidsr.learn.rl` calls this."""
    known = task_names()
    for name in known:
        if (id := environment_id(name, known)) not in gymnasium.registry:
            gymnasium.register(id, entry_point="aidsr.learn.rl.single_env:TaskEnv", kwargs={"task": name})
