"""Trivial policies as a lower bound: how often a task is won by idle, constant, random or swinging actions.

The parameters of a policy are chosen on development variations; its successes are counted on held-out ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from itertools import combinations, product

import numpy as np
from numpy.typing import NDArray

from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.episodes.rollout import EpisodeOutcomes, Policy, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop.motion import GroupMotion, Motion, Motions, OpenLoopPolicy
from aidsr.tasks import Split, Task
from aidsr.tasks.readings import FloatArray

CONSTANTS = 27
"""Number of constant actions tried: all combinations of -1, 0 and 1 for up to three groups of actuators, or a random
sample of the same size from a larger grid."""
SCREENED, SCREEN_S = 2, 15.0
"""Number of development variations on which each candidate is screened first, and longest time of an episode [s]."""
FINALISTS, FINALS = 4, 4
"""Number of best candidates that reach the finals, and of further development variations on which these are played to
the end."""
HELD_S = 0.5
"""Time for which the slower of the two random policies holds an action [s]."""
QUICK_S = 0.04
"""Time for which the faster of the two random policies holds an action [s]: 25 Hz, for any control rate of the task."""
STRENGTHS = (0.4, 0.7, 1.0)
BEGIN_S = (0.0, 0.25, 0.5, 1.0, 2.0, 3.0)
PERIODS_S = {"locomotion": (0.5, 1.0, 2.0, 4.0), "manipulation": (2.0, 4.0, 8.0, 16.0)}
LAGS_DEG = (0, 60, 90, 120, 180, 270)
_RAMP_S, _SNAP_S = 2.0, 0.1
_BATCH = 96
"""Number of episodes simulated side by side."""
_STILL, _STILL_S = 1e-4, 2.0
"""Largest speed [m/s, rad/s] and time [s]. A scene whose every speed stays below the first for the second is taken to
stand still for good under a constant action."""


@dataclass(frozen=True)
class Candidate:
    """A motion, and its parameters in words."""

    words: str
    motion: Motion


@dataclass(frozen=True)
class Measured:
    """Results of a policy on held-out variations, and how it was chosen."""

    policy: str
    chosen: str
    tried: int
    development_wins: int
    development_episodes: int
    outcomes: EpisodeOutcomes


def measure(scene: TaskScene, policies: Sequence[str], episodes: int, threads: int) -> Iterator[Measured]:
    """Play the named policies (see `POLICIES`) one after the other on the first held-out variations of a task."""
    for name in policies:
        yield POLICIES[name](scene, name, episodes, threads)


def idle(scene: TaskScene) -> list[Candidate]:
    """Return the motion whose controls are nearest to 0."""
    return [Candidate("", _motion(scene, first=scene.actions.rest))]


def constants(scene: TaskScene) -> list[Candidate]:
    """Return constant actions: the whole grid of -1, 0 and 1 if it is small, otherwise a fixed sample of it."""
    k = scene.actions.size
    if 3**k <= CONSTANTS:
        grid = [np.array(values) for values in product((-1.0, 0.0, 1.0), repeat=k)]
    else:
        rng = np.random.default_rng(0)
        grid = list({tuple(row): row for row in rng.integers(-1, 2, (4 * CONSTANTS, k)).astype(float)}.values())
    return [Candidate(" ".join(f"{v:+g}" for v in row), _motion(scene, first=row)) for row in grid[:CONSTANTS]]


def rules(scene: TaskScene) -> list[Candidate]:
    """Return a family of motions with two parameters; the family depends on the task's category."""
    category = scene.task.name.partition("/")[0]
    if category in PERIODS_S:
        return [_swing(scene, period_s, lag) for period_s, lag in product(PERIODS_S[category], LAGS_DEG)]
    if category == "grasping":
        return [_pull(scene, members, 1.0, begin_s) for members, begin_s in product(_directions(scene), BEGIN_S)]
    return [_pull(scene, members, strength, 0.0) for members, strength in product(_directions(scene), STRENGTHS)]


def _swing(scene: TaskScene, period_s: float, lag_deg: int) -> Candidate:
    """Return sinusoidal motions of all groups, each with a phase lag relative to the group before."""
    phases = -np.deg2rad(lag_deg) * np.arange(scene.actions.size)
    return Candidate(
        f"period {period_s:g} s, lag {lag_deg} deg", _motion(scene, amplitude=1.0, phases=phases, period_s=period_s)
    )


def _pull(scene: TaskScene, members: tuple[int, ...], strength: float, begin_s: float) -> Candidate:
    """Return a pull of some groups, while the actuators of a mount move to the upper ends of their ranges."""
    first, last = scene.actions.rest, scene.actions.rest.copy()
    names = [group.name.removeprefix("robot/") for group in scene.actions.groups]
    for k in members:
        last[k] = first[k] + strength * ((1.0 if first[k] <= 0.0 else -1.0) - first[k])
    for k, name in enumerate(names):
        last[k] = 1.0 if name in scene.task.policy_actuators else last[k]
    grasps = scene.task.name.startswith("grasping/")
    how = f"from {begin_s:g} s" if grasps else f"strength {strength:g}"
    pulled = _motion(scene, first=first, last=last, begin_s=begin_s, ramp_s=_SNAP_S if grasps else _RAMP_S)
    return Candidate(f"{' '.join(names[k] for k in members)} {how}", pulled)


def _directions(scene: TaskScene) -> list[tuple[int, ...]]:
    """Return the sets of the robot's groups that are pulled together.

    With up to three groups all subsets; with more, each single group, all groups, and all groups but one.
    """
    own = [k for k, group in enumerate(scene.actions.groups) if group.name not in scene.task.policy_actuators]
    few = range(1, len(own) + 1) if len(own) <= 3 else (1, len(own) - 1, len(own))
    return [members for count in few for members in combinations(own, count)]


def _motion(
    scene: TaskScene,
    *,
    first: FloatArray | None = None,
    last: FloatArray | None = None,
    amplitude: float = 0.0,
    phases: FloatArray | None = None,
    period_s: float = 1.0,
    begin_s: float = 0.0,
    ramp_s: float = 1.0,
) -> Motion:
    k = scene.actions.size
    first = np.zeros(k) if first is None else first
    columns = zip(first, first if last is None else last, np.zeros(k) if phases is None else phases, strict=True)
    groups = tuple(
        GroupMotion(group=group.name, first=start, last=end, amplitude=amplitude, phase_rad=phase)
        for group, (start, end, phase) in zip(scene.actions.groups, columns, strict=True)
    )
    return Motion(begin_s=begin_s, ramp_s=ramp_s, frequency_hz=1.0 / period_s, groups=groups)


class RandomPolicy:
    """Uniform random actions, each held for some time. An episode's actions depend only on its number.

    Args:
        task: Task, which defines the control rate and the length of episodes.
        k: Number of values in an action.
        held_s: Time for which an action is held [s].
        episodes: Numbers of the episodes.
    """

    def __init__(self, task: Task, k: int, held_s: float, episodes: Sequence[int]) -> None:
        self._every = max(1, round(held_s / task.control_dt_s))
        steps = int(task.time_limit_s / task.control_dt_s) // self._every + 2
        self._actions = np.stack([np.random.default_rng([0, i]).uniform(-1.0, 1.0, (steps, k)) for i in episodes])
        self._steps = 0

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return the next actions, (n, k)."""
        del observation
        self._steps += 1
        return np.asarray(self._actions[:, (self._steps - 1) // self._every])


def _best_of(family: Callable[[TaskScene], list[Candidate]]) -> Callable[[TaskScene, str, int, int], Measured]:
    def measured(scene: TaskScene, name: str, count: int, threads: int) -> Measured:
        candidates = family(scene)
        best, won, played = _choose(scene, candidates, threads)
        outcomes = play_motions(scene, [best.motion] * count, "held_out", range(count), threads)
        return Measured(name, best.words, len(candidates), won, played, outcomes)

    return measured


def _random(held_s: float) -> Callable[[TaskScene, str, int, int], Measured]:
    def measured(scene: TaskScene, name: str, count: int, threads: int) -> Measured:
        policy = RandomPolicy(scene.task, scene.actions.size, held_s, range(count))
        return Measured(name, "", 1, 0, 0, play(scene, policy, "held_out", range(count), threads))

    return measured


POLICIES: dict[str, Callable[[TaskScene, str, int, int], Measured]] = {
    "idle": _best_of(idle),
    "constant": _best_of(constants),
    "random 25 Hz": _random(QUICK_S),
    "random 0.5 s": _random(HELD_S),
    "rule": _best_of(rules),
}
"""The policies by their names in the table. Each takes a scene, its name, the number of held-out episodes, and the
number of threads."""
UNTRAINED = tuple(name for name in POLICIES if name != "rule")
"""Policies that nobody wrote for the task."""


def _choose(scene: TaskScene, candidates: Sequence[Candidate], threads: int) -> tuple[Candidate, int, int]:
    """Return the best candidate on development variations, its number of successes there, and the number of episodes.

    Candidates are ranked by successes, then by mean best progress. Screening cuts long episodes short; the finals do
    not.
    """
    if len(candidates) == 1:
        return candidates[0], 0, 0
    screened = _success_and_progress(scene, candidates, range(SCREENED), threads, SCREEN_S)
    last = [candidates[i] for i in _best_first(screened)[:FINALISTS]]
    final = _success_and_progress(scene, last, range(SCREENED, SCREENED + FINALS), threads)
    best = _best_first(final)[0]
    return last[best], round(final[best, 0] * FINALS), FINALS


def _best_first(scores: FloatArray) -> list[int]:
    return sorted(range(len(scores)), key=lambda i: tuple(-scores[i]))


def _success_and_progress(
    scene: TaskScene, candidates: Sequence[Candidate], indices: range, threads: int, most_s: float = np.inf
) -> FloatArray:
    """Return success and best progress as means over development variations, (candidates, 2)."""
    motions = [one.motion for one in candidates for _ in indices]
    outcomes = play_motions(scene, motions, "development", [*indices] * len(candidates), threads, most_s)
    both = np.stack([outcomes.success, outcomes.best_progress], axis=1)
    return np.asarray(both.reshape(len(candidates), len(indices), 2).mean(axis=1))


def play_motions(
    scene: TaskScene,
    motions: Sequence[Motion],
    split: Split,
    indices: Sequence[int],
    threads: int,
    most_s: float = np.inf,
) -> EpisodeOutcomes:
    """Play open-loop motions, each on one variation.

    Args:
        scene: The scene.
        motions: Motions, one for each episode.
        split: Split of the variations.
        indices: Numbers of the variations, one for each episode.
        threads: Native threads for physics; 0 takes all processors.
        most_s: Time after which episodes are cut off [s].
    """

    def part(rows: slice) -> EpisodeOutcomes:
        policy = OpenLoopPolicy(Motions.of(motions[rows]), scene.task.control_dt_s)
        constant = not any(g.amplitude or g.first != g.last for motion in motions[rows] for g in motion.groups)
        return play(scene, policy, split, indices[rows], threads, most_s, constant=constant)

    parts = [part(slice(i, i + _BATCH)) for i in range(0, len(motions), _BATCH)]
    return EpisodeOutcomes(*(np.concatenate([getattr(one, f.name) for one in parts]) for f in fields(EpisodeOutcomes)))


def play(
    scene: TaskScene,
    policy: Policy,
    split: Split,
    indices: Sequence[int],
    threads: int,
    most_s: float = np.inf,
    *,
    constant: bool = False,
) -> EpisodeOutcomes:
    """Play a policy on variations of a scene's task.

    Args:
        scene: The scene.
        policy: Policy that acts on all episodes side by side.
        split: Split of the variations.
        indices: Numbers of the variations.
        threads: Native threads for physics; 0 takes all processors.
        most_s: Time after which episodes are cut off [s].
        constant: Whether the policy never changes its actions. If so, episodes end once everything stands still.
    """
    drawn = [scene.task.variation(split, index) for index in indices]
    episodes = Episodes(scene.model, scene.task, scene.actions, drawn, threads=threads)
    episodes.time_limit_s[:] = np.minimum(episodes.time_limit_s, most_s)
    still_s = np.zeros(episodes.n)

    def end_the_still(result: StepResult) -> None:
        moving = np.abs(episodes.batch.bind("qvel")).max(axis=1) > _STILL
        still_s[:] = np.where(moving, 0.0, still_s + scene.task.control_dt_s)
        done = still_s > max(_STILL_S, scene.task.hold_s + scene.task.control_dt_s)
        episodes.time_limit_s[done] = result.time_s[done]

    # a task with its own script may start moving again
    ends = constant and type(scene.task).script is Task.script
    return rollout(episodes, policy, end_the_still if ends else lambda _result: None)
