"""Compare generations by a language model with searches over the built-in families, at an equal number of scenes.

    python -m benchmarks.memory.searched --tasks crank_turning surface_adapting --scenes 16
    python -m benchmarks.memory.searched --evolution build/evolution/crank_turning

The arms, none of which uses a trained policy:

    rules       first concept of the built-in rules, another seed for each scene
    random      as `rules`, with every number of the robot varied at random (15 % standard deviation)
    cma-es      CMA-ES over the numbers of the first concept of seed 1, in generations of eight
    evolution   `aidsr evolve` with a language model: the measurements in its folder, in the order of its designs

Each scene is tried as by `--task-feedback`: its progress is the mean of two or three searches for a motion. The best of
many noisy figures is too optimistic, so the best scene of each arm is tried again with three other seeds and
variations. Rows go to searched.jsonl. The same command continues with the scenes that are missing and prints the table.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from benchmarks.rows import read_rows

from aidsr.core.artifacts import ActuatorGroup, Artifact, Brief, Concept
from aidsr.core.errors import IsolationError, MjcfError
from aidsr.core.provenance import commit
from aidsr.evolution.generations import Evolution
from aidsr.learn.episodes.scene import TaskScene
from aidsr.runs.folders import IterationFolder
from aidsr.sim.assembly import assemble
from aidsr.tasks import load_task
from aidsr.teams.baselines.search import INITIAL_STD, SearchDesigner, Space
from aidsr.teams.rules.coder import RuleCoder
from aidsr.teams.rules.designer import RuleDesigner
from aidsr.teams.rules.families import load_families
from aidsr.teams.rules.integrator import RuleIntegrator
from aidsr.teams.rules.job import read_job
from aidsr.tools.trial import SEEDS, try_scene
from aidsr.validation import validate

RESULTS = Path(__file__).with_name("searched.jsonl")
ARMS = ("rules", "random", "cma-es")
"""Arms that need no language model."""


class Row(Artifact):
    """Trial of one scene."""

    arm: str
    task: str
    number: int
    """Number of the scene in its arm, from 1."""
    name: str
    progress: float
    """Progress in the trial; 0 if no stable scene could be made."""
    stable: bool = True
    again: float | None = None
    """Progress with other seeds and variations; measured for the best scene of an arm only."""
    model: str = ""
    commit: str = ""


class _EnoughError(Exception):
    """Raised when the requested number of scenes is tried."""


def main() -> None:
    """Try the scenes that are missing, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", nargs="*", default=[], help="tasks to search for")
    parser.add_argument("--arms", nargs="+", default=list(ARMS), choices=ARMS)
    parser.add_argument("--scenes", type=int, default=16, help="of each arm")
    parser.add_argument("--evolution", nargs="*", default=[], type=Path, help="folders of `aidsr evolve`")
    parser.add_argument("--rows", type=Path, default=RESULTS)
    asked = parser.parse_args()
    rows = Rows(asked.rows)
    for task in asked.tasks:
        for arm in asked.arms:
            search(rows, arm, load_task(task).name, asked.scenes)
    for folder in asked.evolution:
        read_evolution(rows, Evolution(folder))
    sys.stdout.write(table(rows.kept))


class Rows:
    """Rows in a file, which is written again when a row is added."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.kept = read_rows(path, Row)

    def of(self, arm: str, task: str) -> list[Row]:
        """Return the rows of an arm for a task, by number."""
        return [row for row in self.kept if (row.arm, row.task) == (arm, task)]

    def add(self, row: Row) -> None:
        """Add a row; it replaces an older row of the same arm, task and number."""
        key = (row.arm, row.task, row.number)
        self.kept = sorted(
            [*(old for old in self.kept if (old.arm, old.task, old.number) != key), row],
            key=lambda each: (each.task, each.arm, each.number),
        )
        self._path.write_text("".join(one.model_dump_json() + "\n" for one in self.kept), encoding="utf-8")


def search(rows: Rows, arm: str, task: str, scenes: int) -> None:
    """Try the requested number of scenes of an arm, then try its best one again."""
    brief = load_task(task).brief()
    concepts: dict[int, Concept] = {}

    def value(brief: Brief, concept: Concept) -> float:
        number = len(concepts) + 1
        if number > scenes:
            raise _EnoughError
        concepts[number] = concept
        known = next((row for row in rows.of(arm, task) if row.number == number), None)
        if known is None:
            found = _tried(brief, concept, first_seed=0)
            known = Row(
                arm=arm,
                task=task,
                number=number,
                name=concept.name,
                progress=0.0 if found is None else found,
                stable=found is not None,
                commit=commit(),
            )
            rows.add(known)
        return known.progress

    try:
        for concept in _concepts(arm, brief, value):
            value(brief, concept)
    except _EnoughError:
        pass
    best = max((row for row in rows.of(arm, task) if row.number in concepts), key=lambda row: row.progress)
    if best.again is None:
        rows.add(best.model_copy(update={"again": _tried(brief, concepts[best.number], first_seed=SEEDS)}))


def _concepts(arm: str, brief: Brief, value: Callable[[Brief, Concept], float]) -> Iterator[Concept]:
    """Yield the concepts of an arm. For "cma-es" yield none: CMA-ES calls `value` itself."""
    if arm == "cma-es":
        SearchDesigner(1, value, robots=1_000).propose(brief, 1)
        return
    for seed in range(1, 1_000):
        concept = RuleDesigner(seed).propose(brief, 1)[0]
        yield _varied(brief, concept, np.random.default_rng(seed)) if arm == "random" else concept


def _varied(brief: Brief, concept: Concept, rng: np.random.Generator) -> Concept:
    """Return a concept of the rules with every searchable parameter drawn anew, as in the search's first generation."""
    family = load_families()[concept.family]
    space = Space.around(family.read(concept))
    point = rng.normal(0.0, INITIAL_STD, len(space.names))
    return family.concept(space.parameters(point), read_job(brief), concept.interpretation)


def _tried(brief: Brief, concept: Concept, first_seed: int) -> float | None:
    """Return the progress of a concept's robot; None if it has no stable scene."""
    robot = RuleCoder().write(brief, concept)
    task = load_task(brief.task)
    try:
        scene = assemble(robot, brief.environment, RuleIntegrator().place(brief, concept, robot), task.sensors)
        if not validate(scene.mjcf, needs_contact=brief.needs_contact).stable:
            return None
        return progress_of(scene.mjcf, brief.task, robot.actuator_groups, first_seed)
    except (MjcfError, IsolationError):
        return None


def progress_of(mjcf: str, task: str, groups: Sequence[ActuatorGroup], first_seed: int) -> float:
    """Return the progress of a scene in a trial. With a first seed above 0, all searches but no script are made."""
    scene = TaskScene.of(mjcf, load_task(task), groups=groups)
    return round(try_scene(scene, first_seed=first_seed, attribute=first_seed == 0).progress, 3)


def read_evolution(rows: Rows, evolution: Evolution) -> None:
    """Record the measurements of an evolution, and try its best scene again."""
    lessons = evolution.archive.lessons()
    task = lessons[0].task
    for number, lesson in enumerate(lessons, 1):
        known = next((row for row in rows.of("evolution", task) if row.number == number), None)
        row = Row(
            arm="evolution",
            task=task,
            number=number,
            name=lesson.name,
            progress=round(lesson.progress, 3),
            again=known.again if known else None,
            model=lesson.model,
            commit=lesson.commit,
        )
        rows.add(row)
    best = max(rows.of("evolution", task), key=lambda row: row.progress)
    if best.again is None:
        folder = IterationFolder(evolution.path / "runs" / lessons[best.number - 1].evidence)
        scene, robot = folder.scene.read(), folder.robot.read()
        assert scene is not None
        assert robot is not None
        again = progress_of(scene.mjcf, task, robot.actuator_groups, SEEDS)
        rows.add(best.model_copy(update={"again": again}))


def table(rows: Sequence[Row]) -> str:
    """Return the results of each arm as a Markdown table."""
    lines = [
        "| task | arm | scenes, stable | mean | best of 8 | best of all | that one again, by other seeds |",
        "|---|---|---|---|---|---|---|",
    ]
    for task, arm in dict.fromkeys((row.task, row.arm) for row in rows):
        own = [row for row in rows if (row.task, row.arm) == (task, arm)]
        best = max(own, key=lambda row: row.progress)
        mean = sum(row.progress for row in own) / len(own)
        again = "-" if best.again is None else f"{best.again:.2f}"
        first = max(row.progress for row in own[:8])
        lines.append(
            f"| {task} | {arm} | {len(own)}, {sum(row.stable for row in own)} | {mean:.2f} | {first:.2f} "
            f"| {best.progress:.2f} | {again} |"
        )
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
