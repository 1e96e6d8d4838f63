"""Trial of a body with open-loop motions, without learning: briefly to choose among many, thoroughly to judge one."""

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
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.sim.overlap import overlaps_too_much
from aidsr.sim.structure import STANDARD_GRAVITY_M_S2, read_structure
from aidsr.tasks.targets import targets_of
from aidsr.tasks.travelling_task import TravellingTask
from aidsr.validation.rules.winches import most_tension_n

_CLEAR_M = 0.02
"""Free distance that a limb needs on each side [m]. Our choice: the thickness of the thickest built-in family, and some
room."""
_ALIKE = 2
"""Number of decimals of `Fit.value` by which bodies are sorted. Our choice: smaller differences are due to chance."""
_LIMITS = Limits(wall_s=600.0, cpu_s=200.0)
"""Time limits of a trial. Our choice: many times what the largest built-in body takes, and room for a busy machine."""


@dataclass(frozen=True)
class Round:
    """One round of trials; the best bodies go on to the next."""

    bodies: int
    """Maximum number of bodies."""
    candidates: int
    """Number of motions tried with each body."""
    max_steps: int
    """Maximum number of physics steps for the motions of one body."""


class Fit(Artifact):
    """Trial result of a body."""

    progress: float
    """Best progress of all motions, 0 to 1."""
    final_progress: float = 0.0
    """Progress of that motion at the end of its episode."""
    success: bool
    """Whether some motion succeeds."""
    reached: str
    """The best result in words."""
    why: str = ""
    """Why no motion succeeds; empty unless it was requested."""
    idle: float = 0.0
    """Progress of a body at rest in the same variation; 0 unless it was requested."""
    winches: int = 0
    """Number of actuators of the body."""
    won: int = 0
    """Number of variations in which some motion succeeds."""
    variations: int = 1
    """Number of variations that were tried."""

    @property
    def value(self) -> float:
        """Value by which bodies are compared; larger is better."""
        return (self.progress + self.final_progress) / 2 + self.success

    @property
    def rank(self) -> tuple[float, int]:
        """Key by which bodies are sorted, the best first; of equally good ones, the one with fewer winches first."""
        return -round(self.value, _ALIKE), self.winches


@isolated
def spare_tension(mjcf: str) -> float:
    """Return the tension that the validator allows a robot, relative to the maximum tension of its winches.

    Args:
        mjcf: MJCF of a robot whose tendon actuators have limits of force.

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
    """Whether the robot in a scene overlaps its surroundings at the start more than the validator allows.

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
    """Whether an obstacle is between two points, or close beside the line between them.

    Args:
        environment: MJCF of the environment.
        start_m: First point, such as a mount [m].
        end_m: Second point, such as the place of work [m].
        worked_on: Names of bodies that do not count as obstacles, nor do other bodies of the same kinematic trees.

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
    """Return the trial result of a body, measured in an isolated process.

    Args:
        scene: MJCF of the body in its environment.
        task: Task of the goal.
        groups: Groups of actuators that act together.
        candidates: Number of motions tried for each variation.
        variations: Number of development variations.
        max_steps: Maximum number of physics steps of all simulations together.
        explain: Whether to find out why, if no motion succeeds.

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
        final_progress=best.episode.progress,
        success=success,
        reached=found.reached,
        why=_why(placed, best) if explained else "",
        idle=_idle(placed, best.episode.variation) if explained else 0.0,
        winches=sum(
            placed.model.actuator(index).name.startswith(ROBOT_PREFIX) for index in range(placed.model.nactuator)
        ),
        won=found.won,
        variations=len(found.variations),
    )


def _idle(scene: TaskScene, variation: int) -> float:
    """Return the progress of a body at rest."""
    episodes = Episodes(scene.model, scene.task, scene.actions, [scene.task.variation("development", variation)])
    return float(rollout(episodes, Constant(scene.actions.rest)).best_progress[0])


def _why(scene: TaskScene, best: ProbedVariation) -> str:
    """Return a clause that says why the best motion does not succeed."""
    task = scene.task
    policy = OpenLoopPolicy(Motions.of([best.motion]), task.control_dt_s)
    variation = task.variation("development", best.episode.variation)
    recorded = trace(scene, variation, policy, targets_of(task))
    short = attribute_failure(task, recorded)[1].problem
    if task.is_decisive(best.episode.best_progress) and best.episode.best_progress >= task.stages[-1][0]:
        short = f"it stays for {best.episode.held_s:.3g} s of {task.hold_s:.3g} s at most"
    return "; ".join([short, *(limit.text for limit in best.episode.exceeded_limits)])
