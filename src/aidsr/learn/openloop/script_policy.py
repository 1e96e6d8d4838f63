"""Playing of a motion script in parallel episodes; in each of them, what is observed decides between its blocks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from aidsr.core.errors import UserError
from aidsr.core.formatting import excerpt
from aidsr.core.suggestions import closest_name
from aidsr.learn.openloop.script import OTHERS, Block, Script, Track, parse_script
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.tasks import Feature
from aidsr.tasks.feature_numbers import features_in_words
from aidsr.tasks.readings import FloatArray

if TYPE_CHECKING:
    from aidsr.learn.episodes.scene import TaskScene

_ROUNDING = 1e-6


@dataclass(frozen=True)
class PlayedBlock:
    """A block of a script in a scene."""

    block: Block
    title: str
    """Number and condition of the block, such as "block 1 (f7 > 0)"; "" in a script without blocks."""
    tracks: tuple[Track, ...]
    """Tracks, one for each number of an action."""
    unnamed: tuple[str, ...]
    """Groups that the block does not name; they stay at rest."""

    def at(self, time_s: FloatArray | float) -> FloatArray:
        """Return the action at a time since the block began, (k,), or at several, (n,) -> (n, k)."""
        return np.stack([track.at(time_s) for track in self.tracks], axis=-1)

    def cut_off(self, groups: Sequence[str], times_s: FloatArray) -> list[str]:
        """Return a clause for each group whose requested action exceeds -1 or 1 at some of the times."""
        clauses = []
        for name, track in zip(groups, self.tracks, strict=True):
            requested = track.unclipped(times_s)
            beyond = np.abs(requested) > 1.0 + _ROUNDING
            if beyond.any():
                farthest = float(requested[np.abs(requested).argmax()])
                clauses.append(
                    f"{f'in {self.title}, ' if self.title else ''}{name.removeprefix(ROBOT_PREFIX)} is asked for "
                    f"{farthest:+.3g}, cut off at {math.copysign(1, farthest):+g}, {beyond.mean():.0%} of the time"
                )
        return clauses


@dataclass(frozen=True)
class BlockStart:
    """Beginning of a block in an episode."""

    title: str
    time_s: float
    """Time since the beginning of the episode [s]."""
    features: tuple[float, ...]
    """The task's features at this time."""


class ScriptPlayback:
    """Plays a script in n parallel episodes and keeps for each of them the block and the time at which it began.

    Args:
        blocks: Blocks of the script, the last one without conditions.
        features: Number of the task's features, the last numbers of an observation.
        n: Number of episodes.
    """

    def __init__(self, blocks: Sequence[PlayedBlock], features: int, n: int) -> None:
        self._blocks, self._features = tuple(blocks), features
        self._durations_s = np.array([each.block.duration_s for each in blocks])
        self._playing = np.zeros(n, dtype=np.intp)
        self._began_s = np.zeros(n)
        self.starts: list[list[BlockStart]] = [[] for _ in range(n)]
        """Blocks that were played in each present episode, in order."""

    def at(self, time_s: FloatArray, observation: NDArray[np.floating]) -> FloatArray:
        """Return the actions of the present control step, (n, k), -1 to 1.

        Args:
            time_s: Time since the beginning of each episode, (n,) [s]; an episode begins anew where it is 0.
            observation: Present observations, (n, n_observations).
        """
        is_over = time_s - self._began_s >= self._durations_s[self._playing] - _ROUNDING
        if (rows := np.flatnonzero((time_s == 0.0) | is_over)).size:
            self._choose(rows, time_s, observation[:, observation.shape[1] - self._features :])
        action = np.empty((len(time_s), len(self._blocks[0].tracks)))
        for index in np.unique(self._playing):
            here = self._playing == index
            action[here] = self._blocks[index].at((time_s - self._began_s)[here])
        return action

    def _choose(self, rows: NDArray[np.intp], time_s: FloatArray, features: NDArray[np.floating]) -> None:
        """Begin the first block whose conditions hold, in the given episodes."""
        holds = np.array([each.block.holds(features[rows]) for each in self._blocks])
        self._playing[rows], self._began_s[rows] = holds.argmax(axis=0), time_s[rows]
        for row in rows.tolist():
            if time_s[row] == 0.0:
                self.starts[row].clear()
            title = self._blocks[self._playing[row]].title
            self.starts[row].append(BlockStart(title, float(time_s[row]), tuple(features[row].tolist())))


class ScriptPolicy:
    """Plays a script in n parallel episodes from their start; what is observed decides only between its blocks.

    Args:
        blocks: Blocks of the script in the scene.
        control_dt_s: Time between two actions [s].
        features: Number of the task's features.
    """

    def __init__(self, blocks: Sequence[PlayedBlock], control_dt_s: float, features: int) -> None:
        self.blocks, self.control_dt_s, self._features = tuple(blocks), control_dt_s, features
        self._played: ScriptPlayback | None = None
        self._steps = 0

    def playback(self, n: int) -> ScriptPlayback:
        """Return the script in n parallel episodes, with a state of its own."""
        return ScriptPlayback(self.blocks, self._features, n)

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return the next action for each observation, (n, k)."""
        self._played = self._played or self.playback(len(observation))
        self._steps += 1
        return self._played.at(np.full(len(observation), (self._steps - 1) * self.control_dt_s), observation)

    @property
    def starts(self) -> tuple[BlockStart, ...]:
        """Blocks that were played in the first episode, in order; empty for a script without blocks."""
        return tuple(start for start in self._played.starts[0] if start.title) if self._played else ()

    @property
    def unnamed(self) -> dict[str, tuple[str, ...]]:
        """Groups that are not named and stay at rest, by "the script" or, where blocks differ, the block's title."""
        if len({each.unnamed for each in self.blocks}) == 1:
            return {"the script": self.blocks[0].unnamed}
        return {each.title: each.unnamed for each in self.blocks}

    def cut_off(self, groups: Sequence[str], until_s: float) -> tuple[str, ...]:
        """Return a clause for each group, in each block, whose requested action exceeds -1 or 1 and is clipped.

        Args:
            groups: Names of the groups, one for each number of an action.
            until_s: Duration of the motion [s].
        """
        clauses = []
        for each in self.blocks:
            steps = max(1, round(min(until_s, each.block.duration_s) / self.control_dt_s))
            clauses += each.cut_off(groups, self.control_dt_s * np.arange(steps, dtype=np.float64))
        return tuple(clauses)


def script_policy(scene: TaskScene, script: str | Script) -> ScriptPolicy:
    """Return a policy that plays a script in a scene from the start of an episode.

    Args:
        scene: The scene.
        script: The script, or its text.

    Raises:
        UserError: The text is not a script, or names a group or a feature that the scene does not have.
    """
    read = parse_script(script) if isinstance(script, str) else script
    names = [group.name for group in scene.actions.groups]
    return played_by(read, names, scene.actions.rest, scene.task.control_dt_s, scene.task.features)


def played_by(
    script: Script,
    groups: Sequence[str],
    rest: FloatArray,
    control_dt_s: float,
    features: Sequence[Feature] = (),
) -> ScriptPolicy:
    """Return a policy that plays a script.

    Args:
        script: The script.
        groups: Names of all groups of the scene, one for each number of an action; the prefix "robot/" may be left out.
        rest: Action of each group at rest, (k,).
        control_dt_s: Time between two actions [s].
        features: Features of the task.

    Raises:
        UserError: The script names a group or a feature that does not exist.
    """
    size = sum(feature.size for feature in features)
    for block in script.blocks:
        for condition in block.conditions:
            if not 1 <= condition.feature <= size:
                seen = f"it observes {features_in_words(features)}" if size else "it observes nothing: leave out blocks"
                raise UserError(f"line {block.line} of the script: the job has no f{condition.feature}; {seen}")
    blocks = [_played(block, number, groups, rest) for number, block in enumerate(script.blocks, 1)]
    return ScriptPolicy(blocks, control_dt_s, size)


def _played(block: Block, number: int, groups: Sequence[str], rest: FloatArray) -> PlayedBlock:
    """Return a block with a track for each group.

    Raises:
        UserError: The block names a group that does not exist.
    """
    plain = [name.removeprefix(ROBOT_PREFIX) for name in groups]
    tracks = {name.removeprefix(ROBOT_PREFIX): track for name, track in block.tracks.items()}
    title = f"block {number} ({block.heading})" if block.heading else ""
    for name in tracks:
        if name != OTHERS and name not in plain:
            near = closest_name(name, plain)
            hint = f' Did you mean "{near}"?' if near else ""
            where = f"{title} of the script: " if title else ""
            raise UserError(f'{where}no group "{excerpt(name)}" in this scene.{hint} Its groups: {", ".join(plain)}')
    others = tracks.get(OTHERS)
    return PlayedBlock(
        block,
        title,
        tuple(
            tracks.get(name) or others or Track(((0.0, float(at_rest)),))
            for name, at_rest in zip(plain, rest, strict=True)
        ),
        unnamed=() if others else tuple(name for name in plain if name not in tracks),
    )
