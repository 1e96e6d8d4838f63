"""The probe itself: play many motions, keep the best, tell how far they led."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import mujoco
import numpy as np

from aidsr.core.artifacts import ActuatorGroup
from aidsr.core.errors import UserError
from aidsr.learn.episodes.actions import Grouping
from aidsr.learn.episodes.batch import Episodes, Moment
from aidsr.learn.episodes.playing import Course, play
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop.early_stop import Stop
from aidsr.learn.openloop.motion import Motions, OpenLoop
from aidsr.learn.openloop.motion_search import FAMILIES, Family, Space
from aidsr.learn.openloop.report import EndedBy, ProbedVariation, ProbeReport
from aidsr.tasks import BENCHMARK_VERSION, Level, Task, Variation
from aidsr.tasks.readings import FloatArray

__all__ = ["CANDIDATES", "MAX_STEPS", "VARIATIONS", "probe", "probe_scene"]

GENERATION = 16
"""Motions played at once for each variation. Our choice: more generations of fewer motions found more of the same
budget's goals."""
CANDIDATES = 8 * GENERATION
"""Three generations of random motions, one for each family, and five of search."""
VARIATIONS = 2
LONGEST_SEARCH_S = 8.0
"""Motions of the search are played no longer than this. Our choice: as long as a whole grasp; a body that travels shows
its speed long before its time is over."""
MAX_STEPS = 300_000
"""Physics steps of a whole probe. Our choice: seconds of one core for a body of a single limb, see docs/learning.md."""
_FEWEST = 4
"""A generation that the budget cuts down to fewer motions is not played. Our choice: fewer say nothing of a family."""


def probe(
    scene: str | Path,
    task: str | Task,
    *,
    level: Level = "standard",
    groups: Sequence[ActuatorGroup] = (),
    grouping: Grouping = "auto",
    candidates: int = CANDIDATES,
    variations: int = VARIATIONS,
    max_steps: int = MAX_STEPS,
    seed: int = 0,
    threads: int = 0,
    listen: Callable[[int, float], None] = lambda _played, _progress: None,
) -> ProbeReport:
    """Say how far a body can get on a task without learning anything.

    Args:
        scene: MJCF of a robot in the environment of the task, or the path of its file.
        task: A task or its name.
        level: Level of a task given by name.
        groups: Actuators that act together, as the robot's author says.
        grouping: "auto" lets actuators act together; "off" gives each a motion of its own.
        candidates: Motions tried for each variation, in whole generations of 16.
        variations: How many development variations.
        max_steps: Physics steps of all simulations together.
        seed: Of all that is drawn.
        threads: Native threads; 0 takes all processors.
        listen: Told how many motions were played, and the mean progress of the best ones.

    Raises:
        UserError: There is no such file or task, the scene is not one of this task, or a number is out of range.
        MjcfError: The scene cannot be loaded.
    """
    return probe_scene(
        TaskScene.of(scene, task, level=level, groups=groups, grouping=grouping),
        candidates=candidates,
        variations=variations,
        max_steps=max_steps,
        seed=seed,
        threads=threads,
        listen=listen,
    )


def probe_scene(
    scene: TaskScene,
    *,
    candidates: int = CANDIDATES,
    variations: int = VARIATIONS,
    max_steps: int = MAX_STEPS,
    seed: int = 0,
    threads: int = 0,
    listen: Callable[[int, float], None] = lambda _played, _progress: None,
) -> ProbeReport:
    """Do what `probe` does for a scene that is loaded already.

    The same scene, seed and bounds give the same report, its wall time aside.

    Args:
        scene: The body in the environment of its task.
        candidates: Motions tried for each variation, in whole generations of 16.
        variations: How many development variations; each is searched for itself.
        max_steps: Physics steps of all simulations together, after which the search ends. What it found is then still
            played to the end, for which a part is set aside; a first few motions are played however little is left.
        seed: Of all that is drawn.
        threads: Native threads; 0 takes all processors.
        listen: Told after each generation how many motions were played, and the mean progress of the best ones.

    Raises:
        UserError: A number is out of range.
    """
    if candidates < GENERATION or variations < 1 or max_steps < 1:
        raise UserError(
            f"at least {GENERATION} candidates, 1 variation and 1 physics step were expected, found {candidates}, "
            f"{variations} and {max_steps}"
        )
    began = time.monotonic()
    stage = _Stage(scene, threads)
    searches = [_Search(scene.task.variation("development", index)) for index in range(variations)]
    ended_by = _search(stage, searches, candidates, max_steps, np.random.default_rng(seed), listen)
    found, same_motion_share = _play_finals(stage, searches)
    best = max(found, key=lambda one: (one.episode.ended == "succeeded", one.episode.best_progress))
    return ProbeReport(
        task=scene.task.name,
        level=scene.task.level,
        benchmark_version=BENCHMARK_VERSION,
        seed=seed,
        candidates=candidates,
        max_steps=max_steps,
        ended_by=ended_by,
        searched_s=stage.searched_s,
        motions=stage.motions,
        played_steps=stage.played_steps,
        simulated_s=round(stage.played_steps * stage.step_s, 3),
        wall_s=round(time.monotonic() - began, 2),
        variations=found,
        same_motion_share=same_motion_share,
        reached=scene.task.stage_reached(best.episode.best_progress, success=best.episode.ended == "succeeded"),
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
    def best(self) -> FloatArray:
        """The best motion so far, of all families."""
        return np.asarray(self.rows[self.family][self.fitness[self.family].argmax()])


class _Stage:
    """Plays motions, each in a variation of its own, and counts."""

    def __init__(self, place: TaskScene, threads: int) -> None:
        self.place, self._threads = place, threads
        self.searched_s = min(place.task.time_limit_s, LONGEST_SEARCH_S)
        self.space = Space(place.actions.rest, self.searched_s)
        self.step_s = float(place.model.opt.timestep)
        self.played_steps = 0
        self.motions = 0
        """Tried in the search, for each variation that is not solved."""

    def steps_of(self, time_s: float) -> int:
        """Return the physics steps of an episode."""
        return round(time_s / self.step_s)

    def search(self, motions: Motions, variations: Sequence[Variation]) -> Course:
        """Play equally many motions in each variation, one after the other, as long as something comes of it."""
        owners = np.repeat(np.arange(len(variations)), len(motions.first) // len(variations))
        episodes = self._episodes([variations[owner] for owner in owners.tolist()])
        episodes.time_limit_s[:] = self.searched_s
        return self._play(episodes, motions, Stop(episodes, motions, owners))

    def play(self, motions: Motions, variations: Sequence[Variation]) -> Course:
        """Play motions from beginning to end, as many as there are variations."""
        return self._play(self._episodes(variations), motions)

    def _episodes(self, variations: Sequence[Variation]) -> Episodes:
        return Episodes(self.place.model, self.place.task, self.place.actions, variations, threads=self._threads)

    def _play(self, episodes: Episodes, motions: Motions, look: Callable[[Moment], None] = lambda _: None) -> Course:
        course = play(episodes, OpenLoop(motions, self.place.task.control_dt_s), look)
        self.played_steps += self.steps_of(float(course.time_s.sum()))
        return course


def _search(
    stage: _Stage,
    searches: Sequence[_Search],
    candidates: int,
    max_steps: int,
    rng: np.random.Generator,
    listen: Callable[[int, float], None],
) -> EndedBy:
    """Try generation after generation: each family at random first, then around the best of the best family.

    Returns:
        What ended it.
    """
    max_steps -= len(searches) ** 2 * stage.steps_of(stage.place.task.time_limit_s)  # set aside for the finals
    for generation in range(candidates // GENERATION):
        open_ones = [search for search in searches if not search.solved]
        if not open_ones:
            return "solved"
        affordable = (max_steps - stage.played_steps) // (len(open_ones) * stage.steps_of(stage.searched_s))
        count = min(GENERATION, max(affordable, 0 if generation else _FEWEST))
        if count < _FEWEST:
            return "budget"
        tried: list[tuple[Family, FloatArray]] = []
        for search in open_ones:
            if generation < len(FAMILIES):
                family = FAMILIES[generation]
                tried.append((family, stage.space.random(family, count, rng)))
            else:
                family = search.family
                known = search.rows[family], search.fitness[family]
                tried.append((family, stage.space.around(*known, count, rng)))
        rows = np.concatenate([rows for _, rows in tried])
        course = stage.search(stage.space.motions(rows), [search.variation for search in open_ones])
        for index, (search, (family, mine)) in enumerate(zip(open_ones, tried, strict=True)):
            search.keep(family, mine, course.part(slice(index * count, (index + 1) * count)))
        best = [max(worth.max() for worth in search.fitness.values()) for search in searches]
        stage.motions += count
        listen(stage.motions, float(np.clip(best, 0.0, 1.0).mean()))
    if all(search.solved for search in searches):
        return "solved"
    return "candidates" if stage.motions == candidates // GENERATION * GENERATION else "budget"


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
    told = [stage.space.motions(search.best[None]).motion(0, names) for search in searches]
    motions = Motions.of([motion for motion in told for _ in searches])
    course = stage.play(motions, [search.variation for _ in told for search in searches])
    worth = _fitness(course).reshape(len(told), len(searches))
    found = []
    for index, best in enumerate(worth.argmax(axis=0).tolist()):
        episode = course.result(best * len(searches) + index, index)
        found.append(ProbedVariation(episode=episode, family=searches[best].family, motion=told[best]))
    return tuple(found), float(course.succeeded.reshape(worth.shape).mean(axis=1).max())
