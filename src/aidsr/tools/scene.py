"""Subject of a measurement, in the form in which it is sent to the process that simulates it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from aidsr.core.artifacts import ActuatorGroup, Artifact
from aidsr.core.errors import UserError
from aidsr.tasks import Level
from aidsr.validation.validator import Mount

if TYPE_CHECKING:
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.tasks import Task


class MeasuredScene(Artifact):
    """A robot in the environment of its job (a scene), or a robot alone."""

    mjcf: str
    task: str = ""
    """Name of the task; empty where there is a goal instead, or no job."""
    level: Level = "standard"
    goal: Path | None = None
    """File of a goal, instead of a task."""
    groups: tuple[ActuatorGroup, ...] = ()
    """Groups of actuators that act together as one action."""
    environment: str = ""
    """MJCF of the environment for which a robot alone is meant; its physics options and the direction of gravity at its
    mount are used."""
    mount: Mount = "auto"
    """How the root of a robot alone is held, as in `aidsr.validate`."""

    @property
    def has_job(self) -> bool:
        """Whether there is a task or goal that measures success."""
        return bool(self.task) or self.goal is not None

    def require_job(self) -> None:
        """Check that there is a task or goal.

        Raises:
            UserError: There is neither task nor goal.
        """
        if not self.has_job:
            raise UserError("nothing measures success here; assemble a robot into the environment of a task or goal")

    def success_task(self) -> Task:
        """Return the task, or the task made of the goal, that measures success.

        Raises:
            UserError: There is neither task nor goal, or no such task.
        """
        from aidsr.tasks import goal_task, load_task, read_goal

        self.require_job()
        goal = self.goal and goal_task(read_goal(self.goal), self.mjcf)
        return goal or load_task(self.task, self.level)

    def load(self) -> TaskScene:
        """Return the scene, ready to be simulated; call this only in an isolated process.

        Raises:
            UserError: There is neither task nor goal, no such task, or the scene does not belong to it.
            MjcfError: The scene cannot be loaded.
        """
        from aidsr.learn.episodes.scene import TaskScene

        return TaskScene.of(self.mjcf, self.success_task(), groups=self.groups)
