"""Stepping speed: control steps per second of all environments together, and the limit set by physics alone."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from bodies import Body
from mujoco.batch import Batch
from stable_baselines3.common.vec_env import SubprocVecEnv, VecEnv

from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.vector_env import BatchedVecEnv
from aidsr.tasks import Variation

SIMULATIONS, PROCESSES, ROUNDS = 64, 8, 15
_STEPS = 512
"""Env-steps of each kind in a round. They take about a second, so that a change of the machine's speed affects all
kinds."""


def speeds(body: Body, scene: Path) -> tuple[dict[str, float], ...]:
    """Return env-steps per second of each kind in each round; kinds take turns."""
    found = TaskScene.of(scene, body.task)
    batched, apart = _batched(found), subproc(body, scene, seed=0)
    try:
        kinds = {
            "physics": (_physics(found), SIMULATIONS),
            "batched": (_acting(batched), batched.num_envs),
            "subproc": (_acting(apart), apart.num_envs),
        }
        # as in training; otherwise no episode would end or begin during the measurement
        batched.desynchronize(np.random.default_rng(0))
        for step, _ in kinds.values():
            for _ in range(5):
                step()
        return tuple({name: _rate(*kind) for name, kind in kinds.items()} for _ in range(ROUNDS))
    finally:
        apart.close()


def _physics(found: TaskScene) -> Callable[[], object]:
    """Return a function that advances all simulations by a control step with random controls."""
    batch = Batch(found.model, nsim=SIMULATIONS, nthread=0)
    substeps = round(found.task.control_dt_s / found.model.opt.timestep)
    rng, actions = np.random.default_rng(0), found.actions
    ctrl = batch.bind("ctrl")

    def step() -> None:
        ctrl[:, list(actions.actuators)] = actions.ctrl(rng.uniform(-1.0, 1.0, (SIMULATIONS, actions.size)))
        batch.rollout(substeps)

    return step


def _batched(found: TaskScene) -> BatchedVecEnv:
    rng = np.random.default_rng(0)

    def fresh() -> Variation:
        return found.task.variation("development", int(rng.integers(2**31)))

    first = [fresh() for _ in range(SIMULATIONS)]
    return BatchedVecEnv(Episodes(found.model, found.task, found.actions, first), fresh)


def subproc(body: Body, scene: Path, seed: int) -> VecEnv:
    """Return environments as a user would write them, each in its own process and with its own variations."""
    seeds = range(seed * PROCESSES, (seed + 1) * PROCESSES)
    return SubprocVecEnv([partial(body.plain, scene, body.task, each) for each in seeds])


def _acting(env: VecEnv) -> Callable[[], object]:
    """Return a function that advances all environments by a control step with random actions."""
    rng = np.random.default_rng(0)
    env.reset()
    shape = (env.num_envs, *env.action_space.shape)
    return lambda: env.step(rng.uniform(-1.0, 1.0, shape).astype(np.float32))


def _rate(step: Callable[[], object], simulations: int) -> float:
    """Return the env-steps per second of one turn."""
    count = _STEPS // simulations
    began = time.perf_counter()
    for _ in range(count):
        step()
    return count * simulations / (time.perf_counter() - began)
