"""How fast environments step and bodies learn, side by side in one run.

    python benchmarks/rl/speed.py --runs 5 --learn 3

The arm and the crawler are the built-in team's, made on the spot with the first seed that proposes one. Compared are
the batched environment of this package, the plain Gymnasium environments of `plain.py` in Stable-Baselines3's
SubprocVecEnv with 8 processes, and the raw physics of the same scenes on the same threads, with no number looked at:
the limit. Then wall time until a share of the last 100 episodes succeed: our recipe on the batched environment against
Stable-Baselines3's default PPO on SubprocVecEnv, which gives up after a multiple of the time that ours took with the
same seed. The kinds take turns, so that a machine that gets slower meanwhile slows all of them. Writes results.md.
"""

from __future__ import annotations

import argparse
import itertools
import os
import statistics
import tempfile
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import mujoco
import numpy as np
from mujoco.batch import Batch
from plain import PlainButton, PlainEnv, PlainGround
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import SubprocVecEnv, VecEnv, VecMonitor

import aidsr
from aidsr import builtin
from aidsr.episodes.batch import Episodes
from aidsr.episodes.scene import TaskScene
from aidsr.rl.policy import one_torch_thread
from aidsr.rl.training import train
from aidsr.rl.vector_env import BatchedVecEnv
from aidsr.rl.watching import CurvePoint

RESULTS = Path(__file__).with_name("results.md")
_SIMULATIONS, _PROCESSES, _STEPS = 64, 8, 3_000


@dataclass(frozen=True)
class Body:
    """What is measured, and the success up to which it learns."""

    name: str
    """Family of the built-in team."""
    task: str
    plain: type[PlainEnv]
    success: float


BODIES = (
    Body("arm", "reaching/button_pushing", PlainButton, 0.8),
    Body("crawler", "locomotion/flat_ground", PlainGround, 0.5),
)


def main() -> None:
    """Measure and write down."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5, help="speed measurements of each kind; medians are told")
    parser.add_argument("--learn", type=int, default=5, help="trainings of each kind, each with its own seed")
    parser.add_argument("--most-steps", type=int, default=300_000, help="budget of our recipe")
    parser.add_argument(
        "--patience", type=float, default=12.0, help="how many times our wall time the defaults may take"
    )
    asked = parser.parse_args()
    lines = [f"# Speed of environments and of learning\n\nMade by `{' '.join(_command(asked))}`, {_machine()}.\n"]
    for body in BODIES:
        with tempfile.TemporaryDirectory() as folder:
            scene = _made(body, Path(folder))
            lines += [f"## {body.name}: {body.task}\n", *_stepping(body, scene, asked.runs)]
            lines += _learning(body, scene, asked)
        RESULTS.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _command(asked: argparse.Namespace) -> list[str]:
    return [
        "python",
        "benchmarks/rl/speed.py",
        *(f"--{name.replace('_', '-')} {value:g}" for name, value in vars(asked).items()),
    ]


def _machine() -> str:
    return f"on {os.cpu_count()} cores (load {os.getloadavg()[0]:.1f} before), MuJoCo {mujoco.__version__}"


def _made(body: Body, folder: Path) -> Path:
    """Let the built-in team design the body; return its scene."""
    brief = aidsr.load_task(body.task).brief()
    seeds = (seed for seed in itertools.count() if builtin.team(seed).designer.propose(brief, 1)[0].family == body.name)
    run = aidsr.design(task=body.task, concepts=1, seed=next(seeds), runs=folder)
    return run.design(1).final_scene.path


# --- stepping ---


def _stepping(body: Body, scene: Path, runs: int) -> list[str]:
    kinds: dict[str, Callable[[], float]] = {
        "raw physics, the limit": partial(_physics_speed, body, scene),
        f"batched, {_SIMULATIONS} simulations": partial(_batched_speed, body, scene),
        f"SubprocVecEnv({_PROCESSES}), plain environment": partial(_subproc_speed, body, scene),
    }
    seen: dict[str, list[float]] = {name: [] for name in kinds}
    for _ in range(runs):
        for name, measure in kinds.items():
            seen[name].append(measure())
    medians = {name: statistics.median(values) for name, values in seen.items()}
    limit, ours, theirs = medians.values()
    rows = [
        f"| {name} | {medians[name]:,.0f} ({min(values):,.0f} to {max(values):,.0f}) | {medians[name] / limit:.0%} |"
        for name, values in seen.items()
    ]
    head = ["| env-steps per second | median (range) | of the limit |", "|---|---|---|"]
    return [*head, *rows, f"\nBatched against SubprocVecEnv: **{ours / theirs:.1f} x**.\n"]


def _physics_speed(body: Body, scene: Path) -> float:
    found = TaskScene.of(scene, body.task)
    batch = Batch(found.model, nsim=_SIMULATIONS, nthread=0)
    substeps = round(found.task.control_dt_s / found.model.opt.timestep)
    rng, actions = np.random.default_rng(0), found.actions
    ctrl = batch.bind("ctrl")

    def step() -> None:
        ctrl[:, list(actions.actuators)] = actions.ctrl(rng.uniform(-1.0, 1.0, (_SIMULATIONS, actions.size)))
        batch.rollout(substeps)

    return _rate(step, _SIMULATIONS)


def _batched_speed(body: Body, scene: Path) -> float:
    return _vec_speed(_batched(TaskScene.of(scene, body.task)))


def _batched(found: TaskScene) -> BatchedVecEnv:
    rng = np.random.default_rng(0)

    def fresh() -> object:
        return found.task.variation("development", int(rng.integers(2**31)))

    first = [fresh() for _ in range(_SIMULATIONS)]
    return BatchedVecEnv(Episodes(found.model, found.task, found.actions, first), fresh)


def _subproc_speed(body: Body, scene: Path) -> float:
    return _vec_speed(_subproc(body, scene))


def _subproc(body: Body, scene: Path) -> VecEnv:
    return SubprocVecEnv([partial(body.plain, scene, body.task, seed) for seed in range(_PROCESSES)])


def _vec_speed(env: VecEnv) -> float:
    rng = np.random.default_rng(0)
    env.reset()
    speed = _rate(
        lambda: env.step(rng.uniform(-1.0, 1.0, (env.num_envs, *env.action_space.shape)).astype(np.float32)),
        env.num_envs,
    )
    env.close()
    return speed


def _rate(step: Callable[[], object], simulations: int) -> float:
    """Return simulations' steps per second, after a warm-up."""
    for _ in range(5):
        step()
    count = max(5, _STEPS // simulations)
    began = time.perf_counter()
    for _ in range(count):
        step()
    return count * simulations / (time.perf_counter() - began)


# --- learning ---


def _learning(body: Body, scene: Path, asked: argparse.Namespace) -> list[str]:
    if not asked.learn:
        return []
    ours, theirs = [], []
    for seed in range(asked.learn):
        ours.append(_ours(body, scene, seed, asked.most_steps))
        theirs.append(_theirs(body, scene, seed, asked.patience * ours[-1][0]))
    head = [
        f"Until {body.success:.0%} of the last 100 episodes succeed:\n",
        "| seed | our recipe, batched | PPO defaults, SubprocVecEnv |",
        "|---|---|---|",
    ]
    rows = [f"| {seed} | {_told(a)} | {_told(b)} |" for seed, (a, b) in enumerate(zip(ours, theirs, strict=True))]
    ratio = statistics.median(b[0] for b in theirs) / statistics.median(a[0] for a in ours)
    at_least = "at least " if not all(b[2] for b in theirs) else ""
    return [*head, *rows, f"\nMedian wall time, theirs by ours: **{at_least}{ratio:.1f} x**.\n"]


_Way = tuple[float, int, bool]
"""Wall time [s], control steps, and whether it got there."""


def _told(way: _Way) -> str:
    return f"{way[0]:.0f} s, {way[1]:,} steps, {way[1] / way[0]:,.0f}/s{'' if way[2] else ', not there'}"


class _There(Exception):  # noqa: N818 - nothing went wrong
    """The success asked for is reached."""


def _ours(body: Body, scene: Path, seed: int, most: int) -> _Way:
    found = TaskScene.of(scene, body.task)
    last: list[CurvePoint] = []

    def listen(point: CurvePoint) -> None:
        last.append(point)
        if point.episodes >= 100 and point.success_share >= body.success:
            raise _There

    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        try:
            train(found, Path(folder) / "training", steps=most, seed=seed, listen=listen)
        except _There:
            return time.perf_counter() - began, last[-1].steps, True
        return time.perf_counter() - began, most, False


class _Until(BaseCallback):
    def __init__(self, success: float, most_s: float) -> None:
        super().__init__()
        self.success, self.recent, self.there = success, deque(maxlen=100), False
        self._end_s = time.perf_counter() + most_s

    def _on_step(self) -> bool:
        self.recent.extend(float(info["is_success"]) for info in self.locals["infos"] if "episode" in info)
        self.there = len(self.recent) == 100 and sum(self.recent) >= 100 * self.success
        return not self.there and time.perf_counter() < self._end_s


def _theirs(body: Body, scene: Path, seed: int, most_s: float) -> _Way:
    with one_torch_thread():
        env = VecMonitor(_subproc(body, scene))
        began = time.perf_counter()
        watch = _Until(body.success, most_s)
        model = PPO("MlpPolicy", env, seed=seed, device="cpu").learn(10**9, callback=watch)
        wall_s = time.perf_counter() - began
        env.close()
    return wall_s, model.num_timesteps, watch.there


if __name__ == "__main__":
    main()
