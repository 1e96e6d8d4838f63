"""Callback of a training: learning curve, checkpoints, and tests for saturation."""

from __future__ import annotations

import csv
import time
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from aidsr.learn.episodes.rollout import EpisodeOutcomes
from aidsr.learn.rl.curve_point import CurvePoint
from aidsr.learn.rl.recipe import Recipe, is_hopeless
from aidsr.learn.rl.training_folder import CURVE_FILE, TrainingFolder

_RECENT, _RECENT_NOISELESS = 100, 20
"""Number of episodes over which success is averaged. Our choice: its standard error is then at most 0.05. Fewer of
those without noise are averaged, because there are fewer and a policy that learns quickly soon differs from the
averaged one."""
_POINTS = 100
"""Number of points of a learning curve."""
_CHECKPOINTS = 20
"""Number of checkpoints over the whole budget."""
_SEEMS_SATURATED = 0.9
"""Success share of recent episodes from which a test for saturation is worth its time."""
_NOISELESS_TESTS = 20
"""Maximum number of tests over the whole budget, where their steps count towards the budget."""
_TEST_SPACING = 4
"""Steps of learning before the next test, for each step that the last test took. Our choice: tests take a fifth of the
steps at most."""


@dataclass
class History:
    """Counts since training began, over all its processes."""

    steps: int = 0
    wall_s: float = 0.0
    episodes: int = 0
    diverged: int = 0
    won: int = 0
    """Number of successful episodes, among those that measure the policy's performance."""
    resumed: int = 0
    """Number of processes after the first; a process that was killed before its first checkpoint does not count."""
    recent: deque[tuple[float, float, float]] = field(default_factory=lambda: deque(maxlen=_RECENT))
    """Success, progress and return of the last episodes that measure the policy's performance."""
    best_share: float = 0.0
    """Largest success share of that many recent episodes so far."""

    @classmethod
    def of(cls, recipe: Recipe) -> History:
        """Return the history of a training that has not begun."""
        return cls(recent=deque(maxlen=_RECENT if recipe.algorithm == "ppo" else _RECENT_NOISELESS))

    def count(self, info: dict[str, Any], *, measures: bool = True) -> None:
        """Count an episode that has ended.

        Args:
            info: Info of its last step.
            measures: Whether the episode measures the policy's performance.
        """
        self.episodes += 1
        self.diverged += info["diverged"]
        if measures:
            self.won += bool(info["is_success"])
            self.recent.append((float(info["is_success"]), info["progress"], info["episode"]["r"]))

    def count_outcome(self, course: EpisodeOutcomes, row: int) -> None:
        """Count an episode without noise that was played outside of learning.

        Args:
            course: Outcomes that contain the episode.
            row: Row of the episode.
        """
        self.episodes += 1
        self.diverged += bool(course.diverged[row])
        self.won += bool(course.success[row])
        self.recent.append((float(course.success[row]), float(course.progress[row]), float(course.reward[row])))

    @property
    def success_share(self) -> float:
        """Success share of the recent episodes; nan before the first."""
        return float(np.mean([one[0] for one in self.recent])) if self.recent else float("nan")

    def point(self, steps_per_s: float) -> CurvePoint:
        """Return the current point of the learning curve."""
        means = np.mean(self.recent, axis=0) if self.recent else np.full(3, np.nan)
        success, progress, reward = (round(float(mean), 4) for mean in means)
        wall_s, speed = round(self.wall_s, 2), round(steps_per_s, 1)
        return CurvePoint(self.steps, wall_s, self.episodes, success, progress, reward, self.diverged, speed, self.won)

    def to_json(self) -> dict[str, Any]:
        """Return all fields as plain values."""
        return asdict(self) | {"recent": list(self.recent)}

    @classmethod
    def from_json(cls, plain: dict[str, Any], recipe: Recipe) -> History:
        """Return the history that `to_json` converted."""
        recent = cls.of(recipe).recent
        recent.extend(map(tuple, plain["recent"]))
        return cls(**plain | {"recent": recent})


def append_to_curve(folder: TrainingFolder, point: CurvePoint) -> None:
    """Append a point to the learning curve of a training."""
    with (folder / CURVE_FILE).open("a", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        if file.tell() == 0:
            rows.writerow([one.name for one in fields(CurvePoint)])
        rows.writerow(asdict(point).values())


class TrainingCallback(BaseCallback):
    """Callback that writes the curve, saves checkpoints and ends a saturated training.

    Args:
        history: History to continue.
        recipe: Hyperparameters of the training.
        steps: Budget of control steps.
        folder: Folder of the training, in which the curve is written.
        checkpoint: Saves a checkpoint.
        saturated: Returns whether the policy without noise succeeds.
        improved: Called after an update if the recent episodes without noise had the best success share so far.
        listen: Called with every point of the curve.
        begin: Called after the first reset of all episodes.
        most_s: Wall time of the whole training after which it ends [s].
    """

    def __init__(
        self,
        history: History,
        recipe: Recipe,
        steps: int,
        folder: TrainingFolder,
        *,
        checkpoint: Callable[[], None],
        saturated: Callable[[], bool],
        improved: Callable[[], None],
        listen: Callable[[CurvePoint], None],
        begin: Callable[[], None],
        most_s: float = np.inf,
    ) -> None:
        super().__init__()
        self.history, self.is_saturated, self.is_late, self.is_hopeless = history, False, False, False
        self._most_s, self._hold_steps, self._recipe = most_s, recipe.hold_steps, recipe
        is_ppo = recipe.algorithm == "ppo"
        self._measuring = recipe.simulations if is_ppo else recipe.noiseless_simulations
        self._test_every = steps // (_POINTS if is_ppo else _NOISELESS_TESTS)
        self._budget, self._folder, self._listen = steps, folder, listen
        self._checkpoint, self._saturated, self._begin = checkpoint, saturated, begin
        self._improved = improved if recipe.algorithm == "sac" else (lambda: None)
        self._next_point = self._next_test = history.steps
        self._next_checkpoint = history.steps + steps // _CHECKPOINTS
        self._clock = 0.0
        self._last_point = (history.steps, history.wall_s)

    @property
    def _steps(self) -> int:
        """Control steps; Stable-Baselines3 counts only those with a new action."""
        return self.num_timesteps * self._hold_steps

    @property
    def _stops(self) -> bool:
        return self.is_saturated or self.is_late or self.is_hopeless

    def _on_training_start(self) -> None:
        self._begin()
        self._cut_curve()
        self._clock = time.perf_counter()

    def _on_rollout_start(self) -> None:
        """Test and save the policy, here after an update: before an update, training continues with another policy."""
        if self._steps == self.history.steps:
            return  # no update yet
        self._count(self._steps)
        self.is_late = self.history.wall_s >= self._most_s
        if self._recipe.stop_hopeless:
            self.is_hopeless = is_hopeless(
                self._recipe.algorithm,
                has_succeeded=self.history.won > 0,
                steps=self.history.steps,
                budget=self._budget,
            )
        recent = self.history.recent
        is_full = len(recent) == recent.maxlen
        if is_full and self.history.success_share >= max(self.history.best_share, 0.01):
            self.history.best_share = self.history.success_share
            self._improved()
        if self.history.steps >= self._next_point:
            self._next_point = self.history.steps + self._budget // _POINTS
            self._write_point()
        if self.history.steps >= self._next_checkpoint:
            self._next_checkpoint = self.history.steps + self._budget // _CHECKPOINTS
            self._checkpoint()
        seems_saturated = is_full and self.history.success_share >= _SEEMS_SATURATED
        if seems_saturated and self.history.steps >= self._next_test:
            before = self.model.num_timesteps
            self.is_saturated = self._saturated()
            paid = (self.model.num_timesteps - before) * self._hold_steps
            self._next_test = self.history.steps + paid + max(self._test_every, _TEST_SPACING * paid)

    def _on_step(self) -> bool:
        if self._stops:
            return False  # learning can stop only after another step, which is not learned from and does not count
        for index, info in enumerate(self.locals["infos"]):
            if "episode" in info:
                self.history.count(info, measures=index < self._measuring)
        return True

    def _on_training_end(self) -> None:
        self._count(self.history.steps if self._stops else self._steps)
        if self._last_point[0] != self.history.steps:
            self._write_point()

    def _count(self, steps: int) -> None:
        """Update the number of steps that were learned from, and the wall time until now."""
        now = time.perf_counter()
        self.history.wall_s += now - self._clock
        self._clock = now
        self.history.steps = steps

    def _cut_curve(self) -> None:
        """Remove the points that a killed process wrote after its last checkpoint; those steps are trained again."""
        path = self._folder / CURVE_FILE
        if path.exists():
            whole = [line for line in path.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]
            kept = [line for line in whole[1:] if int(line.partition(b",")[0]) <= self.history.steps]
            self._folder.write(CURVE_FILE, b"".join([*whole[:1], *kept]))

    def _write_point(self) -> None:
        steps, wall_s = self._last_point
        speed = (self.history.steps - steps) / max(self.history.wall_s - wall_s, 1e-9)
        self._last_point = (self.history.steps, self.history.wall_s)
        point = self.history.point(speed)
        append_to_curve(self._folder, point)
        self._listen(point)
