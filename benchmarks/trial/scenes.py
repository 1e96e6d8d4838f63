"""The fixed scenes on which trials are compared with trainings, in two halves.

They are all scenes of `benchmarks.learning`, half of which were written by a language model; the designs of
`benchmarks.teams` that the four roles made and that were trained there; and designs of the built-in team, the first of
seeds 0 and 1 for every task. Built-in designs are made once and kept under build/. The limits of the trial are chosen
by one half, `decide`; figures are reported on the other.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.learning.suite import Half, SuiteScene, suite
from benchmarks.rows import read_rows
from benchmarks.teams.run import FIRST as TEAMS_FIRST
from benchmarks.teams.run import HOME as TEAMS
from benchmarks.teams.run import RESULTS as TEAMS_TRAINED
from benchmarks.teams.run import Row as TeamsRow

import aidsr
from aidsr.api import find_scene
from aidsr.learn.episodes.scene import TaskScene
from aidsr.runs import Run
from aidsr.runs.files import replace_file
from aidsr.runs.folders import DesignFolder
from aidsr.tasks import TASKS, is_current

SEEDS = (0, 1)
MADE = Path("build") / "trial-scenes"
_WITHOUT_TRIAL = ("four-roles", "four-roles-before", "four-roles-control", "four-roles-laws")
"""Arms of `benchmarks.teams` whose designs had no trial before they were trained."""


@dataclass(frozen=True)
class TrialScene:
    """A robot in the environment of a task."""

    name: str
    task: str
    half: Half
    author: str
    load: Callable[[], TaskScene]


def scenes(half: Half | None = None, names: Collection[str] | None = None) -> Iterator[TrialScene]:
    """Yield the scenes of one half, or all: those of the suite, of `benchmarks.teams`, then built-in ones.

    Args:
        half: Half of the scenes; None for both.
        names: Names of the scenes; None for all.
    """
    for scene in suite(half):
        if not names or scene.name in names:
            yield _of(scene)
    if half != "decide":
        yield from (scene for scene in designs_of_teams() if not names or scene.name in names)
    for seed in SEEDS:
        for task in TASKS:
            asked = half in (None, half_of(task, seed)) and (not names or name_of(task, seed) in names)
            if asked and (made := _builtin(task, seed)):
                yield _of(made)


def trained_by_teams(most_steps: int | None = None) -> dict[str, TeamsRow]:
    """Return the trainings of `benchmarks.teams` that hold for today's benchmark, by the scene's fingerprint.

    Args:
        most_steps: Budget of control steps; by default, the newest training of each design, whatever its budget.
    """
    rows = [*read_rows(TEAMS_FIRST, TeamsRow), *read_rows(TEAMS_TRAINED, TeamsRow)]
    return {
        row.scene_sha256: row
        for row in rows
        if row.scene_sha256 and is_current(row.task, row.benchmark_version) and most_steps in (None, row.most_steps)
    }


def _of(scene: SuiteScene) -> TrialScene:
    return TrialScene(scene.name, scene.task, scene.half, scene.author, scene.scene)


def designs_of_teams() -> Iterator[TrialScene]:
    """Yield the trained designs. None of them was looked at while the rule of the trial was made."""
    trained = trained_by_teams()
    for arm in _WITHOUT_TRIAL:
        for path in sorted((TEAMS / "transcripts" / arm).iterdir()):
            for design in Run(path).designs:
                if design.final_scene.path.exists() and _load(design).fingerprint in trained:
                    name = f"{arm}/{path.name}-{design.number}"
                    yield TrialScene(name, Run(path).asked().task, "aside", "language model", partial(_load, design))


def _load(design: DesignFolder) -> TaskScene:
    return find_scene(design).for_learning("auto")


def name_of(task: str, seed: int) -> str:
    """Return the name of a built-in design."""
    return f"{task.rpartition('/')[2]}-{seed}"


def half_of(task: str, seed: int) -> Half:
    """Return the half of a built-in design; each half has one of the two designs of each task."""
    return "decide" if (list(TASKS).index(task) + seed) % 2 == 0 else "aside"


def _builtin(task: str, seed: int) -> SuiteScene | None:
    """Return the first design of a seed, made unless it is kept; None if it was not approved."""
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
