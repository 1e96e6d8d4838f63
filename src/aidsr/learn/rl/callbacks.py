"""What is noticed while a policy learns: its curve, checkpoints, and when there is nothing left to learn."""

from __future__ import annotations

import csv
import time
from collections import deque
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from aidsr.learn.rl.training_folder import TrainingFolder

__all__ = ["CurvePoint", "History", "Watch"]

_RECENT = 100
"""Episodes over which success is told. Our choice: its standard error is then at most 0.05."""
_POINTS = 100
"""Points of a curve."""
_CHECKPOINTS = 20
"""Over the whole budget."""
_SEEMS_SATURATED = 0.9
"""Share of recent episodes that must succeed, noise and all, before a test without noise is worth its time."""


@dataclass(frozen=True)
class CurvePoint:
    """How training stood after some steps."""

    steps: int
    wall_s: float
    episodes: int
    """Ended so far. The first ones of all simulations are cut short at different times, see `BatchedVecEnv`, so that
    success is told too low rather than too high before the task's time limit has passed once."""
    success_share: float
    """Of the last 100 episodes, with noise; nan before the first. Lost episodes end last, at the time limit, and so are
    missing at first."""
    progress: float
    """Mean at their ends."""
    reward: float
    """Mean of their sums."""
    diverged: int
    """Episodes in which the simulation broke down, so far."""
    steps_per_s: float
    """Since the point before."""


@dataclass
class History:
    """What has been counted since training began, over all its sittings."""

    steps: int = 0
    wall_s: float = 0.0
    episodes: int = 0
    diverged: int = 0
    resumed: int = 0
    """Sittings after the first; one that was killed before its first checkpoint left nothing and is none."""
    recent: deque[tuple[float, float, float]] = field(default_factory=lambda: deque(maxlen=_RECENT))
    """Success, progress and return of the last episodes."""

    def count(self, info: dict[str, Any]) -> None:
        """Take an episode in that has ended."""
        self.episodes += 1
        self.diverged += info["diverged"]
        self.recent.append((float(info["is_success"]), info["progress"], info["episode"]["r"]))

    @property
    def success_share(self) -> float:
        """Of the recent episodes; nan before the first."""
        return float(np.mean([one[0] for one in self.recent])) if self.recent else float("nan")

    def point(self, steps_per_s: float) -> CurvePoint:
        """Return where training stands."""
        means = np.mean(self.recent, axis=0) if self.recent else np.full(3, np.nan)
        success, progress, reward = (round(float(mean), 4) for mean in means)
        wall_s, speed = round(self.wall_s, 2), round(steps_per_s, 1)
        return CurvePoint(self.steps, wall_s, self.episodes, success, progress, reward, self.diverged, speed)

    def to_json(self) -> dict[str, Any]:
        """Return everything as plain values."""
        return asdict(self) | {"recent": list(self.recent)}

    @classmethod
    def from_json(cls, plain: dict[str, Any]) -> History:
        """Return what `to_json` made."""
        return cls(**plain | {"recent": deque(map(tuple, plain["recent"]), maxlen=_RECENT)})


class Watch(BaseCallback):
    """Follows a training.

    Args:
        history: Counted on.
        steps: The budget.
        folder: Where the curve goes.
        checkpoint: Saves what there is.
        saturated: Whether the policy, played without noise, does all it is asked.
        listen: Called with every point of the curve.
        begin: Called when the first episodes have begun.
    """

    def __init__(
        self,
        history: History,
        steps: int,
        folder: TrainingFolder,
        *,
        checkpoint: Callable[[], None],
        saturated: Callable[[], bool],
        listen: Callable[[CurvePoint], None],
        begin: Callable[[], None],
    ) -> None:
        super().__init__()
        self.history, self.is_saturated = history, False
        self._budget, self._folder, self._listen = steps, folder, listen
        self._checkpoint, self._saturated, self._begin = checkpoint, saturated, begin
        self._next_point = self._next_test = history.steps
        self._next_checkpoint = history.steps + steps // _CHECKPOINTS
        self._clock = 0.0
        self._told = (history.steps, history.wall_s)

    def _on_training_start(self) -> None:
        self._begin()
        self._cut_curve()
        self._clock = time.perf_counter()

    def _on_rollout_start(self) -> None:
        """Look at the policy here, after an update; what is tested or saved before one is not what goes on."""
        if self.num_timesteps == self.history.steps:
            return  # no update yet
        self._count(self.num_timesteps)
        if self.history.steps >= self._next_point:
            self._next_point = self.history.steps + self._budget // _POINTS
            self._tell()
        if self.history.steps >= self._next_checkpoint:
            self._next_checkpoint = self.history.steps + self._budget // _CHECKPOINTS
            self._checkpoint()
        full = len(self.history.recent) == _RECENT and self.history.success_share >= _SEEMS_SATURATED
        if full and self.history.steps >= self._next_test:
            self._next_test = self.history.steps + self._budget // _POINTS
            self.is_saturated = self._saturated()

    def _on_step(self) -> bool:
        if self.is_saturated:
            return False  # PPO can be ended only after a step, from which nothing is learned; so it does not count
        for info in self.locals["infos"]:
            if "episode" in info:
                self.history.count(info)
        return True

    def _on_training_end(self) -> None:
        self._count(self.history.steps if self.is_saturated else self.num_timesteps)
        if self._told[0] != self.history.steps:
            self._tell()

    def _count(self, steps: int) -> None:
        """Count the steps that were learned from, and the time until now."""
        now = time.perf_counter()
        self.history.wall_s += now - self._clock
        self._clock = now
        self.history.steps = steps

    def _cut_curve(self) -> None:
        """Take out what a killed sitting told after its last checkpoint; those steps are learned and told again."""
        path = self._folder / "curve.csv"
        if path.exists():
            whole = [line for line in path.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]
            kept = [line for line in whole[1:] if int(line.partition(b",")[0]) <= self.history.steps]
            self._folder.write("curve.csv", b"".join([*whole[:1], *kept]))

    def _tell(self) -> None:
        steps, wall_s = self._told
        speed = (self.history.steps - steps) / max(self.history.wall_s - wall_s, 1e-9)
        self._told = (self.history.steps, self.history.wall_s)
        point = self.history.point(speed)
        path = self._folder / "curve.csv"
        with path.open("a", newline="", encoding="utf-8") as file:
            rows = csv.writer(file)
            if file.tell() == 0:
                rows.writerow([one.name for one in fields(CurvePoint)])
            rows.writerow(asdict(point).values())
        self._listen(point)
