"""How far a body comes with a goal, without learning: quickly to choose among many, thoroughly to judge one."""

from __future__ import annotations

import mujoco
import numpy as np

from aidsr.core.artifacts import ActuatorGroup, Artifact
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop.probe_scene import probe_scene
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.sim.overlap import overlaps_too_much
from aidsr.sim.ownership import ROBOT_PREFIX
from aidsr.sim.structure import read_structure
from aidsr.tasks.travelling_task import TravellingTask

CANDIDATES = 48
MAX_STEPS = 40_000
"""Motions tried with a body to choose it, and physics steps for them. Our choice: three seconds; this only compares."""
_LIMITS = Limits(wall_s=600.0, cpu_s=200.0)
"""Our choice: many times what the largest built-in body takes, and room for a busy machine."""


class Fit(Artifact):
    """How far a body comes."""

    progress: float
    """The best of all motions, 0 to 1."""
    success: bool
    """Whether some motion succeeds."""
    reached: str
    """The same in words."""

    @property
    def value(self) -> float:
        """What bodies are compared by."""
        return self.progress + self.success


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


@isolated(limits=_LIMITS)
def fit(
    scene: str,
    task: TravellingTask,
    groups: tuple[ActuatorGroup, ...],
    candidates: int,
    variations: int,
    max_steps: int,
) -> Fit:
    """Return how far a body comes, measured in an isolated process.

    Args:
        scene: MJCF.
        task: Of the goal.
        groups: Actuators that act together.
        candidates: Motions tried for each variation.
        variations: How many development variations.
        max_steps: Physics steps of all simulations together.

    Raises:
        MjcfError: The scene cannot be loaded.
        IsolationError: The trial exceeded its limits.
    """
    placed = TaskScene.of(scene, task, groups=groups)
    found = probe_scene(placed, candidates=candidates, variations=variations, max_steps=max_steps, threads=1)
    return Fit(
        progress=found.best.episode.best_progress,
        success=found.best.episode.ended == "succeeded",
        reached=found.reached,
    )
