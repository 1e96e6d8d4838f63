"""One episode, recorded step by step: gaps to the targets, contact forces, speeds of the robot's bodies."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.episodes.rollout import Constant, EpisodeOutcomes, Policy, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sim.contact_forces import contact_bodies
from aidsr.sim.divergence import body_speeds
from aidsr.sim.functional_part import FUNCTIONAL_SITE
from aidsr.sim.geom_distance import geom_distance_m
from aidsr.tasks import GoalTask, Variation, apply_to_simulation
from aidsr.tasks.goals.goal import Goal, unit
from aidsr.tasks.goals.move import Lift, Travel
from aidsr.tasks.readings import FloatArray

_FAR_M = 2.0
"""Largest gap that is measured [m]. Our choice: larger than any environment of the benchmark."""
_SUSTAINED_S = 0.2
"""Shortest duration of a force that counts as sustained [s]; a shorter one is an impact. Our choice: as long as the
shortest hold of a task."""
_JOINT = mujoco.mjtJoint


@dataclass(frozen=True)
class TraceStep:
    """State of an episode after one control step."""

    time_s: float
    progress: float
    gap_m: float
    """Distance to the nearest target [m]. It is measured from the body of the functional part, from the nearest
    ancestor with a geom where that body has none, or from the whole robot where no ancestor has one; to a point that is
    to be reached, from the functional part's site. `_FAR_M` without a target."""
    nearest: str
    """Name of that target; empty without a target."""
    force_n: float
    """Sum of the robot's normal forces on all targets [N]."""
    touching: tuple[str, ...]
    """Names of the robot's bodies that touch a target."""
    touched: tuple[str, ...]
    """Names of the targets that the robot touches."""
    violation: float
    """Severity of what the robot does against the task's rules, 0 to 1."""
    moved_m: float
    """Largest displacement of a target from its position at the same time in an episode with an idle robot [m]; of a
    goal with a direction, along that direction."""
    apart_m: float
    """Distance from the robot's root to the nearest target [m], 0 without a target."""
    reach_m: float
    """Distance from the robot's root to its functional part [m]."""
    travelled_m: float
    """Horizontal distance of the robot's centre of mass from its start [m]."""
    fastest: str
    """Name of the robot's fastest body."""


@dataclass(frozen=True)
class Trace:
    """One episode, step by step."""

    steps: tuple[TraceStep, ...]
    outcomes: EpisodeOutcomes
    yield_force_n: Mapping[str, float]
    """Force that moves each target over its whole range [N]: its friction and spring, or its weight. Targets that are
    fixed or rotate are not listed."""
    free: bool
    """Whether the robot's root is free, so that nothing holds it."""

    @property
    def required_n(self) -> float:
        """Smallest force that moves a target which the robot touches [N]; 0 where none moves in one direction."""
        touched = {name for step in self.steps for name in step.touched}
        return min((force_n for name, force_n in self.yield_force_n.items() if name in touched), default=0.0)

    @property
    def needed_m(self) -> float:
        """Smallest distance from the robot's root to a target during the episode [m], 0 without a target."""
        return min(step.apart_m for step in self.steps)

    @property
    def best(self) -> TraceStep:
        """First step with the largest progress."""
        return max(self.steps, key=lambda step: step.progress)

    @property
    def nearest(self) -> TraceStep:
        """Step in which the functional part was nearest to a target."""
        return min(self.steps, key=lambda step: step.gap_m)

    @property
    def hardest(self) -> TraceStep:
        """Step in which the robot pressed hardest on its targets."""
        return max(self.steps, key=lambda step: step.force_n)

    @property
    def sustained_n(self) -> float:
        """Largest force on the targets that lasted at least `_SUSTAINED_S` [N]; impacts do not count."""
        span_s = self.steps[-1].time_s / len(self.steps)
        window = min(len(self.steps), math.ceil(_SUSTAINED_S / span_s) if span_s else 1)
        return max(
            min(step.force_n for step in self.steps[i : i + window]) for i in range(len(self.steps) - window + 1)
        )


def trace(scene: TaskScene, variation: Variation, policy: Policy, targets: Sequence[str]) -> Trace:
    """Play one episode with a policy and record it.

    Args:
        scene: The robot in its environment.
        variation: Variation of the episode.
        policy: Policy that drives the actuators.
        targets: Names of the bodies of the environment that the robot has to touch, or of the sites or bodies that it
            has to reach.
    """
    recorder = _Recorder(scene, variation, targets)
    episodes = Episodes(scene.model, scene.task, scene.actions, [variation], threads=1)
    idle = _Recorder(scene, variation, targets)

    def remember(result: StepResult) -> None:
        if not result.diverged[0]:
            recorder.idle.append(idle.centres(episodes))

    rollout(episodes, Constant(scene.actions.rest), remember)
    episodes = Episodes(scene.model, scene.task, scene.actions, [variation], threads=1)
    steps: list[TraceStep] = []

    def record(result: StepResult) -> None:
        if not result.diverged[0]:
            steps.append(recorder.record(episodes, result))

    outcomes = rollout(episodes, policy, record)
    free = bool(episodes.structure.free_roots)
    return Trace(tuple(steps) or (recorder.initial(),), outcomes, recorder.yield_force_n(), free)


class _Recorder:
    """Measures the state of an episode in a separate simulation."""

    def __init__(self, scene: TaskScene, variation: Variation, targets: Sequence[str]) -> None:
        self._model = model = copy.copy(scene.model)
        self._data = mujoco.MjData(model)
        apply_to_simulation(variation, model, self._data)
        self._names = [model.body(body).name for body in range(model.nbody)]
        self._robot = np.array([name.startswith(ROBOT_PREFIX) for name in self._names])
        self._root = int(self._robot.argmax())
        self._site = model.site(FUNCTIONAL_SITE).id
        part = int(model.site_bodyid[self._site])
        while part != self._root and not model.body_geomnum[part]:
            part = int(model.body_parentid[part])
        self._parts = [part] if model.body_geomnum[part] else np.flatnonzero(self._robot).tolist()
        goal = scene.task.goal if isinstance(scene.task, GoalTask) else None
        self._points = {name: self._point(name) for name in targets if goal and name in goal.points}
        bodies = {name: model.body(name).id for name in targets if name not in self._points}
        if goal and goal.moves_bodies:  # a body moves together with the body that it is welded to
            bodies = {name: int(model.body_weldid[body]) or body for name, body in bodies.items()}
        self._targets = {body: name for name, first in bodies.items() for body in self._carried_by(first)}
        self._start = self._data.subtree_com[self._root].copy()
        self._targets_start = self._centres()
        self._along = _direction(goal)
        self.idle: list[FloatArray] = []
        """Positions of points and targets after each step of an episode with an idle robot."""
        self._steps = 0

    def _point(self, name: str) -> FloatArray:
        """Return the position of a site, or else of a body's origin, as a view of the simulation's data, (3,) [m]."""
        site = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_SITE, name)
        found: FloatArray = self._data.site_xpos[site] if site >= 0 else self._data.body(name).xpos
        return found

    def _carried_by(self, body: int) -> list[int]:
        """Return a body and its descendants, without those of the robot."""
        found = {body}
        for other in range(body + 1, self._model.nbody):
            if int(self._model.body_parentid[other]) in found and body:
                found.add(other)
        return [each for each in found if not self._robot[each]]

    def yield_force_n(self) -> dict[str, float]:
        """Return `Trace.yield_force_n`."""
        found = {name: self._yield_force_n(body) for body, name in self._targets.items()}
        return {name: force_n for name, force_n in found.items() if force_n}

    def _yield_force_n(self, body: int) -> float:
        """Return the force that moves a body together with its carriers [N]; 0 where it is fixed or rotates."""
        model = self._model
        while body and not model.body_jntnum[body]:
            body = int(model.body_parentid[body])
        joint = int(model.body_jntadr[body])
        if joint < 0:
            return 0.0
        if model.jnt_type[joint] == _JOINT.mjJNT_FREE:
            return float(model.body_subtreemass[body] * np.linalg.norm(model.opt.gravity))
        if model.jnt_type[joint] != _JOINT.mjJNT_SLIDE:
            return 0.0
        farthest_m = np.abs(model.jnt_range[joint] - model.qpos_spring[model.jnt_qposadr[joint]]).max()
        return float(model.dof_frictionloss[model.jnt_dofadr[joint]] + model.jnt_stiffness[joint] * farthest_m)

    def initial(self) -> TraceStep:
        """Return the state before the first step."""
        return self._measure(0.0, 0.0, 0.0)

    def centres(self, episodes: Episodes) -> FloatArray:
        """Return the present positions of points and targets, (targets, 3) [m]."""
        self._take(episodes)
        return self._centres()

    def _take(self, episodes: Episodes) -> None:
        episodes.copy_state(0, self._data)
        mujoco.mj_forward(self._model, self._data)

    def record(self, episodes: Episodes, result: StepResult) -> TraceStep:
        """Return the state after a control step."""
        self._take(episodes)
        self._steps += 1
        return self._measure(float(result.time_s[0]), float(result.progress[0]), float(result.violation[0]))

    def _measure(self, time_s: float, progress: float, violation: float) -> TraceStep:
        data = self._data
        gap_m, nearest = self._gap()
        force_n, touching, touched = self._touch()
        speeds = body_speeds(self._model.body_rootid, data.cvel, data.xipos, data.subtree_com)
        moved = data.subtree_com[self._root] - self._start
        return TraceStep(
            time_s=time_s,
            progress=progress,
            gap_m=gap_m,
            nearest=nearest,
            force_n=force_n,
            touching=touching,
            touched=touched,
            violation=violation,
            moved_m=self._moved_m(),
            apart_m=float(np.linalg.norm(self._centres() - data.xpos[self._root], axis=1).min()) if nearest else 0.0,
            reach_m=float(np.linalg.norm(data.site_xpos[self._site] - data.xpos[self._root])),
            travelled_m=float(np.linalg.norm(moved[:2])),
            fastest=self._names[int(np.where(self._robot, speeds, -1.0).argmax())],
        )

    def _moved_m(self) -> float:
        """Return `TraceStep.moved_m`, which leaves out what a target also does with an idle robot."""
        at = min(self._steps, len(self.idle))
        moved = self._centres() - (self.idle[at - 1] if at else self._targets_start)
        ways = np.linalg.norm(moved, axis=1) if self._along is None else moved @ self._along
        return float(ways.max(initial=0.0))

    def _centres(self) -> FloatArray:
        """Return the positions of the points to reach and the centres of mass of the targets, (targets, 3) [m]."""
        return np.array([*self._points.values(), *self._data.xipos[list(self._targets)]]).reshape(-1, 3)

    def _gap(self) -> tuple[float, str]:
        """Return the gap between the functional part and the nearest target [m], and the name of that target."""
        at = self._data.site_xpos[self._site]
        gaps = [(float(np.linalg.norm(point - at)), name) for name, point in self._points.items()]
        gaps += [
            (geom_distance_m(self._model, self._data, geom, other, _FAR_M), name)
            for body, name in self._targets.items()
            for other in self._geoms(body)
            for part in self._parts
            for geom in self._geoms(part)
        ]
        return min(gaps, default=(_FAR_M, ""))

    def _geoms(self, body: int) -> range:
        first = int(self._model.body_geomadr[body])
        return range(first, first + int(self._model.body_geomnum[body]))

    def _touch(self) -> tuple[float, tuple[str, ...], tuple[str, ...]]:
        """Return the sum of normal forces between robot and targets [N], and the bodies and targets in contact."""
        total_n, bodies, targets, force = 0.0, set[int](), set[str](), np.zeros(6)
        for index in range(self._data.ncon):
            pair = contact_bodies(self._model, self._data.contact[index])
            mine = [body for body in pair if self._robot[body]]
            theirs = {self._targets[body] for body in pair if body in self._targets}
            if len(mine) == 1 and theirs:
                mujoco.mj_contactForce(self._model, self._data, index, force)
                total_n += float(force[0])
                bodies.update(mine if force[0] > 0 else ())
                targets.update(theirs if force[0] > 0 else ())
        return total_n, tuple(self._names[body] for body in sorted(bodies)), tuple(sorted(targets))


def _direction(goal: Goal | None) -> FloatArray | None:
    """Return the direction in which a goal wants its target moved, (3,); None where it has no such direction."""
    if isinstance(goal, Lift | Travel) and goal.target:
        return unit(goal.way[1])
    return None
