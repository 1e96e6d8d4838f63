"""Settings of a training: enough to repeat it, and to tell it from another."""

from __future__ import annotations

from importlib.metadata import version
from typing import TYPE_CHECKING, Literal, Self

from aidsr.core.artifacts import ActuatorGroup, Artifact
from aidsr.learn.episodes.actions import GroupsFrom
from aidsr.learn.rl.recipe import Recipe
from aidsr.tasks import BENCHMARK_VERSION, GoalTask, Level
from aidsr.tasks.goals import GOAL_VERSION, AnyGoal

if TYPE_CHECKING:
    from aidsr.learn.episodes.scene import TaskScene

Stopped = Literal["budget", "saturated", "time", "hopeless"]
"""Reason why a training ended."""

_PACKAGES = ("aidsr", "mujoco", "numpy", "torch", "stable-baselines3", "gymnasium")
_FOUND = {"motion", "motion_share", "probe_steps", "probe_s", "beaten"}
"""Fields that are filled in after the training was requested."""


class TrainingConfig(Artifact):
    """Settings of a training, enough to repeat it."""

    task: str
    goal: AnyGoal | None = None
    """User-defined goal, if the task was made from a goal and an environment."""
    goal_version: int | None = None
    """Version of the measurement of goals at that time; None for a task, and for goals from before versions existed."""
    level: Level
    benchmark_version: int
    steps: int
    seed: int
    recipe: Recipe
    groups: tuple[ActuatorGroup, ...]
    """Group of actuators that each number of an action drives."""
    groups_from: GroupsFrom
    scene_sha256: str
    minutes: float | None = None
    """Budget of wall time [min], None for no limit; a run that it ends early cannot be repeated step by step."""
    versions: dict[str, str]
    motion: str = ""
    """Script of the motion that a SAC policy has to beat, if a probe found one (`recipe.from_probe`). This and the
    fields below are known only after the probe. If the motion was not beaten, it is `recipe.script`."""
    motion_share: float = 0.0
    """Share of development episodes in which the motion succeeds."""
    probe_steps: int = 0
    """Control steps of that search; they are not part of `steps`."""
    probe_s: float = 0.0
    """Wall time of that search [s]; the wall time of the training starts with it."""
    beaten: Stopped | None = None
    """Why the learning ended whose policy did not beat the motion; None if it beat it, or nothing was learned."""

    def with_the_motion(self) -> TrainingConfig:
        """Return the settings of a policy that plays the motion."""
        return self.model_copy(update={"recipe": self.recipe.model_copy(update={"script": self.motion})})

    @classmethod
    def of(
        cls, scene: TaskScene, *, steps: int, seed: int, recipe: Recipe | None = None, minutes: float | None = None
    ) -> Self:
        """Return the settings of a training in a scene; the default recipe is that of the paper."""
        goal = scene.task.goal if isinstance(scene.task, GoalTask) else None
        return cls(
            task=scene.task.name,
            goal=goal,
            goal_version=GOAL_VERSION if goal else None,
            level=scene.task.level,
            benchmark_version=BENCHMARK_VERSION,
            steps=steps,
            seed=seed,
            recipe=recipe or Recipe(),
            groups=scene.actions.groups,
            groups_from=scene.actions.groups_from,
            scene_sha256=scene.fingerprint,
            minutes=minutes,
            versions={package: version(package) for package in _PACKAGES},
        )

    def differences(self, other: TrainingConfig) -> list[str]:
        """Return the fields in which two trainings differ, except library versions and the probe's results.

        The values are compared, not their classes: JSON does not keep the class of a goal that was resolved.
        """
        names = TrainingConfig.model_fields.keys() - {"versions", "recipe"} - _FOUND
        mine, others = self.model_dump(include=names), other.model_dump(include=names)
        differing = [name for name in names if mine[name] != others[name]]
        same_recipe = self.recipe.as_asked() == other.recipe.as_asked()
        return sorted(differing if same_recipe else [*differing, "recipe"])
