"""The probe itself: play many motions, keep the best, tell how far they led."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np

from aidsr.artifacts import ActuatorGroup
from aidsr.episodes.actions import Grouping
from aidsr.episodes.batch import Episodes
from aidsr.episodes.playing import Course, play
from aidsr.episodes.scene import TaskScene
from aidsr.errors import UserError
from aidsr.probing.motion import Motions, OpenLoop
from aidsr.probing.report import ProbedVariation, ProbeReport
from aidsr.probing.searching import FAMILIES, Family, Space
from aidsr.tasks import BENCHMARK_VERSION, Level, Task, Variation
from aidsr.tasks.readings import FloatArray

__all__ = ["CANDIDATES", "VARIATIONS", "probe"]

GENERATION = 16
"""Motions played at once for each variation. Our choice: more generations of fewer motions found more of the same
budget's goals."""
CANDIDATES = 8 * GENERATION
"""Three generations of random motions, one for each family, and five of search."""
VARIATIONS = 2
LONGEST_SEARCH_S = 8.0
"""Motions of the search are played no longer than this. Our choice: as long as a whole grasp; a body that travels shows
its speed long before its time is over."""
_FINALISTS = 2
"""The best of the search for each variation; they are played to the end, in all variations."""


def probe(
    scene: str | Path,
    task: str | Task,
    *,
    level: Level = "standard",
    groups: Sequence[ActuatorGroup] = (),
    grouping: Grouping = "auto",
    candidates: int = CANDIDATES,
    variations: int = VARIATIONS,
    seed: int = 0,
    threads: int = 0,
    listen: Callable[[int, float], None] = lambda _played, _progress: None,
) -> ProbeReport:
    """Say how far a body can get on a task without learning anything.

    The same scene, task, seed and number of candidates give the same report, its wall time aside.

    Args:
        scene: MJCF of a robot in the environment of the task, or the path of its file.
        task: A task or its name.
        level: Level of a task given by name.
        groups: Actuators that act together, as the robot's author says.
        grouping: "auto" lets actuators act together; "off" gives each a motion of its own.
        candidates: Motions tried for each variation, in generations of 16.
        variations: How many development variations; each is searched for itself.
        seed: Of all that is drawn.
        threads: Native threads; 0 takes all processors.
        listen: Told after each generation how many motions were played, and the mean progress of the best ones.

    Raises:
        UserError: There is no such file or task, the scene is not one of this task, or a number is out of range.
        MjcfError: The scene cannot be loaded.
    """
    if candidates < GENERATION or variations < 1:
        raise UserError(
            f"at least {GENERATION} candidates and 1 variation were expected, found {candidates} and {variations}"
        )
    began = time.monotonic()
    place = TaskScene.of(scene, task, level=level, groups=groups, grouping=grouping)
    stage = _Stage(place, threads)
    searches = [_Search(place.task.variation("development", index)) for index in range(variations)]
    _search(stage, searches, candidates, np.random.default_rng(seed), listen)
    found, same_motion_share = _play_finals(stage, searches)
    best = max(found, key=lambda one: (one.episode.ended == "succeeded", one.episode.best_progress))
    return ProbeReport(
        task=place.task.name,
        level=place.task.level,
        benchmark_version=BENCHMARK_VERSION,
        seed=seed,
        candidates=candidates,
        searched_s=stage.searched_s,
        simulated_s=round(stage.simulated_s, 3),
        wall_s=round(time.monotonic() - began, 2),
        variations=found,
        same_motion_share=same_motion_share,
        reached=place.task.reached(best.episode.best_progress, won=best.episode.ended == "succeeded"),
        versions={"mujoco": mujoco.__version__},
    )


@dataclass
class _Search:
    """What was tried for one variation."""

    variation: Variation
    rows: dict[Family, FloatArray] = field(default_factory=dict)
    fitness: dict[Family, FloatArray] = field(default_factory=dict)
    solved: bool = False

    def keep(self, family: Family, rows: FloatArray, course: Course) -> None:
        """Take motions of a family in, and what they were worth."""
        worth = _fitness(course)
        self.rows[family] = np.concatenate([self.rows[family], rows]) if family in self.rows else rows
        self.fitness[family] = np.concatenate([self.fitness[family], worth]) if family in self.fitness else worth
        self.solved = self.solved or bool(course.succeeded.any())

    @property
    def family(self) -> Family:
        """The family of the best motion so far."""
        return max(self.fitness, key=lambda family: self.fitness[family].max())

    @property
    def finalists(self) -> list[tuple[Family, FloatArray]]:
        """The best motions of all families, best first."""
        ranked = [(-worth, family, row) for family in self.rows for row, worth in enumerate(self.fitness[family])]
        return [(family, self.rows[family][row]) for _, family, row in sorted(ranked)[:_FINALISTS]]


class _Stage:
    """Plays motions, each in a variation of its own, and counts."""

    def __init__(self, place: TaskScene, threads: int) -> None:
        self.place, self._threads = place, threads
        self.searched_s = min(place.task.time_limit_s, LONGEST_SEARCH_S)
        self.space = Space(place.actions.rest, self.searched_s)
        self.simulated_s = 0.0

    def play(self, motions: Motions, variations: Sequence[Variation], longest_s: float | None = None) -> Course:
        """Play motions from the beginning, as many as there are variations, to the end or so long."""
        episodes = Episodes(self.place.model, self.place.task, self.place.actions, variations, threads=self._threads)
        if longest_s is not None:
            episodes.time_limit_s[:] = longest_s
        course = play(episodes, OpenLoop(motions, self.place.task.control_dt_s))
        self.simulated_s += float(course.time_s.sum())
        return course


def _search(
    stage: _Stage,
    searches: Sequence[_Search],
    candidates: int,
    rng: np.random.Generator,
    listen: Callable[[int, float], None],
) -> None:
    """Try generation after generation: each family at random first, then around the best of the best family."""
    for generation in range(candidates // GENERATION):
        open_ones = [search for search in searches if not search.solved]
        if not open_ones:
            break
        tried: list[tuple[Family, FloatArray]] = []
        for search in open_ones:
            if generation < len(FAMILIES):
                family = FAMILIES[generation]
                tried.append((family, stage.space.random(family, GENERATION, rng)))
            else:
                family = search.family
                known = search.rows[family], search.fitness[family]
                tried.append((family, stage.space.around(*known, GENERATION, rng)))
        rows = np.concatenate([rows for _, rows in tried])
        variations = [search.variation for search in open_ones for _ in range(GENERATION)]
        course = stage.play(stage.space.motions(rows), variations, stage.searched_s)
        for index, (search, (family, mine)) in enumerate(zip(open_ones, tried, strict=True)):
            search.keep(family, mine, course.part(slice(index * GENERATION, (index + 1) * GENERATION)))
        best = [max(worth.max() for worth in search.fitness.values()) for search in searches]
        listen((generation + 1) * GENERATION, float(np.clip(best, 0.0, 1.0).mean()))


def _fitness(course: Course) -> FloatArray:
    """Return what motions were worth: progress, kept to the end, and success; little after a failure."""
    progress = (course.progress + course.best_progress) / 2 * np.where(course.failed, 0.5, 1.0)
    return np.where(course.diverged, -1.0, progress + course.succeeded)


def _play_finals(stage: _Stage, searches: Sequence[_Search]) -> tuple[tuple[ProbedVariation, ...], float]:
    """Play the best motions of all searches to the end, in all variations, rounded as they are told.

    Returns:
        The best for each variation, and the share of the variations that the best single motion solves.
    """
    names = [group.name for group in stage.place.actions.groups]
    chosen = [one for search in searches for one in search.finalists]
    told = [stage.space.motions(row[None]).motion(0, names) for _, row in chosen]
    motions = Motions.of([motion for motion in told for _ in searches])
    course = stage.play(motions, [search.variation for _ in told for search in searches])
    worth = _fitness(course).reshape(len(told), len(searches))
    found = []
    for index, best in enumerate(worth.argmax(axis=0).tolist()):
        episode = course.result(best * len(searches) + index, index)
        found.append(ProbedVariation(episode=episode, family=chosen[best][0], motion=told[best]))
    return tuple(found), float(course.succeeded.reshape(worth.shape).mean(axis=1).max())
