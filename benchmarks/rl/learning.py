"""Wall time until a share of the last 100 episodes succeeds: this package's recipe, and PPO with its defaults."""

from __future__ import annotations

import tempfile
import time
from collections import deque
from pathlib import Path

from bodies import Body
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecMonitor
from stepping import subproc

from aidsr.core.artifacts import Artifact
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.curve_point import CurvePoint
from aidsr.learn.rl.policy import one_torch_thread
from aidsr.learn.rl.training import train

_RECENT = 100
"""Number of the last episodes over which success is reported, as in `aidsr.learn.rl.callbacks`."""
_POINTS = 100
"""Largest number of points of a curve."""


class Way(Artifact):
    """Result of a training."""

    wall_s: float
    steps: int
    """Control steps."""
    there: bool
    """Whether the target success was reached."""
    curve: tuple[tuple[float, float], ...]
    """Points of wall time [s] and success in the last 100 episodes."""


class _There(Exception):  # noqa: N818 - not an error
    """Raised when the target success is reached."""


def ours(body: Body, scene: Path, seed: int, most_steps: int) -> Way:
    """Train with the package's recipe until the target success is reached or the budget of steps is spent."""
    found = TaskScene.of(scene, body.task)
    points: list[CurvePoint] = []

    def listen(point: CurvePoint) -> None:
        points.append(point)
        if point.episodes >= _RECENT and point.success_share >= body.success:
            raise _There

    there = False
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        try:
            train(found, Path(folder) / "training", steps=most_steps, seed=seed, listen=listen)
        except _There:
            there = True
        wall_s = time.perf_counter() - began
    curve = tuple((point.wall_s, point.success_share) for point in points if point.episodes >= _RECENT)
    return Way(wall_s=wall_s, steps=points[-1].steps, there=there, curve=curve)


def theirs(body: Body, scene: Path, seed: int, most_s: float) -> Way:
    """Train with Stable-Baselines3's defaults on SubprocVecEnv until the target success or the time limit is reached.

    The clock starts after the subprocesses have started; the clock of `ours` starts when `train` is called.
    """
    with one_torch_thread():
        env = VecMonitor(subproc(body, scene, seed))
        watch = _Until(body.success, most_s)
        model = PPO("MlpPolicy", env, seed=seed, device="cpu").learn(10**9, callback=watch)
        wall_s = watch.wall_s
        env.close()
    return Way(wall_s=wall_s, steps=model.num_timesteps, there=watch.there, curve=tuple(watch.curve))


class _Until(BaseCallback):
    def __init__(self, success: float, most_s: float) -> None:
        super().__init__()
        self.success, self.most_s, self.there = success, most_s, False
        self.recent: deque[float] = deque(maxlen=_RECENT)
        self.curve: list[tuple[float, float]] = []
        self._began_s, self._next_point_s = time.perf_counter(), 0.0

    @property
    def wall_s(self) -> float:
        return time.perf_counter() - self._began_s

    def _on_step(self) -> bool:
        self.recent.extend(float(info["is_success"]) for info in self.locals["infos"] if "episode" in info)
        share = sum(self.recent) / _RECENT
        full = len(self.recent) == _RECENT
        self.there = full and share >= self.success
        if self.there or (full and self.wall_s >= self._next_point_s):
            self.curve.append((self.wall_s, share))
            self._next_point_s = self.wall_s + self.most_s / _POINTS
        return not self.there and self.wall_s < self.most_s
