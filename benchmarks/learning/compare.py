"""Train every scene of the suite in several ways, and record how success grows with computation.

    python -m benchmarks.learning.compare --half decide --ways paper best --steps 60000

The ways are the training protocols and `sb3`: PPO with the defaults of Stable-Baselines3 on eight simulations, as a
user would write it; its last rollout may exceed the budget. Each training uses one thread. The policy is evaluated
several times during training. Each point of the curve has the control steps, processor seconds and wall time spent so
far, without the evaluations, and the share of 20 development variations, never trained on, that the policy wins without
noise. In these evaluations an episode without progress for 8 s is counted as lost, which saves most of their time; the
last evaluation plays every episode to its end. Rows go to results.jsonl. The same command continues with the trainings
that are missing, and several commands may share the file.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal, get_args

import numpy as np
import torch
from benchmarks.learning.suite import Half, SuiteScene, suite
from benchmarks.rows import append_row, read_rows
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

from aidsr.core.artifacts import Artifact
from aidsr.core.provenance import commit, processor
from aidsr.learn.episodes.batch import Episodes, StepResult
from aidsr.learn.episodes.rollout import Policy, rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.curve_point import CurvePoint
from aidsr.learn.rl.policy import TrainedPolicy, one_torch_thread
from aidsr.learn.rl.recipe import PROTOCOLS, Recipe
from aidsr.learn.rl.training import DEVELOPMENT, train
from aidsr.learn.rl.training_config import TrainingConfig
from aidsr.learn.rl.training_folder import TrainingFolder
from aidsr.learn.rl.vector_env import BatchedVecEnv
from aidsr.tasks import BENCHMARK_VERSION, Variation, is_current
from aidsr.tasks.readings import FloatArray

RESULTS = Path(__file__).with_name("results.jsonl")
EPISODES = 20
"""Number of development variations in an evaluation, starting at the first that training never samples."""
_STALLED_S = 8.0
"""Time without progress after which an episode is counted as lost [s]. Our choice: longer than any wait in a won
episode of the built-in policies."""
_EVALUATIONS = 10
"""Approximate number of evaluations during the budget."""
_DEFAULT_SIMULATIONS = 8
"""Number of simulations of the way `sb3`, as in benchmarks/rl."""

Way = Literal["sb3", "paper", "best"]
WAYS: tuple[Way, ...] = get_args(Way)


class Point(Artifact):
    """One evaluation of a policy during training."""

    steps: int
    processor_s: float
    wall_s: float
    success: float
    progress: float
    """Mean, over the episodes, of the best progress of each."""


class Row(Artifact):
    """One training."""

    scene: str
    task: str
    half: Half
    author: str
    protocol: Way
    seed: int
    steps: int
    """Budget of control steps."""
    curve: tuple[Point, ...]
    recipe: Recipe | None
    """None for `sb3`."""
    benchmark_version: int
    commit: str
    processor: str

    @property
    def category(self) -> str:
        """Category of the task."""
        return self.task.partition("/")[0]


def main() -> None:
    """Run the trainings that are missing."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--half", choices=("decide", "aside"), help="both unless named")
    parser.add_argument("--scenes", nargs="+", help="names, all of the half unless given")
    parser.add_argument("--ways", nargs="+", choices=WAYS, default=WAYS)
    parser.add_argument("--steps", type=int, default=60_000, help="budget of control steps a training")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--out", type=Path, default=RESULTS)
    asked = parser.parse_args()
    for seed in range(asked.seeds):
        for scene in suite(asked.half):
            for way in asked.ways:
                if asked.scenes and scene.name not in asked.scenes:
                    continue
                if not any(_same(row, scene, way, seed, asked.steps) for row in read_rows(asked.out, Row)):
                    _note(asked.out, learn(scene, way, seed, asked.steps))


def newest(rows: Iterable[Row], protocol: Way, steps: int) -> dict[str, Row]:
    """Return the newest training of each scene with a protocol and budget, if its task has not changed since."""
    return {
        row.scene: row
        for row in rows
        if (row.protocol, row.steps) == (protocol, steps) and is_current(row.task, row.benchmark_version)
    }


def recipe_now(way: Way) -> Recipe | None:
    """Return the present recipe of a way, None for `sb3`."""
    return None if way == "sb3" else PROTOCOLS[way]


def _same(row: Row, scene: SuiteScene, way: Way, seed: int, steps: int) -> bool:
    asked = (scene.name, way, seed, steps, recipe_now(way))
    same = (row.scene, row.protocol, row.seed, row.steps, row.recipe) == asked
    return same and is_current(row.task, row.benchmark_version)


def _note(path: Path, row: Row) -> None:
    append_row(path, row)
    last = row.curve[-1]
    sys.stdout.write(
        f"{row.scene} {row.protocol} {row.seed}: {last.success:.0%}, progress {last.progress:.2f}, "
        f"{last.steps:,} steps, {last.processor_s:.0f} s of a processor\n"
    )
    sys.stdout.flush()


def learn(asked: SuiteScene, way: Way, seed: int, steps: int) -> Row:
    """Train one policy and return its curve."""
    scene, recipe = asked.scene(), recipe_now(way)
    with TemporaryDirectory() as home, one_torch_thread():
        if recipe is None:
            curve = _learn_with_defaults(scene, seed, steps)
        else:
            watch = _Watch(scene, Path(home, "training"), steps)
            train(scene, watch.folder, steps=steps, seed=seed, recipe=recipe, threads=1, listen=watch.listen)
            curve = watch.finished()
    return Row(
        scene=asked.name,
        task=asked.task,
        half=asked.half,
        author=asked.author,
        protocol=way,
        seed=seed,
        steps=steps,
        curve=tuple(curve),
        recipe=recipe,
        benchmark_version=BENCHMARK_VERSION,
        commit=commit(),
        processor=processor(),
    )


class _Curve:
    """Points of a training's curve. The clocks are stopped during evaluations."""

    def __init__(self) -> None:
        self.points = list[Point]()
        self._processor_s, self._wall_s = -time.process_time(), -time.perf_counter()

    @contextmanager
    def stopped(self) -> Iterator[None]:
        """Stop the clocks."""
        now = time.process_time(), time.perf_counter()
        yield
        self._processor_s -= time.process_time() - now[0]
        self._wall_s -= time.perf_counter() - now[1]

    def add(self, steps: int, scene: TaskScene, policy: Policy, smoothing: float, stalled_s: float) -> None:
        """Evaluate a policy with the clocks stopped, and add the point."""
        spent = self._processor_s + time.process_time(), self._wall_s + time.perf_counter()
        with self.stopped():
            success, progress = success_of(scene, policy, smoothing, stalled_s)
        processor_s, wall_s = (round(seconds, 2) for seconds in spent)
        self.points.append(
            Point(steps=steps, processor_s=processor_s, wall_s=wall_s, success=success, progress=progress)
        )


class _Watch:
    """Evaluates the checkpoints of a training."""

    def __init__(self, scene: TaskScene, folder: Path, steps: int) -> None:
        self.folder, self._curve = folder, _Curve()
        self._scene = scene
        self._every, self._next, self._steps = steps // _EVALUATIONS, 0, 0

    def listen(self, point: CurvePoint) -> None:
        """Evaluate the newest checkpoint, if there is one and the last evaluation was a tenth of the budget ago."""
        self._steps = point.steps
        if point.steps >= self._next:
            self._next = point.steps + self._every
            self._evaluate(_STALLED_S)

    def finished(self) -> list[Point]:
        """Evaluate the final policy and return the curve."""
        self._evaluate(np.inf)
        return self._curve.points

    @torch.random.fork_rng()  # loading a network draws random numbers, which must not change those of training
    def _evaluate(self, stalled_s: float) -> None:
        with self._curve.stopped():
            kept = [folder for folder in (self.folder, self.folder / "checkpoint") if (folder / "policy.zip").exists()]
            if not kept:
                return  # no policy is saved yet
            recipe = TrainingFolder(self.folder).read("config.json", TrainingConfig).recipe  # has a motion, if one won
            acted_in = recipe.acting_in(self._scene)
            policy = TrainedPolicy.load(kept[0], recipe, acted_in.actions.size)
        self._curve.add(self._steps, acted_in, policy, recipe.smoothing, stalled_s)


def _learn_with_defaults(scene: TaskScene, seed: int, steps: int) -> list[Point]:
    """Train with the defaults of Stable-Baselines3 and return the curve."""
    rng = np.random.default_rng(seed)

    def sample() -> Variation:
        return scene.task.variation("development", int(rng.integers(DEVELOPMENT)))

    curve, variations = _Curve(), [sample() for _ in range(_DEFAULT_SIMULATIONS)]
    env = BatchedVecEnv(Episodes(scene.model, scene.task, scene.actions, variations, threads=1), sample)
    model = PPO("MlpPolicy", env, seed=seed, device="cpu")
    watch = _EachUpdate(curve, scene, steps)
    model.learn(steps, callback=watch)
    curve.add(model.num_timesteps, scene, _Plain(model), 0.0, np.inf)
    return curve.points


@dataclass(frozen=True)
class _Plain:
    """A Stable-Baselines3 policy that acts without noise."""

    model: PPO

    def act(self, observation: NDArray[np.floating]) -> FloatArray:
        """Return the actions; see `Policy`."""
        return np.asarray(self.model.predict(observation.astype(np.float32), deterministic=True)[0], dtype=np.float64)


class _EachUpdate(BaseCallback):
    """Callback that evaluates the policy after an update, about every tenth of the budget."""

    def __init__(self, curve: _Curve, scene: TaskScene, steps: int) -> None:
        super().__init__()
        self._curve, self._scene = curve, scene
        self._every = self._next = steps // _EVALUATIONS

    def _on_rollout_start(self) -> None:
        if self.num_timesteps >= self._next:
            self._next = self.num_timesteps + self._every
            self._curve.add(self.num_timesteps, self._scene, _Plain(self.model), 0.0, _STALLED_S)

    def _on_step(self) -> bool:
        return True


def success_of(scene: TaskScene, policy: Policy, smoothing: float, stalled_s: float) -> tuple[float, float]:
    """Return the share of development variations that a policy wins, and its mean best progress.

    Args:
        scene: Scene in which the policy acts.
        policy: The policy, without noise.
        smoothing: Smoothing of actions with which the policy was trained.
        stalled_s: Time without progress after which an episode is counted as lost [s].
    """
    variations = [scene.task.variation("development", DEVELOPMENT + index) for index in range(EPISODES)]
    episodes = Episodes(scene.model, scene.task, scene.actions, variations, threads=1, smoothing=smoothing)
    best, gained_s = np.zeros((2, EPISODES))

    def stop_stalled(result: StepResult) -> None:
        gained = result.progress >= best + 0.01
        best[gained], gained_s[gained] = result.progress[gained], result.time_s[gained]
        episodes.running = episodes.running & (result.time_s - gained_s < stalled_s)

    outcomes = rollout(episodes, policy, stop_stalled)
    return float(outcomes.success.mean()), round(float(outcomes.best_progress.mean()), 4)


if __name__ == "__main__":
    main()
