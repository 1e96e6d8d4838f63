"""`probe`: the probe of a scene, run in a child process with limits."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

from aidsr.core.artifacts import ActuatorGroup
from aidsr.learn.episodes.actions import Grouping
from aidsr.learn.episodes.scene import TaskScene, read_mjcf_text
from aidsr.learn.openloop.probe_scene import VARIATIONS, ProbePoint, probe_scene
from aidsr.learn.openloop.report import ProbeReport
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tasks import Level, Task
from aidsr.tasks.travelling_task import TravellingTask, can_travel

_LIMITS = Limits(wall_s=3600.0, cpu_s=math.inf)
"""Limits of the child process. Our choice: an hour for each generation of motions, which takes seconds; the caller
decides how many generations there are."""


def probe(
    scene: str | Path,
    task: str | Task,
    *,
    level: Level = "standard",
    groups: Sequence[ActuatorGroup] = (),
    grouping: Grouping = "auto",
    candidates: int | None = None,
    variations: int = VARIATIONS,
    max_steps: int | None = None,
    seed: int = 0,
    threads: int = 0,
    listen: Callable[[ProbePoint], None] = lambda _point: None,
) -> ProbeReport:
    """Return how far a robot gets on a task without learning, measured in an isolated process.

    A task whose class is defined in a script or a notebook cannot be imported by another process; it is probed in this
    process.

    Args:
        scene: MJCF of a robot in the environment of the task, or the path of its file.
        task: A task or its name.
        level: Level of a task given by name.
        groups: Actuators that act together, as the robot's author declares.
        grouping: "auto" lets actuators act together; "off" gives each a motion of its own.
        candidates: Motions tried for each variation, in whole generations of 16; 128 unless given, with a goal 256.
        variations: Number of development variations.
        max_steps: Physics steps of all simulations together; unless given, 5,000 for each variation and second of the
            task's time limit, at least 300,000, with a goal 1,000,000.
        seed: Seed of the search.
        threads: Native threads; 0 takes all processors.
        listen: Called after each generation.

    Raises:
        UserError: There is no such file or task, the scene is not one of this task, or a number is out of range.
        MjcfError: The scene cannot be loaded.
        IsolationError: The scene took too much time or memory, or crashed MuJoCo.
    """
    run = _run_in_child if can_travel(task) else run_probe
    how = (level, tuple(groups), grouping, candidates, variations, max_steps, seed, threads)
    return run(read_mjcf_text(scene), task, *how, listen)


def run_probe(
    scene: str,
    task: TravellingTask,
    level: Level,
    groups: tuple[ActuatorGroup, ...],
    grouping: Grouping,
    candidates: int | None,
    variations: int,
    max_steps: int | None,
    seed: int,
    threads: int,
    listen: Callable[[ProbePoint], None],
) -> ProbeReport:
    """Run `probe` in this process; the scene is MJCF text."""
    return probe_scene(
        TaskScene.of(scene, task, level=level, groups=groups, grouping=grouping),
        candidates=candidates,
        variations=variations,
        max_steps=max_steps,
        seed=seed,
        threads=threads,
        listen=listen,
    )


_run_in_child = isolated(limits=_LIMITS)(run_probe)
