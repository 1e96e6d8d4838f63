"""What is measured, as it travels to the process in which it is simulated: a scene and its job, or a robot alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

from aidsr.core.artifacts import ActuatorGroup, Artifact
from aidsr.core.errors import UserError
from aidsr.tasks import Level

if TYPE_CHECKING:
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.tasks import Task


class MeasuredScene(Artifact):
    """A robot in the environment of its job, or alone."""

    mjcf: str
    task: str = ""
    """Name of the task; empty where there is a goal."""
    level: Level = "standard"
    goal: Path | None = None
    """File of a goal, instead of a task."""
    groups: tuple[ActuatorGroup, ...] = ()
    """Actuators that act together."""
    environment: str = ""
    """MJCF of the environment that a robot alone is meant for: its physics hold, and gravity as at its mount."""
    mount: Literal["auto", "fixed", "free"] = "fixed"
    """How the root of a robot alone is held."""

    @property
    def has_job(self) -> bool:
        """Whether something measures success in it."""
        return bool(self.task) or self.goal is not None

    def require_job(self) -> None:
        """Refuse what nothing measures success of.

        Raises:
            UserError: There is neither task nor goal.
        """
        if not self.has_job:
            raise UserError("nothing measures success here; assemble a robot into the environment of a task or goal")

    def measure(self) -> Task:
        """Return what measures success in it.

        Raises:
            UserError: There is neither task nor goal, or no such task.
        """
        from aidsr.tasks import goal_task, load_task, read_goal

        self.require_job()
        goal = self.goal and goal_task(read_goal(self.goal), self.mjcf)
        return goal or load_task(self.task, self.level)

    def load(self) -> TaskScene:
        """Return the scene, ready to be stepped; only in a limited process.

        Raises:
            UserError: There is neither task nor goal, no such task, or the scene is not one of it.
            MjcfError: The scene cannot be loaded.
        """
        from aidsr.learn.episodes.scene import TaskScene

        return TaskScene.of(self.mjcf, self.measure(), groups=self.groups)
