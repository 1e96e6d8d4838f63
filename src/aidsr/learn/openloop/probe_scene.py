"""The probe: plays many open-loop motions, keeps the best, and reports how far they got."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np

from aidsr.core.errors import UserError
from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.episodes.rollout import EpisodeOutcomes, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop.early_stop import EarlyStop
from aidsr.learn.openloop.fitness import SustainedProgress, fitness_of
from aidsr.learn.openloop.motion import Motions, OpenLoopPolicy
from aidsr.learn.openloop.motion_search import (
    MOTION_KINDS,
    TRAVELLING_KINDS,
    WORKING_KINDS,
    MotionKind,
    MotionSpace,
)
from aidsr.learn.openloop.report import EndedBy, ProbedVariation, ProbeReport
from aidsr.tasks import BENCHMARK_VERSION, GoalTask, Task, Variation
from aidsr.tasks.readings import FloatArray

GENERATION = 16
"""Motions played at once for each variation. Our choice: with the same budget, more generations of fewer motions solved
more goals."""
CANDIDATES = 8 * GENERATION
"""Motions for each variation: three generations of random motions, one for each kind, and five of search."""
VARIATIONS = 2
LONGEST_SEARCH_S = 8.0
"""Maximum duration of a motion in the search [s]. Our choice: as long as a whole grasp; a travelling robot shows its
speed long before its time limit."""
MAX_STEPS = 300_000
"""Physics steps of a whole probe of a short task. Our choice: seconds on one core for a robot with a single limb, see
docs/learning.md."""
STEPS_PER_S = 5_000
"""Least physics steps per variation and second of the task's time limit, of a probe and of a trial. Our choice: with
four variations, `MAX_STEPS` are enough up to 15 s; with them and 60 s, four motions were tried for each variation."""
_ALL_BY_ALL_S = 240.0
"""Longest simulated time in which every best motion is played in every variation at the end [s]. Our choice: two
variations of 60 s or four of 15 s."""
_GOAL_CANDIDATES, _GOAL_STEPS = 16 * GENERATION, 1_000_000
"""`CANDIDATES` and `MAX_STEPS` with a user-defined goal. Our choice: half a minute to a minute on one core."""
_GOAL_ELITE = 8
"""Maximum size of the elite in the search for a goal. Our choice: half a generation; with a quarter of all motions
played, as for the benchmark, the spread stayed as wide as that of random motions, and near misses were not improved."""
_GOAL_ASIDE = 3
"""One in this many motions is of the second-best kind. Our choice: enough for that kind to catch up within a search."""
_FEWEST = 4
"""A generation is not played if the budget leaves fewer motions than this. Our choice: fewer say nothing about a
kind."""


@dataclass(frozen=True)
class ProbePoint:
    """Progress of a running probe."""

    motions: int
    """Motions played so far for each unsolved variation."""
    candidates: int
    """Maximum number of motions for each variation."""
    solved: int
    """Number of variations in which some motion succeeded."""
    variations: int
    progress: float
    """Mean over the variations of the best motion's fitness, limited to 0 to 1."""


def probe_scene(
    scene: TaskScene,
    *,
    candidates: int | None = None,
    variations: int = VARIATIONS,
    first: int = 0,
    max_steps: int | None = None,
    longest_s: float = LONGEST_SEARCH_S,
    kinds: Sequence[MotionKind] = (),
    seed: int = 0,
    threads: int = 0,
    listen: Callable[[ProbePoint], None] = lambda _point: None,
) -> ProbeReport:
    """Probe a scene that is already loaded, in this process; see `aidsr.learn.openloop.probe`.

    The same scene, seed and limits give the same report, except for its wall time.

    Args:
        scene: The robot in the environment of its task.
        candidates: Motions tried for each variation, in whole generations of 16; default from `budget_for`.
        variations: Number of development variations; each is searched separately.
        first: Index of the first of these variations.
        max_steps: Physics steps of all simulations together, after which the search ends; default from `budget_for`. A
            part of them is reserved for playing the best motions to the end. The first few motions are played even
            where the budget is smaller. Where every best motion in every variation would take longer than 240 s of
            simulation, only those that succeed in their own variation are played in the others, in addition to these
            steps.
        longest_s: Maximum duration of a motion in the search [s].
        kinds: Kinds of motions that are tried; default from `kinds_for`.
        seed: Seed of the search.
        threads: Native threads; 0 takes all processors.
        listen: Called after each generation.

    Raises:
        UserError: A number is out of range.
    """
    usual_candidates, usual_steps = budget_for(scene.task, variations)
    candidates = usual_candidates if candidates is None else candidates
    max_steps = usual_steps if max_steps is None else max_steps
    if candidates < GENERATION or variations < 1 or max_steps < 1:
        raise UserError(
            f"the probe is too small: {candidates} candidates, {variations} variations, {max_steps} physics steps; use "
            f"at least {GENERATION}, 1 and 1"
        )
    began = time.monotonic()
    player = _Player(scene, longest_s, threads)
    searches = [
        _Search(index, scene.task.variation("development", index)) for index in range(first, first + variations)
    ]
    rng = np.random.default_rng(seed)
    ended_by = _search(player, searches, tuple(kinds) or kinds_for(scene.task), candidates, max_steps, rng, listen)
    found, same_motion_share = _play_finals(player, searches)
    best = max(found, key=lambda one: (one.episode.ended == "succeeded", one.episode.best_progress))
    return ProbeReport(
        task=scene.task.name,
        level=scene.task.level,
        benchmark_version=BENCHMARK_VERSION,
        seed=seed,
        candidates=candidates,
        max_steps=max_steps,
        ended_by=ended_by,
        searched_s=player.searched_s,
        motions=player.motions,
        played_steps=player.played_steps,
        simulated_s=round(player.played_steps * player.step_s, 3),
        wall_s=round(time.monotonic() - began, 2),
        variations=found,
        same_motion_share=same_motion_share,
        reached=best.episode.reached,
        hold_s=scene.task.hold_s,
        versions={"mujoco": mujoco.__version__},
    )


def budget_for(task: Task, variations: int = VARIATIONS) -> tuple[int, int]:
    """Return the default number of motions for each variation of a task, and of physics steps for all variations."""
    candidates, steps = (_GOAL_CANDIDATES, _GOAL_STEPS) if isinstance(task, GoalTask) else (CANDIDATES, MAX_STEPS)
    return candidates, max(steps, round(STEPS_PER_S * task.time_limit_s * variations))


def kinds_for(task: Task) -> tuple[MotionKind, ...]:
    """Return the default kinds of motions for a task."""
    if not isinstance(task, GoalTask):
        return MOTION_KINDS
    return TRAVELLING_KINDS if task.goal.robot_travels else WORKING_KINDS


@dataclass
class _Search:
    """Motions tried for one variation and their fitness, by kind."""

    index: int
    """Index of the development variation."""
    variation: Variation
    rows: dict[MotionKind, FloatArray] = field(default_factory=dict)
    fitness: dict[MotionKind, FloatArray] = field(default_factory=dict)
    solved: bool = False

    def add(self, kind: MotionKind, rows: FloatArray, fitness: FloatArray, *, solved: bool) -> None:
        """Add motions of a kind and their fitness."""
        self.rows[kind] = np.concatenate([self.rows[kind], rows]) if kind in self.rows else rows
        self.fitness[kind] = np.concatenate([self.fitness[kind], fitness]) if kind in self.fitness else fitness
        self.solved = self.solved or solved

    @property
    def best_kind(self) -> MotionKind:
        """Kind of the best motion so far."""
        return self.kinds[0]

    @property
    def kinds(self) -> list[MotionKind]:
        """Kinds of motions that were tried, the one with the best motion first."""
        return sorted(self.fitness, key=lambda kind: -self.fitness[kind].max())

    def has_played(self, kind: MotionKind, row: FloatArray) -> bool:
        """Whether a motion was already tried in this variation."""
        return kind in self.rows and bool((self.rows[kind] == row).all(axis=1).any())

    @property
    def best(self) -> FloatArray:
        """The best motion so far, of all kinds."""
        kind = self.best_kind
        return np.asarray(self.rows[kind][self.fitness[kind].argmax()])


class _Player:
    """Plays motions, each in its own variation, and counts the physics steps."""

    def __init__(self, scene: TaskScene, longest_s: float, threads: int) -> None:
        self.scene, self._threads = scene, threads
        self.searched_s = min(scene.task.time_limit_s, longest_s)
        self.space = MotionSpace(scene.actions.rest, self.searched_s)
        self.step_s = float(scene.model.opt.timestep)
        self.played_steps = 0
        self.motions = 0
        """Motions tried in the search for each unsolved variation."""

    def motions_of(self, rows: FloatArray) -> Motions:
        """Return the motions of rows of the search, as `MotionSpace.sample` returns them; with a goal, rounded.

        The reported motion is then exactly the one that succeeded. The motions of the benchmark are rounded only at the
        end, as they were when its figures were made.
        """
        motions = self.space.motions(rows)
        if not isinstance(self.scene.task, GoalTask):
            return motions
        names = [group.name for group in self.scene.actions.groups]
        still = motions.amplitude == 0.0
        first, last = (np.where(still, np.clip(ends, -1.0, 1.0), ends) for ends in (motions.first, motions.last))
        motions = replace(motions, first=first, change=last - first)
        rounded = Motions.of([motions.motion(index, names) for index in range(len(rows))])
        return replace(rounded, frequency_hz=rounded.frequency_hz[:, : motions.frequency_hz.shape[1]])

    def steps_of(self, time_s: float) -> int:
        """Return the number of physics steps in a time."""
        return round(time_s / self.step_s)

    def search(self, motions: Motions, variations: Sequence[Variation]) -> tuple[EpisodeOutcomes, FloatArray]:
        """Play equally many motions in each variation until they stall or solve it.

        Returns the outcomes and the fitness (n_motions,), -1 to 2.
        """
        owners = np.repeat(np.arange(len(variations)), len(motions.first) // len(variations))
        episodes = self._episodes([variations[owner] for owner in owners.tolist()])
        episodes.time_limit_s[:] = self.searched_s
        stop, task = EarlyStop(episodes, motions, owners), self.scene.task
        if not isinstance(task, GoalTask):
            outcomes = self._play(episodes, motions, stop)
            return outcomes, fitness_of(outcomes)
        sustained = SustainedProgress(task, episodes.n)

        def both(result: StepResult) -> None:
            stop(result)
            sustained(result)

        outcomes = self._play(episodes, motions, both)
        return outcomes, sustained.fitness(outcomes)

    def play(self, motions: Motions, variations: Sequence[Variation]) -> EpisodeOutcomes:
        """Play motions from beginning to end, one in each of the variations."""
        return self._play(self._episodes(variations), motions)

    def _episodes(self, variations: Sequence[Variation]) -> Episodes:
        return Episodes(self.scene.model, self.scene.task, self.scene.actions, variations, threads=self._threads)

    def _play(
        self, episodes: Episodes, motions: Motions, callback: Callable[[StepResult], None] = lambda _result: None
    ) -> EpisodeOutcomes:
        outcomes = rollout(episodes, OpenLoopPolicy(motions, self.scene.task.control_dt_s), callback)
        self.played_steps += self.steps_of(float(outcomes.time_s.sum()))
        return outcomes


def _search(
    player: _Player,
    searches: Sequence[_Search],
    kinds: tuple[MotionKind, ...],
    candidates: int,
    max_steps: int,
    rng: np.random.Generator,
    listen: Callable[[ProbePoint], None],
) -> EndedBy:
    """Search generation by generation: random motions of each kind first, then around the best of the best kind.

    Returns:
        Reason why the search ended.
    """
    has_goal = isinstance(player.scene.task, GoalTask)
    finals = len(searches) ** 2 if _plays_all_by_all(player, searches) else len(searches)
    max_steps -= finals * player.steps_of(player.scene.task.time_limit_s)
    for generation in range(candidates // GENERATION):
        unsolved = [search for search in searches if not search.solved]
        if not unsolved:
            return "solved"
        affordable = (max_steps - player.played_steps) // (len(unsolved) * player.steps_of(player.searched_s))
        count = min(GENERATION, max(affordable, 0 if generation else _FEWEST))
        if count < _FEWEST:
            return "budget"
        tried: list[tuple[_Search, MotionKind, FloatArray]] = []
        for search in unsolved:
            if generation < len(kinds):
                kind = kinds[generation]
                tried.append((search, kind, player.space.sample(kind, count, rng)))
            elif not has_goal:
                kind = search.best_kind
                known = search.rows[kind], search.fitness[kind]
                tried.append((search, kind, player.space.refine(*known, count, rng)))
            else:
                tried += _refined(player.space, search, searches, count, rng)
        motions = Motions.joined([player.motions_of(rows) for _, _, rows in tried])
        outcomes, fitness = player.search(motions, [search.variation for search in unsolved])
        begin = 0
        for search, kind, rows in tried:
            own = slice(begin, begin := begin + len(rows))
            search.add(kind, rows, fitness[own], solved=bool(outcomes.success[own].any()))
        best = [max(fitness.max() for fitness in search.fitness.values()) for search in searches]
        player.motions += count
        solved = sum(search.solved for search in searches)
        progress = float(np.clip(best, 0.0, 1.0).mean())
        listen(ProbePoint(player.motions, candidates, solved, len(searches), progress))
    if all(search.solved for search in searches):
        return "solved"
    return "candidates" if player.motions == candidates // GENERATION * GENERATION else "budget"


def _refined(
    space: MotionSpace, search: _Search, searches: Sequence[_Search], count: int, rng: np.random.Generator
) -> list[tuple[_Search, MotionKind, FloatArray]]:
    """Return motions for one variation of a goal: the best of the other variations, then those around its own best.

    Variations of a goal differ little, so a motion that solves one often solves the next. The kind of motion that leads
    after a few random motions may be unable to succeed, so some of the motions are of the second-best kind.
    """
    shared: list[tuple[_Search, MotionKind, FloatArray]] = []
    for other in searches:
        best = other.best_kind, other.best
        if other is not search and not search.has_played(*best) and len(shared) < count // 2:
            shared.append((search, best[0], best[1][None]))
    first, *second = search.kinds[:2]
    aside = (count - len(shared)) // _GOAL_ASIDE if second else 0
    parts = [(first, count - len(shared) - aside), *((kind, aside) for kind in second)]
    return [
        *shared,
        *(
            (search, kind, space.refine(search.rows[kind], search.fitness[kind], part, rng, most=_GOAL_ELITE))
            for kind, part in parts
            if part
        ),
    ]


def _plays_all_by_all(player: _Player, searches: Sequence[_Search]) -> bool:
    """Whether every best motion is played in every variation, also those that do not succeed in their own."""
    return len(searches) ** 2 * player.scene.task.time_limit_s <= _ALL_BY_ALL_S


def _play_finals(player: _Player, searches: Sequence[_Search]) -> tuple[tuple[ProbedVariation, ...], float]:
    """Play the best motion of each search to the end in its variation and in others, rounded as it is reported.

    Returns:
        The best motion for each variation, and the share of the variations that the best single motion solves.
    """
    names = [group.name for group in player.scene.actions.groups]
    rounded = [player.motions_of(search.best[None]).motion(0, names) for search in searches]
    numbers = range(len(searches))
    played: dict[tuple[int, int], tuple[EpisodeOutcomes, int]] = {}
    """Outcomes in which a motion was played in a variation, and the row there."""

    def play(pairs: Sequence[tuple[int, int]]) -> None:
        motions = Motions.of([rounded[motion] for motion, _ in pairs])
        outcomes = player.play(motions, [searches[variation].variation for _, variation in pairs])
        played.update({pair: (outcomes, row) for row, pair in enumerate(pairs)})

    play([(number, number) for number in numbers])
    all_by_all = _plays_all_by_all(player, searches)
    others = [
        (motion, variation)
        for motion in numbers
        for variation in numbers
        if motion != variation and (all_by_all or played[motion, motion][0].success[motion])
    ]
    if others:
        play(others)
    fitness = np.full((len(searches), len(searches)), -np.inf)
    success = np.zeros_like(fitness, dtype=np.bool_)
    for pair, (outcomes, row) in played.items():
        fitness[pair], success[pair] = fitness_of(outcomes)[row], outcomes.success[row]
    found = []
    for index, best in enumerate(fitness.argmax(axis=0).tolist()):
        outcomes, row = played[best, index]
        episode = outcomes.result(row, searches[index].index)
        found.append(ProbedVariation(episode=episode, family=searches[best].best_kind, motion=rounded[best]))
    return tuple(found), float(success.mean(axis=1).max())
