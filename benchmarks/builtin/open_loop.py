"""What the built-in bodies do without learning: random pulls, plain closing, random sinusoids.

    python benchmarks/builtin/open_loop.py

writes results.md beside this file. Deterministic; about ten minutes on two cores.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

from aidsr import builtin
from aidsr.builtin.designer import IDEAS, describe
from aidsr.builtin.families import FAMILIES
from aidsr.builtin.job import read_job
from aidsr.sim.assembly import assemble
from aidsr.tasks import Task, apply_to_simulation, load_task

PULLS, GAITS, GAIT_S, GRASPS = 160, 30, 10.0, 24
THREADS = os.cpu_count() or 1

Array = NDArray[np.float64]


def scenes(task: Task) -> Iterator[tuple[str, mujoco.MjModel]]:
    """Yield a name and a scene for every family and variant that does the task."""
    brief, rules = task.brief(), builtin.team(1)
    job = read_job(brief)
    for family, variants in IDEAS[job.kind].items():
        for variant in variants:
            parameters = FAMILIES[family].sample(job, np.random.default_rng(0), variant)
            concept = describe(family, parameters, job)
            robot = rules.coder.write(brief, concept)
            placement = rules.integrator.place(brief, concept, robot)
            scene = assemble(robot, brief.environment, placement, task.sensors)
            yield f"{family}, {variant}", mujoco.MjModel.from_xml_string(scene.mjcf)


def winches(model: mujoco.MjModel, part: str = "robot/pull") -> list[int]:
    """Return the robot's actuators whose name contains a word."""
    return [i for i in range(model.nu) if part in model.actuator(i).name]


def state_of(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Return the full physics state of a simulation."""
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.zeros(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    return state


def play(model: mujoco.MjModel, start: Array, controls: Array) -> tuple[Array, Array]:
    """Return the states and sensors of simulations under given controls (n, steps, n_controls)."""
    workers = [mujoco.MjData(model) for _ in range(THREADS)]
    states, sensors = rollout.rollout([model], workers, np.tile(start, (len(controls), 1)), controls)
    return np.asarray(states), np.asarray(sensors)


def press() -> Iterator[str]:
    """Yield how many random pulls, ramped from one choice to another over 1.5 s, press the button."""
    task = load_task("button_pushing")
    for name, model in scenes(task):
        pressed = 0
        for index in range(4):
            data = mujoco.MjData(model)
            apply_to_simulation(task.variation("development", index), model, data)
            rng, chosen = np.random.default_rng(index), winches(model)
            ends = rng.uniform(0, 1, (2, PULLS, 1, len(chosen))) * (rng.random((2, PULLS, 1, len(chosen))) > 0.45)
            ramp = np.linspace(0, 1, 750)[None, :, None]
            controls = np.zeros((PULLS, 750, model.nu))
            controls[:, :, chosen] = (ends[0] * (1 - ramp) + ends[1] * ramp) * model.actuator_ctrlrange[chosen, 1]
            _, sensors = play(model, state_of(model, data), controls)
            travel = sensors[:, :, model.sensor("button_travel").adr[0]]
            pressed += int((travel.max(axis=1) >= 0.005).sum())
        yield f"| {name} | {100 * pressed / (4 * PULLS):.0f} % of {4 * PULLS} random pulls press the button 5 mm |"


def grasp() -> Iterator[str]:
    """Yield how many objects are lifted by closing fully over 0.8 s and holding on."""
    task = load_task("simple_grasping")
    phases = (
        (1.2, 0.0, -0.1, 0.0, 0.0),
        (0.8, -0.1, -0.1, 0.0, 1.0),
        (1.5, -0.1, 0.05, 1.0, 1.0),
        (2.0, 0.05, 0.05, 1.0, 1.0),
    )
    for name, model in scenes(task):
        closing, lift = winches(model, "pull_close") + winches(model, "pull_curl"), model.actuator("carriage_lift").id
        controls = np.zeros((1, 2750, model.nu))
        row = 0
        for seconds, height, to_height, closed, to_closed in phases:
            count = round(seconds / 0.002)
            ramp = np.linspace(0, 1, count)
            controls[0, row : row + count, lift] = height + (to_height - height) * ramp
            share = closed + (to_closed - closed) * ramp
            controls[0][row : row + count, closing] = share[:, None] * model.actuator_ctrlrange[closing, 1]
            row += count
        lifted = 0
        for index in range(GRASPS):
            data = mujoco.MjData(model)
            apply_to_simulation(task.variation("development", index), model, data)
            low = float(data.body("object").xpos[2])
            _, sensors = play(model, state_of(model, data), controls)
            lifted += bool(sensors[0, -1, model.sensor("object_position").adr[0] + 2] - low > 0.1)
        yield f"| {name} | {lifted} of {GRASPS} objects raised by 0.1 m and kept |"


def travel() -> Iterator[str]:
    """Yield how fast random sinusoids carry the centre of mass over 10 s, in any direction."""
    task = load_task("flat_ground")
    steps = round(GAIT_S / 0.002)
    for name, model in scenes(task):
        data = mujoco.MjData(model)
        for _ in range(500):
            mujoco.mj_step(model, data)
        start, before = state_of(model, data), data.subtree_com[0].copy()
        rng, chosen, time = np.random.default_rng(1), winches(model), np.arange(steps)[:, None] * 0.002
        controls = np.zeros((GAITS, steps, model.nu))
        for gait in range(GAITS):
            size = len(chosen)
            phase = 2 * np.pi * rng.uniform(0.5, 2.5) * time + rng.uniform(0, 2 * np.pi, size)
            share = rng.uniform(-0.3, 0.5, size) + rng.uniform(0.4, 1.0, size) * np.sin(phase)
            controls[gait][:, chosen] = np.clip(share, 0, 1) * model.actuator_ctrlrange[chosen, 1]
        _, sensors = play(model, start, controls)
        first = int(model.sensor("com_position").adr[0])
        way = np.linalg.norm(sensors[:, -1, first : first + 2] - before[:2], axis=1) / GAIT_S
        yield f"| {name} | best {way.max():.2f} m/s, median {np.median(way):.3f} m/s of {GAITS} random sinusoids |"


def main() -> None:
    """Write all rows as one table."""
    head = ["| body | without learning |", "|---|---|"]
    command = "`python benchmarks/builtin/open_loop.py`"
    note = f"Made by {command} with MuJoCo {mujoco.__version__}; first parameters of each variant, seed 0."
    text = "\n".join([note, "", *head, *press(), *grasp(), *travel(), ""])
    Path(__file__).with_name("results.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
