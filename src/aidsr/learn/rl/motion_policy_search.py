"""Search for a motion with feedback that wins many variations: random motions first, then CMA-ES on the best.

Most jobs of the benchmark are done by one motion for each variation. This finds one motion for all of them, and how it
has to follow what the task lets a policy observe. A policy of a few dozen numbers is searched by whole episodes, so
noise in single actions, which soft bodies filter out, plays no part.

Source: Mania et al. 2018, "Simple random search of static linear policies is competitive for reinforcement learning";
Ros and Hansen 2008, "A simple modification in CMA-ES achieving linear time and space complexity".
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.episodes.rollout import EpisodeOutcomes, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop.motion import Motions
from aidsr.learn.openloop.motion_search import MOTION_KINDS, MotionSpace
from aidsr.learn.openloop.probe_scene import LONGEST_SEARCH_S, fitness_of
from aidsr.learn.rl.feedback_motion import FeedbackMotion, FeedbackMotions
from aidsr.tasks import Variation
from aidsr.tasks.readings import FloatArray

_SCREENED = 12
"""Random motions of each kind, each played in two variations."""
_SCREENING_VARIATIONS = 2
_FINALISTS = 4
"""The best of these, played in four more."""
_POPULATION = 12
"""Candidates of a generation of CMA-ES, each played in the same four fresh variations."""
_VARIATIONS = 4
_DECIDING_VARIATIONS = 8
"""On which a generation's mean and best are compared with the best so far; always the same ones."""
_MORE_VARIATIONS = 16
"""Added to them when all are won."""
_GAIN = 0.01
"""Of progress: an episode ends when its best has not grown by so much for the hold of its task and a while longer."""
_LEAST_STD = 1e-3
"""Of a feature: what hardly differs is no reason to act."""
_WHILE_S = 1.5
"""Of a motion whose ramp is over; one period longer if it swings."""
_SPREAD = 0.3
"""Of the numbers of a motion at the start, in actions and in logarithms of times."""
_GAIN_SPREAD = 0.15
"""Of the gains: actions for each standard deviation of a feature."""
_PATIENCE = 3
"""Generations without a better one, after which the search begins again about the best with half the spread."""
_PROMISING, _TRIAL_SHARE = 0.5, 0.4
"""A search ends where random motions win none of the deciding variations and come less far than the first number; and
with the second part of its budget where it wins a smaller share of them than the first number. What a motion cannot do
is left to PPO, with most of the budget."""
_WORTH_CORRECTING = 0.25
"""Share of the deciding variations from which a motion is a better beginning than none. Our choice, not tuned."""
_LEAST_SPREAD = 0.25
"""Share of the usual spread, with which a search that finds nothing better ends: more of its budget is left to PPO."""


@dataclass(frozen=True)
class SearchState:
    """The best motion so far, and what it took."""

    motion: FeedbackMotion
    steps: int
    """Control steps of all simulations together."""
    episodes: int
    diverged: int
    """Of these episodes."""
    success: float
    """Share of the deciding variations that it wins."""
    progress: float
    """Its mean best progress there."""
    reward: float
    """Mean of its returns there."""

    @property
    def is_worth_correcting(self) -> bool:
        """Whether PPO shall begin with the motion; else it learns from nothing."""
        return self.success >= _WORTH_CORRECTING


def least_steps(scene: TaskScene) -> int:
    """Return the control steps that random motions alone may take; with fewer there is no search."""
    episodes = len(MOTION_KINDS) * _SCREENED * _SCREENING_VARIATIONS + _FINALISTS * _VARIATIONS
    return round(episodes * _longest_s(scene) / scene.task.control_dt_s)


def _longest_s(scene: TaskScene) -> float:
    """Return how long a motion is played while many are compared [s]."""
    return min(scene.task.time_limit_s, LONGEST_SEARCH_S)


def search_motion_policy(
    scene: TaskScene,
    sample_variation: Callable[[], Variation],
    *,
    steps: int,
    saturation: float,
    rng: np.random.Generator,
    threads: int = 0,
    smoothing: float = 0.0,
    listen: Callable[[SearchState], bool] = lambda _state: True,
) -> SearchState:
    """Return the best motion with feedback that is found.

    The same scene, variations, budget and generator give the same motion on any number of threads.

    Args:
        scene: The body in the environment of its task.
        sample_variation: Returns the variation of a new episode.
        steps: Control steps of all simulations together; the generation that is being played is played to its end.
        saturation: Share of variations that is enough.
        rng: Draws the motions.
        threads: Native threads; 0 takes all processors.
        smoothing: Share of the previous action that is kept in the next.
        listen: Called with the best motion after each generation; the search ends where it returns False.
    """
    player = _Player(scene, sample_variation, threads, smoothing)
    best, kind_rows = _screened(player, rng)
    spread, waited, evolution = 1.0, 0, None
    while True:
        if best.success >= saturation and len(player.deciding) == _DECIDING_VARIATIONS:
            player.deciding += player.variations(_MORE_VARIATIONS)
            best = player.decided(best.row, best.gains)
        goes_on = listen(best.state(player))
        if not goes_on or best.success >= saturation or player.steps >= steps:
            return best.state(player)
        if best.success == 0.0 and best.progress < _PROMISING:
            return best.state(player)
        if best.success < _PROMISING and player.steps >= _TRIAL_SHARE * steps:
            return best.state(player)
        if waited == _PATIENCE and spread <= _LEAST_SPREAD:
            return best.state(player)
        if evolution is None or waited == _PATIENCE:
            spread, waited = (spread if evolution is None else spread / 2), 0
            evolution = _Evolution(best, kind_rows, spread, rng)
        better = evolution.generation(player)
        waited = 0 if better.fitness > best.fitness else waited + 1
        best = max(best, better, key=lambda one: one.fitness)


@dataclass(frozen=True)
class _Best:
    """A motion with feedback as numbers, and how it fared in the deciding variations."""

    row: FloatArray
    gains: FloatArray
    outcomes: EpisodeOutcomes
    motion: FeedbackMotion

    @property
    def fitness(self) -> float:
        return float(fitness_of(self.outcomes).mean())

    @property
    def success(self) -> float:
        return float(self.outcomes.success.mean())

    @property
    def progress(self) -> float:
        return float(self.outcomes.best_progress.mean())

    def state(self, player: _Player) -> SearchState:
        return SearchState(
            motion=self.motion,
            steps=player.steps,
            episodes=player.episodes,
            diverged=player.diverged,
            success=self.success,
            progress=self.progress,
            reward=float(self.outcomes.reward.mean()),
        )


class _Player:
    """Plays motions with feedback in variations, and counts what that takes."""

    def __init__(
        self, scene: TaskScene, sample_variation: Callable[[], Variation], threads: int, smoothing: float
    ) -> None:
        self.scene, self._threads, self._smoothing = scene, threads, smoothing
        self._sample = sample_variation
        self.searched_s = _longest_s(scene)
        self.space = MotionSpace(scene.actions.rest, self.searched_s)
        self.features = sum(feature.size for feature in scene.task.features)
        self.mean, self.std = np.zeros(self.features), np.ones(self.features)
        self._seen: list[NDArray[np.floating]] | None = []
        self.steps = self.episodes = self.diverged = 0
        self.deciding = self.variations(_DECIDING_VARIATIONS)

    def variations(self, count: int) -> list[Variation]:
        """Return fresh variations."""
        return [self._sample() for _ in range(count)]

    def motions(self, rows: FloatArray, gains: FloatArray) -> FeedbackMotions:
        """Return motions with feedback, from rows of numbers and gains, (n, k, f)."""
        return FeedbackMotions(self.space.motions(rows), gains, self.mean, self.std)

    def fitness(self, motions: FeedbackMotions, variations: Sequence[Variation]) -> FloatArray:
        """Return the mean fitness of each of n motions over some variations, cut short as in a probe, (n,)."""
        outcomes = self.play(motions, variations, self.searched_s)
        return np.asarray(fitness_of(outcomes).reshape(-1, len(variations)).mean(axis=1))

    def normalise(self) -> None:
        """Take mean and deviation of the features from all that was seen so far, and from now on no more."""
        assert self._seen, "motions are played first"
        seen = np.concatenate(self._seen)
        self.mean, self.std, self._seen = seen.mean(axis=0), seen.std(axis=0) + _LEAST_STD, None

    def play(self, motions: FeedbackMotions, variations: Sequence[Variation], longest_s: float) -> EpisodeOutcomes:
        """Play each motion in all variations, (n_motions x n_variations,)."""
        scene, count = self.scene, len(motions.gains)
        each = motions.repeated(len(variations))
        actions = dataclasses.replace(scene.actions, base=each)
        episodes = Episodes(
            scene.model, scene.task, actions, [*variations] * count, threads=self._threads, smoothing=self._smoothing
        )
        episodes.time_limit_s = np.minimum(episodes.time_limit_s, longest_s)
        idle = IdlePolicy(scene.actions.size)
        outcomes = rollout(episodes, idle, _Impatience(episodes, each.motions))
        self.steps += round(float(outcomes.time_s.sum()) / scene.task.control_dt_s)
        self.episodes += episodes.n
        self.diverged += int(outcomes.diverged.sum())
        if self._seen is not None:
            self._seen += [seen[:, -self.features :] for seen in idle.seen]
        return outcomes

    def decided(self, row: FloatArray, gains: FloatArray) -> _Best:
        """Play a motion, rounded as it is kept, in the deciding variations."""
        names = [group.name for group in self.scene.actions.groups]
        motion = self.motions(row[None], gains[None]).one(0, names)
        outcomes = self.play(FeedbackMotions.of(motion), self.deciding, self.scene.task.time_limit_s)
        return _Best(row, gains, outcomes, motion)


class _Impatience:
    """Ends episodes in which nothing is gained any more; a callback for every control step.

    Args:
        episodes: Just reset.
        motions: What each plays.
    """

    def __init__(self, episodes: Episodes, motions: Motions) -> None:
        swings, ramps = motions.amplitude.any(axis=1), motions.change.any(axis=1)
        self._episodes = episodes
        period_s = np.where(swings, 1.0 / motions.frequency_hz.min(axis=1), 0.0)
        self._patience_s = episodes.task.hold_s + _WHILE_S + period_s
        self._gained_s = np.where(ramps, motions.begin_s + motions.ramp_s, 0.0)
        self._best = np.zeros(episodes.n)

    def __call__(self, result: StepResult) -> None:
        """End the episodes that have stalled."""
        gained = result.progress >= self._best + _GAIN
        self._best = np.where(gained, result.progress, self._best)
        self._gained_s = np.where(gained, np.maximum(result.time_s, self._gained_s), self._gained_s)
        self._episodes.running = self._episodes.running & (result.time_s - self._gained_s <= self._patience_s)


class IdlePolicy:
    """Adds nothing to the base motion, and remembers what it saw.

    Args:
        n_actions: Numbers in an action.
    """

    def __init__(self, n_actions: int) -> None:
        self._n_actions = n_actions
        self.seen: list[NDArray[np.floating]] = []

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return zeros, (n, n_actions)."""
        self.seen.append(observation)
        return np.zeros((len(observation), self._n_actions))


def _screened(player: _Player, rng: np.random.Generator) -> tuple[_Best, FloatArray]:
    """Return the best of random motions without feedback, and the random motions of its kind."""
    rows = np.concatenate([player.space.sample(kind, _SCREENED, rng) for kind in MOTION_KINDS])
    no_gains = np.zeros((len(rows), player.scene.actions.size, player.features))
    variations = player.variations(_SCREENING_VARIATIONS)
    outcomes = player.play(player.motions(rows, no_gains), variations, player.searched_s)
    fitness = fitness_of(outcomes).reshape(len(rows), -1).mean(axis=1)
    finalists = np.argsort(-fitness, kind="stable")[:_FINALISTS]
    again = player.fitness(player.motions(rows[finalists], no_gains[finalists]), player.variations(_VARIATIONS))
    winner = int(finalists[(fitness[finalists] * _SCREENING_VARIATIONS + again * _VARIATIONS).argmax()])
    kind = winner // _SCREENED
    best = player.decided(rows[winner], no_gains[winner])
    player.normalise()  # no feedback yet, so the best stays as it is
    return best, rows[kind * _SCREENED : (kind + 1) * _SCREENED]


class _Evolution:
    """CMA-ES with a diagonal covariance about a motion with feedback.

    Args:
        about: The motion.
        kind_rows: Random motions of its kind; a number in which they do not differ is none of the kind's.
        spread: Standard deviation at the start, as a share of the usual one.
        rng: Draws the candidates.
    """

    def __init__(self, about: _Best, kind_rows: FloatArray, spread: float, rng: np.random.Generator) -> None:
        from cma import CMAEvolutionStrategy

        self._about, self._free = about, np.ptp(kind_rows, axis=0) > 0.0
        self._moving = int(self._free.sum())
        spreads = [np.full(self._moving, _SPREAD), np.full(about.gains.size, _GAIN_SPREAD)]
        self._scale = np.concatenate(spreads)
        options = {
            "popsize": _POPULATION,
            "CMA_diagonal": True,
            "verbose": -9,
            "seed": np.nan,  # leaves the global generator of NumPy alone
            "randn": lambda *size: rng.standard_normal(size),
        }
        start = np.concatenate([about.row[self._free], about.gains.ravel()]) / self._scale
        self._strategy = CMAEvolutionStrategy(start, spread, options)

    def generation(self, player: _Player) -> _Best:
        """Play a generation; return the better of its mean and its best candidate."""
        points = np.array(self._strategy.ask())
        fitness = player.fitness(player.motions(*self._decoded(points)), player.variations(_VARIATIONS))
        self._strategy.tell(points, (-fitness).tolist())
        rows, gains = self._decoded(np.array([self._strategy.mean, points[fitness.argmax()]]))
        return max((player.decided(*one) for one in zip(rows, gains, strict=True)), key=lambda one: one.fitness)

    def _decoded(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return points of the search as rows of motions and gains, (n, 4 k + 3) and (n, k, f)."""
        numbers = points * self._scale
        rows = np.repeat(self._about.row[None], len(points), axis=0)
        rows[:, self._free] = numbers[:, : self._moving]
        return rows, numbers[:, self._moving :].reshape(-1, *self._about.gains.shape)
