"""Check that the rules against cheats do not refuse honest robots: built-in designs of all tasks.

    python -m benchmarks.cheats.honest

Each first design of a task and seed is validated, alone and in its scene, and passes the checks of the evaluation that
need no episode, as a cheating body does in `matrix`.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from aidsr import validate
from aidsr.core.artifacts import Robot
from aidsr.core.provenance import commit
from aidsr.learn.episodes.plausibility import height_check, part_check, scope_check, start_check
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.assembly import assemble
from aidsr.sim.structure import read_structure
from aidsr.tasks import BENCHMARK_VERSION, TASKS, Task, load_task
from aidsr.tasks.locomotion.base import LaneTask
from aidsr.teams import rules as builtin

FOUND = Path(__file__).parent / "honest.jsonl"
SEEDS = range(5)

Row = dict[str, Any]


def main() -> None:
    """Check all designs, and write the findings."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    lines = [json.dumps(look(load_task(name), seed)) + "\n" for name in TASKS for seed in SEEDS]
    FOUND.write_text("".join(lines), encoding="utf-8")


def design(task: Task, seed: int) -> tuple[str, Robot, str]:
    """Return the family, the robot and the scene's MJCF of the first built-in design of a task."""
    brief, team = task.brief(), builtin.team(seed)
    concept = team.designer.propose(brief, 1)[0]
    robot = team.coder.write(brief, concept)
    placed = team.integrator.place(brief, concept, robot)
    return concept.family, robot, assemble(robot, brief.environment, placed, task.sensors).mjcf


def look(task: Task, seed: int) -> Row:
    """Return the row of a built-in design.

    "refused_by" has the validator's errors of scope and the failed checks that need no episode, which refuse cheating
    bodies for what they are; "physics" has the validator's other errors.
    """
    family, robot, mjcf = design(task, seed)
    alone = validate(robot.mjcf, mount="free" if task.base == "free" else "fixed", environment=task.environment)
    placed = validate(mjcf, needs_contact=task.needs_contact)
    errors = [*alone.errors, *placed.errors]
    scope = dict.fromkeys(fault.code for fault in errors if fault.layer == "scope")
    physics = dict.fromkeys(fault.code for fault in errors if fault.layer != "scope")
    refused = [*scope, *refusals(TaskScene.of(mjcf, task, groups=robot.actuator_groups))]
    facts = {"task": task.name, "seed": seed, "family": family, "benchmark_version": BENCHMARK_VERSION}
    return {**facts, "commit": commit(), "refused_by": refused, "physics": list(physics)}


def refusals(scene: TaskScene) -> Iterator[str]:
    """Yield the names of the checks that refuse a scene before an episode is played."""
    structure = read_structure(scene.model)
    checks = [scope_check(scene.model, structure), start_check(scene.model, structure, scene.task.base)]
    if isinstance(scene.task, LaneTask):
        checks.append(height_check(scene.model, structure))
    for check in (*checks, part_check(scene.model, structure, scene.task.sensors)):
        if not check.passed:
            yield check.name


if __name__ == "__main__":
    main()
