"""Replay of the best motion of a probe, rendered as pictures or as a video."""

from __future__ import annotations

import mujoco
import numpy as np

from aidsr.core.artifacts import ActuatorGroup, Artifact
from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.episodes.rollout import Policy, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.episodes.varied_mjcf import varied_mjcf
from aidsr.learn.openloop.replay import REPLAY_LIMITS, replay
from aidsr.learn.openloop.report import ProbedVariation
from aidsr.render.pictures import filmstrip, video
from aidsr.render.view import View
from aidsr.sandbox.isolated import isolated
from aidsr.sim.placement import mount_names
from aidsr.sim.structure import read_structure
from aidsr.tasks import Level
from aidsr.tasks.targets import targets_of
from aidsr.tasks.travelling_task import TravellingTask


class Film(Artifact):
    """Joint positions of one episode, ready to be rendered."""

    mjcf: str
    """MJCF of the scene, as the variation of the episode moves and resizes its objects."""
    qpos: tuple[tuple[float, ...], ...]
    """Positions (qpos): the first row is the start, then one row for each control step."""
    frames_per_s: float
    shown: tuple[str, ...] = ()
    """Names of bodies and sites that must be in view: the targets and the mount."""

    @property
    def duration_s(self) -> float:
        """Time from the start to the last row [s]."""
        return (len(self.qpos) - 1) / self.frames_per_s

    def strip(self, count: int = 6, view: View | None = None) -> bytes:
        """Return a PNG filmstrip of `count` moments side by side, from where the targets are in view unless stated."""
        view = view or self._view
        return filmstrip(self.mjcf, qpos=self.qpos, frames_per_s=self.frames_per_s, count=count, view=view)

    def video(self) -> bytes | None:
        """Return the episode as an MP4 video; None where OpenGL is not available."""
        return video(self.mjcf, qpos=self.qpos, frames_per_s=self.frames_per_s, view=self._view)

    @property
    def _view(self) -> View:
        return View(shown=self.shown)


@isolated(limits=REPLAY_LIMITS)
def film(
    scene: str,
    task: TravellingTask,
    best: ProbedVariation,
    *,
    level: Level = "standard",
    groups: tuple[ActuatorGroup, ...] = (),
) -> Film:
    """Replay the best motion of one variation and return the episode; the arguments are those of `replay`.

    Raises:
        UserError: The scene is not one of the task, or the motion belongs to another robot.
        MjcfError: The scene cannot be loaded.
        IsolationError: The replay exceeded its limits.
    """
    return record_film(*replay(scene, task, best, level=level, groups=groups))


def record_film(scene: TaskScene, episodes: Episodes, policy: Policy) -> Film:
    """Play one episode of a scene with a policy in this process and return it, ready to be rendered."""
    rows = [np.array(episodes.batch.bind("qpos")[0])]

    def keep(result: StepResult) -> None:
        if not result.diverged[0]:
            rows.append(np.array(episodes.batch.bind("qpos")[0]))

    rollout(episodes, policy, keep)
    return Film(
        mjcf=varied_mjcf(scene.mjcf, episodes.variations[0]),
        qpos=tuple(tuple(float(number) for number in row) for row in rows),
        frames_per_s=1.0 / scene.task.control_dt_s,
        shown=(*targets_of(scene.task), *_nearest_mount(scene.model)),
    )


def _nearest_mount(model: mujoco.MjModel) -> tuple[str, ...]:
    """Return the name of the mount nearest to the robot's root; an empty tuple where the scene has no mount."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    root = data.xpos[read_structure(model).roots[0]]
    away = {name: float(np.linalg.norm(data.site(name).xpos - root)) for name in mount_names(model)}
    return (min(away, key=lambda name: away[name]),) if away else ()
