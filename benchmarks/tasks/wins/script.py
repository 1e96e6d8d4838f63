"""A robot with a scripted policy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from benchmarks.episode_clock import EpisodeClock
from numpy.typing import NDArray

from aidsr.core.artifacts import Placement, Robot
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.assembly import assemble
from aidsr.tasks import Task
from aidsr.tasks.readings import FloatArray

Commands = Mapping[str, FloatArray | float]


class Script:
    """A robot with a scripted policy that acts on observations.

    Every actuator of the robot is a cable that pulls: its action is -1 if the cable is slack, and 1 at full tension.
    Each time that the episodes begin, the script starts again.

    Args:
        task: The task.
    """

    up_m: ClassVar = 0.0
    """Height above the mount at which a free robot is placed [m]."""

    def __init__(self, task: Task) -> None:
        base = "free" if task.base == "free" else "fixed"
        placement = Placement(mount="mount", base=base, position_m=(0.0, 0.0, self.up_m))
        mjcf = assemble(self.robot(), task.environment, placement, task.sensors).mjcf
        self.scene = TaskScene.of(mjcf, task, grouping="off")
        self.names = [group.name.removeprefix("robot/") for group in self.scene.actions.groups]
        self.width = sum(feature.size for feature in task.features)
        self.dt_s = task.control_dt_s
        self.clock = EpisodeClock(task)

    @staticmethod
    def robot() -> Robot:
        """Return the robot."""
        raise NotImplementedError

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return the next actions, (n, n_observations) -> (n, n_actions)."""
        if self.clock.tick(observation):
            self.begin(len(observation))
        seen = np.asarray(observation, dtype=np.float64)
        action = self.actions(seen, seen[:, -self.width :], self.clock.time_s)
        return np.clip(action, -1.0, 1.0)

    def begin(self, n: int) -> None:
        """Reset the state for n new episodes."""

    def actions(self, observation: FloatArray, seen: FloatArray, time_s: float) -> FloatArray:
        """Return the next actions, (n, n_actions). By default they are those of `commands`.

        Args:
            observation: Whole observations, (n, n_observations).
            seen: The task's features, (n, k).
            time_s: Time since the episodes began [s].
        """
        action = -np.ones((len(observation), len(self.names)))
        for name, value in self.commands(seen, time_s).items():
            action[:, self.names.index(name)] = value
        return action

    def commands(self, seen: FloatArray, time_s: float) -> Commands:
        """Return actions by the actuators' names; a cable that is not named is slack."""
        raise NotImplementedError
