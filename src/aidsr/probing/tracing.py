"""One motion, watched step by step: how near the robot comes, what it touches and how hard, how fast its parts move."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.episodes.batch import Episodes, Moment
from aidsr.episodes.playing import Course, play
from aidsr.episodes.scene import TaskScene
from aidsr.probing.motion import Motion, Motions, OpenLoop
from aidsr.sim.assembly import FUNCTIONAL_SITE
from aidsr.tasks import Variation, apply_to_simulation

__all__ = ["Look", "Trace", "trace"]

_ROBOT = "robot/"
_FAR_M = 2.0
"""Gaps are looked for no further than this. Our choice: beyond any environment of ours."""


@dataclass(frozen=True)
class Look:
    """What a control step came to."""

    time_s: float
    progress: float
    gap_m: float
    """From the functional part's body to the nearest target; `_FAR_M` without a target."""
    nearest: str
    """That target."""
    force_n: float
    """Normal forces of the robot on all targets together."""
    touching: tuple[str, ...]
    """Bodies of the robot that touch a target."""
    reach_m: float
    """From the robot's root to its functional part."""
    travelled_m: float
    """Level distance of the robot's centre of mass from where it began."""
    fastest: str
    """Body of the robot that moves fastest."""


@dataclass(frozen=True)
class Trace:
    """How one episode went."""

    looks: tuple[Look, ...]
    course: Course
    needed_m: float
    """From the robot's root to the nearest target at the beginning, 0 without a target."""

    @property
    def best(self) -> Look:
        """When progress was largest, for the first time."""
        return max(self.looks, key=lambda look: look.progress)

    @property
    def nearest(self) -> Look:
        """When the functional part was nearest to a target."""
        return min(self.looks, key=lambda look: look.gap_m)

    @property
    def hardest(self) -> Look:
        """When the robot pushed hardest on its targets."""
        return max(self.looks, key=lambda look: look.force_n)


def trace(place: TaskScene, variation: Variation, motion: Motion, targets: Sequence[str]) -> Trace:
    """Play a motion once more and watch it.

    Args:
        place: The scene.
        variation: In which it is played.
        motion: What the actuators do.
        targets: Bodies of the environment that the robot is to touch.
    """
    watch = _Watch(place, variation, targets)
    episodes = Episodes(place.model, place.task, place.actions, [variation], threads=1)
    looks: list[Look] = []

    def look(moment: Moment) -> None:
        if not moment.diverged[0]:
            looks.append(watch.look(episodes, moment))

    needed_m = watch.needed_m()
    course = play(episodes, OpenLoop(Motions.of([motion]), place.task.control_dt_s), look)
    return Trace(tuple(looks) or (watch.first(),), course, needed_m)


class _Watch:
    """Looks at the state of an episode through a simulation of its own."""

    def __init__(self, place: TaskScene, variation: Variation, targets: Sequence[str]) -> None:
        self._model = model = copy.copy(place.model)
        self._data = mujoco.MjData(model)
        apply_to_simulation(variation, model, self._data)
        names = [model.body(body).name for body in range(model.nbody)]
        self._names = names
        self._robot = np.array([name.startswith(_ROBOT) for name in names])
        self._root = int(self._robot.argmax())
        self._site = model.site(FUNCTIONAL_SITE).id
        self._targets = {body: name for name in targets for body in self._carried_by(names.index(name))}
        self._start = self._data.subtree_com[self._root].copy()

    def _carried_by(self, body: int) -> list[int]:
        """Return a body and all that it carries."""
        found = {body}
        for other in range(body + 1, self._model.nbody):
            if int(self._model.body_parentid[other]) in found and body:
                found.add(other)
        return [each for each in found if not self._robot[each]]

    def needed_m(self) -> float:
        """Return how far the nearest target is from the robot's root [m]."""
        root = self._data.xpos[self._root]
        return min((float(np.linalg.norm(self._data.xipos[body] - root)) for body in self._targets), default=0.0)

    def first(self) -> Look:
        """Return what is seen before anything happens."""
        return self._seen(0.0, 0.0)

    def look(self, episodes: Episodes, moment: Moment) -> Look:
        """Return what is seen now."""
        for field in ("qpos", "qvel", "ctrl"):
            getattr(self._data, field)[:] = episodes.batch.bind(field)[0]
        mujoco.mj_forward(self._model, self._data)
        return self._seen(float(moment.time_s[0]), float(moment.progress[0]))

    def _seen(self, time_s: float, progress: float) -> Look:
        data = self._data
        gap_m, nearest = self._gap()
        force_n, touching = self._touch()
        speeds = np.where(self._robot, np.linalg.norm(data.cvel[:, 3:], axis=1), -1.0)
        moved = data.subtree_com[self._root] - self._start
        return Look(
            time_s=time_s,
            progress=progress,
            gap_m=gap_m,
            nearest=nearest,
            force_n=force_n,
            touching=touching,
            reach_m=float(np.linalg.norm(data.site_xpos[self._site] - data.xpos[self._root])),
            travelled_m=float(np.linalg.norm(moved[:2])),
            fastest=self._names[int(speeds.argmax())],
        )

    def _gap(self) -> tuple[float, str]:
        """Return the gap between the functional part's body and the nearest target, and which that is."""
        mine = self._geoms(int(self._model.site_bodyid[self._site]))
        gaps = [
            (mujoco.mj_geomDistance(self._model, self._data, geom, other, _FAR_M, None), name)
            for body, name in self._targets.items()
            for other in self._geoms(body)
            for geom in mine
        ]
        return min(gaps, default=(_FAR_M, ""))

    def _geoms(self, body: int) -> range:
        first = int(self._model.body_geomadr[body])
        return range(first, first + int(self._model.body_geomnum[body]))

    def _touch(self) -> tuple[float, tuple[str, ...]]:
        """Return the normal forces between robot and targets together, and which bodies of the robot they are on."""
        total_n, bodies, force = 0.0, set[int](), np.zeros(6)
        for index in range(self._data.ncon):
            pair = self._model.geom_bodyid[self._data.contact.geom[index]]
            mine = [int(body) for body in pair if self._robot[body]]
            if len(mine) == 1 and any(int(body) in self._targets for body in pair):
                mujoco.mj_contactForce(self._model, self._data, index, force)
                total_n += float(force[0])
                bodies.update(mine if force[0] > 0 else ())
        return total_n, tuple(self._names[body] for body in sorted(bodies))
