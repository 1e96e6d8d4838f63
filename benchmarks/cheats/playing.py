"""Placement of a cheating body in a task, and episodes of the body under simple rules."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from benchmarks.cheats.bodies import Cheat
from benchmarks.cheats.parts import MakeRule, Player, constant, idle
from lxml import etree

from aidsr.core.artifacts import Placement
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import EpisodeOutcomes, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.mjcf.read import parse_document
from aidsr.sim.assembly import assemble
from aidsr.tasks import Task

_CLEAR_M = 0.0005
"""Clearance above the ground at which a free body is placed [m]."""


def place(cheat: Cheat, task: Task) -> str:
    """Return the MJCF of the scene in which a body is tried. At its own task, its offset and its edit are applied.

    Raises:
        MjcfError: The body cannot be placed.
    """
    own = is_own(cheat, task)
    free = task.base == "free" and not (own and cheat.held)
    x, y, z = cheat.offset_m if own else (0.0, 0.0, 0.0)
    position_m = (x, y, z + (lift_m(cheat.mjcf) if free else 0.0))
    placement = Placement(mount="mount", base="free" if free else "fixed", position_m=position_m)
    scene = assemble(cheat.robot, task.environment, placement, task.sensors).mjcf
    if cheat.edit is None or not own:
        return scene
    root = parse_document(scene).root
    cheat.edit(root)
    return etree.tostring(root, encoding="unicode")


def is_own(cheat: Cheat, task: Task) -> bool:
    """Return whether a task is the one that a body is meant to win."""
    return task.name.rpartition("/")[2] == cheat.task


def lift_m(mjcf: str) -> float:
    """Return how far a body must be lifted to stand on the ground [m]."""
    model = mujoco.MjModel.from_xml_string(mjcf)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    if not solid.any():
        return 0.0
    turns = data.geom_xmat.reshape(-1, 3, 3)
    middle = data.geom_xpos[:, 2] + np.einsum("nj,nj->n", turns[:, 2], model.geom_aabb[:, :3])
    half = np.einsum("nj,nj->n", np.abs(turns[:, 2]), model.geom_aabb[:, 3:])
    capsule = model.geom_type == int(mujoco.mjtGeom.mjGEOM_CAPSULE)
    half = np.where(capsule, np.abs(turns[:, 2, 2]) * model.geom_size[:, 1] + model.geom_size[:, 0], half)
    return float(max(0.0, _CLEAR_M - (middle - half)[solid].min()))


def rules(cheat: Cheat, task: Task, scene: TaskScene) -> Iterator[tuple[str, MakeRule]]:
    """Yield the names and the makers of the simple rules for a body at a task.

    The body's own rule comes first. It is used at the body's own task and, for bodies of locomotion or grasping, at all
    tasks of that category.
    """
    category = task.name.partition("/")[0]
    if is_own(cheat, task) or (category == cheat.category and category in ("locomotion", "grasping")):
        yield "its own rule", cheat.rule
    yield "idle", lambda: idle
    yield "all commands low", lambda: constant({"*": -1.0})
    yield "all commands high", lambda: constant({"*": 1.0})
    if scene.task.policy_actuators:
        mount = dict.fromkeys(scene.task.policy_actuators, 1.0)
        yield "only the mount moves", lambda: constant(mount)


def play(scene: TaskScene, make: MakeRule, episodes: int) -> EpisodeOutcomes:
    """Return the outcomes of the first held-out episodes under a rule."""
    drawn = [scene.task.variation("held_out", index) for index in range(episodes)]
    return rollout(Episodes(scene.model, scene.task, scene.actions, drawn, threads=1), Player(scene, make))
