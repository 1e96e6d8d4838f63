"""How far a body comes with a goal, without learning: quickly to choose among many, thoroughly to judge one."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.core.artifacts import ActuatorGroup, Artifact, Vec3
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import Constant, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop.failure_attribution import attribute_failure
from aidsr.learn.openloop.motion import Motions, OpenLoopPolicy
from aidsr.learn.openloop.probe_scene import probe_scene
from aidsr.learn.openloop.report import ProbedVariation
from aidsr.learn.openloop.trace import trace
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.sim.overlap import overlaps_too_much
from aidsr.sim.ownership import ROBOT_PREFIX
from aidsr.sim.structure import read_structure
from aidsr.tasks.targets import targets_of
from aidsr.tasks.travelling_task import TravellingTask
from aidsr.validation.protocol import STANDARD_GRAVITY_M_S2
from aidsr.validation.rules.winches import most_tension_n

_CLEAR_M = 0.02
"""What a limb needs to either side. Our choice: as thick as the thickest of the built-in families, and some room."""
_ALIKE = 2
"""Digits of what bodies are compared by that count. Our choice: less is chance of the search."""
_LIMITS = Limits(wall_s=600.0, cpu_s=200.0)
"""Our choice: many times what the largest built-in body takes, and room for a busy machine."""


@dataclass(frozen=True)
class Round:
    """One round in which bodies are tried; the best go on to the next."""

    bodies: int
    """How many are tried at most."""
    candidates: int
    """Motions tried with each."""
    max_steps: int
    """Physics steps for them."""


class Fit(Artifact):
    """How far a body comes."""

    progress: float
    """The best of all motions, 0 to 1."""
    kept: float = 0.0
    """What that motion has left of it at the end."""
    success: bool
    """Whether some motion succeeds."""
    reached: str
    """The same in words."""
    why: str = ""
    """Why none succeeds, where that was asked for."""
    idle: float = 0.0
    """Progress that doing nothing comes to in the same variation, where that was asked for."""
    winches: int = 0
    """Actuators of the body."""
    won: int = 0
    """Variations in which some motion succeeds."""
    variations: int = 1
    """Variations that were tried."""

    @property
    def value(self) -> float:
        """What bodies are compared by."""
        return (self.progress + self.kept) / 2 + self.success

    @property
    def rank(self) -> tuple[float, int]:
        """What bodies are sorted by, the best first; of those that come equally far, the one with fewer winches."""
        return -round(self.value, _ALIKE), self.winches


@isolated
def spare_tension(mjcf: str) -> float:
    """Return the tension that the validator allows a robot, as a share of the most that its winches pull with.

    Args:
        mjcf: A robot whose tendons have limits of force.

    Raises:
        MjcfError: The robot cannot be loaded.
    """
    from aidsr.mjcf.compile import compile_mjcf

    model = compile_mjcf(mjcf)
    on_tendon = model.actuator_trntype == mujoco.mjtTrn.mjTRN_TENDON
    most_n = float(np.abs(model.actuator_forcerange[on_tendon]).max(initial=0.0))
    weight_n = read_structure(model).mass_kg * STANDARD_GRAVITY_M_S2
    return most_tension_n(weight_n) / most_n if most_n else np.inf


@isolated
def overlaps(scene: str) -> bool:
    """Whether a robot is inside of what surrounds it, more than the validator allows.

    Raises:
        MjcfError: The scene cannot be loaded.
    """
    from aidsr.mjcf.compile import compile_mjcf

    model = compile_mjcf(scene)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    length_m = read_structure(model).characteristic_length_m
    for contact in data.contact[: data.ncon]:
        pair = [int(geom) for geom in contact.geom]
        mine = [model.body(model.geom_bodyid[geom]).name.startswith(ROBOT_PREFIX) for geom in pair]
        thickness_m = min(2.0 * float(np.min(model.geom_aabb[geom, 3:])) for geom in pair)
        if any(mine) and not all(mine) and overlaps_too_much(-float(contact.dist), thickness_m, length_m):
            return True
    return False


@isolated
def is_in_the_way(environment: str, start_m: Vec3, end_m: Vec3, worked_on: tuple[str, ...]) -> bool:
    """Whether something stands between two points, or close beside the line between them.

    Args:
        environment: Its MJCF.
        start_m: From where, such as a mount [m].
        end_m: Where to, such as the place of work [m].
        worked_on: Bodies that do not count, with all that is fixed to them or carried by them.

    Raises:
        MjcfError: The environment cannot be loaded.
    """
    from aidsr.mjcf.compile import compile_mjcf

    model = compile_mjcf(environment)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    tops = {int(model.body_rootid[model.body(name).id]) for name in worked_on} - {0}
    start, way = np.array(start_m), np.subtract(end_m, start_m)
    length = float(np.linalg.norm(way))
    if length == 0.0:
        return False
    aside = np.linalg.svd(way[None] / length)[2][1:]
    for offset in (np.zeros(3), *(sign * _CLEAR_M * axis for axis in aside for sign in (1.0, -1.0))):
        met = np.array([-1], dtype=np.int32)
        begun, left = start + offset, length
        while left > _CLEAR_M:
            ahead = mujoco.mj_ray(model, data, begun, way / length, None, 1, -1, met)
            if ahead < 0.0 or ahead > left - _CLEAR_M:
                break
            geom = int(met[0])
            solid = bool(model.geom_contype[geom] or model.geom_conaffinity[geom])
            if solid and int(model.body_rootid[model.geom_bodyid[geom]]) not in tops:
                return True
            step = ahead + 1e-4
            begun, left = begun + step * way / length, left - step
    return False


@isolated(limits=_LIMITS)
def fit(
    scene: str,
    task: TravellingTask,
    groups: tuple[ActuatorGroup, ...],
    candidates: int,
    variations: int,
    max_steps: int,
    *,
    explain: bool = False,
) -> Fit:
    """Return how far a body comes, measured in an isolated process.

    Args:
        scene: MJCF.
        task: Of the goal.
        groups: Actuators that act together.
        candidates: Motions tried for each variation.
        variations: How many development variations.
        max_steps: Physics steps of all simulations together.
        explain: Say why, where no motion succeeds.

    Raises:
        MjcfError: The scene cannot be loaded.
        IsolationError: The trial exceeded its limits.
    """
    placed = TaskScene.of(scene, task, groups=groups)
    found = probe_scene(placed, candidates=candidates, variations=variations, max_steps=max_steps, threads=1)
    best = found.best
    success = best.episode.ended == "succeeded"
    explained = explain and not success
    return Fit(
        progress=best.episode.best_progress,
        kept=best.episode.progress,
        success=success,
        reached=found.reached,
        why=_why(placed, best) if explained else "",
        idle=_idle(placed, best.episode.variation) if explained else 0.0,
        winches=sum(placed.model.actuator(index).name.startswith(ROBOT_PREFIX) for index in range(placed.model.nu)),
        won=found.won,
        variations=len(found.variations),
    )


def _idle(scene: TaskScene, variation: int) -> float:
    """Return the progress that a body comes to that does nothing."""
    episodes = Episodes(scene.model, scene.task, scene.actions, [scene.task.variation("development", variation)])
    return float(rollout(episodes, Constant(scene.actions.rest)).best_progress[0])


def _why(scene: TaskScene, best: ProbedVariation) -> str:
    """Return what keeps the best motion from success, in a clause."""
    task = scene.task
    policy = OpenLoopPolicy(Motions.of([best.motion]), task.control_dt_s)
    variation = task.variation("development", best.episode.variation)
    recorded = trace(scene, variation, policy, targets_of(task))
    short = attribute_failure(task, recorded)[1].problem
    if task.is_decisive(best.episode.best_progress) and best.episode.best_progress >= task.stages[-1][0]:
        short = f"it stays for {best.episode.held_s:.3g} s of {task.hold_s:.3g} s at most"
    return "; ".join([short, *(limit.text for limit in best.episode.passed)])
