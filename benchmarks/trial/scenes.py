"""The fixed scenes on which trials are compared with trainings, in two halves.

All scenes of `benchmarks.learning`, of which half were written by a language model, and designs of the built-in team:
the first design of seeds 0 and 1 for every task. Built-in designs are made once, and kept under build/. One half,
`decide`, sets limits of the trial; figures are reported on the other.
"""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.learning.suite import Half, SuiteScene, suite

import aidsr
from aidsr.runs.files import replace_file
from aidsr.tasks import TASKS

SEEDS = (0, 1)
MADE = Path("build") / "trial-scenes"


def scenes(half: Half | None = None, names: Collection[str] | None = None) -> Iterator[SuiteScene]:
    """Yield the scenes of one half, or all: those of the suite, then built-in ones, task by task.

    Args:
        half: Both unless given.
        names: Only these.
    """
    yield from (scene for scene in suite(half) if not names or scene.name in names)
    for seed in SEEDS:
        for task in TASKS:
            asked = half in (None, half_of(task, seed)) and (not names or name_of(task, seed) in names)
            if asked and (scene := _builtin(task, seed)):
                yield scene


def name_of(task: str, seed: int) -> str:
    """Return the name of a built-in design."""
    return f"{task.rpartition('/')[2]}-{seed}"


def half_of(task: str, seed: int) -> Half:
    """Return the half of a built-in design: of each task one stands in either."""
    return "decide" if (list(TASKS).index(task) + seed) % 2 == 0 else "aside"


def _builtin(task: str, seed: int) -> SuiteScene | None:
    """Return the first design of a seed; None where it was not approved."""
    name = name_of(task, seed)
    path = MADE / f"{name}.json"
    if not path.exists():
        sys.stdout.write(f"designing {name}\n")
        path.parent.mkdir(parents=True, exist_ok=True)
        made = _designed(task, seed, name)
        replace_file(path, made.model_dump_json().encode() if made else b"")
    return SuiteScene.model_validate_json(path.read_bytes()) if path.stat().st_size else None


def _designed(task: str, seed: int, name: str) -> SuiteScene | None:
    with TemporaryDirectory() as home:
        design = aidsr.design(task=task, model="builtin", seed=seed, concepts=1, runs=home).design(1)
        outcome = design.outcome.read()
        if outcome is None or outcome.outcome != "approved":
            return None
        latest = design.leading_to()
        robot = next(found for iteration in latest if (found := iteration.robot.read()))
        placement = next(found for iteration in latest if (found := iteration.placement.read()))
    return SuiteScene(
        name=name,
        task=task,
        half=half_of(task, seed),
        author="built-in rules",
        origin=f"aidsr design --task {task} --seed {seed} --concepts 1",
        robot=robot,
        placement=placement,
    )
