"""How many control steps of how many environments a second, and what the physics alone would allow."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from bodies import Body
from mujoco.batch import Batch
from stable_baselines3.common.vec_env import SubprocVecEnv, VecEnv

from aidsr.episodes.batch import Episodes
from aidsr.episodes.scene import TaskScene
from aidsr.rl.vector_env import BatchedVecEnv

SIMULATIONS, PROCESSES = 64, 8
_STEPS = 3_000


def speeds(body: Body, scene: Path) -> dict[str, float]:
    """Return env-steps per second of each kind, measured one after the other."""
    return {
        "physics": _physics_speed(body, scene),
        "batched": _vec_speed(_batched(TaskScene.of(scene, body.task))),
        "subproc": _vec_speed(subproc(body, scene, seed=0)),
    }


def _physics_speed(body: Body, scene: Path) -> float:
    found = TaskScene.of(scene, body.task)
    batch = Batch(found.model, nsim=SIMULATIONS, nthread=0)
    substeps = round(found.task.control_dt_s / found.model.opt.timestep)
    rng, actions = np.random.default_rng(0), found.actions
    ctrl = batch.bind("ctrl")

    def step() -> None:
        ctrl[:, list(actions.actuators)] = actions.ctrl(rng.uniform(-1.0, 1.0, (SIMULATIONS, actions.size)))
        batch.rollout(substeps)

    return _rate(step, SIMULATIONS)


def _batched(found: TaskScene) -> BatchedVecEnv:
    rng = np.random.default_rng(0)

    def fresh() -> object:
        return found.task.variation("development", int(rng.integers(2**31)))

    first = [fresh() for _ in range(SIMULATIONS)]
    return BatchedVecEnv(Episodes(found.model, found.task, found.actions, first), fresh)


def subproc(body: Body, scene: Path, seed: int) -> VecEnv:
    """Return the environments a user would write, each in a process of its own and with its own variations."""
    seeds = range(seed * PROCESSES, (seed + 1) * PROCESSES)
    return SubprocVecEnv([partial(body.plain, scene, body.task, each) for each in seeds])


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
