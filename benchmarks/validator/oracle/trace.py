"""One simulation of the oracle: one `mj_step` after the other, everything written down."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_BAD = [int(getattr(mujoco.mjtWarning, f"mjWARN_{name}")) for name in ("BADQPOS", "BADQVEL", "BADQACC", "INERTIA")]
_WATCHED = ("xipos", "qpos", "qvel", "sensordata", "ten_length", "actuator_force", "energy")
_OF_ROOT = ("xpos", "xmat")


@dataclass(frozen=True)
class Trace:
    """What one simulation did, one row a time step of the robot.

    Attributes:
        timestep_s: Between two rows.
        com_m: Centres of mass seen from the root body, (n_rows, nbody, 3).
        world_m: The same in the world.
        shaking_m_s2: Size of their acceleration in the last quarter, over the oracle's last three steps: what shakes at
            every other step stands still when looked at from row to row.
        qpos, qvel, sensors, tendons_m: As in MjData.
        forces_n: Force of every actuator on its joint or tendon, negative where a tendon is pulled, (n_rows, nu).
        energy_j: Potential and kinetic energy together.
        failed: Whether MuJoCo warned of bad numbers, or one is not finite.
    """

    timestep_s: float
    com_m: Array
    world_m: Array
    shaking_m_s2: Array
    qpos: Array
    qvel: Array
    sensors: Array
    tendons_m: Array
    forces_n: Array
    energy_j: Array
    failed: bool
    end: mujoco.MjData


def record(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    begin: Array,
    target: Array | Callable[[float], Array] | None,
    duration_s: float,
    root: int,
    substeps: int,
) -> Trace:
    """Simulate, and write down every `substeps`-th step: one row a time step of the robot."""
    frame_s = float(model.opt.timestep) * substeps
    frames = round(duration_s / frame_s)
    data.time = 0
    data.ctrl[:] = begin
    for i in range(model.nu):
        if model.actuator_actnum[i] == 1:
            data.act[model.actuator_actadr[i]] = begin[i]
    # views of MjData are read in place; asking for the attributes each step would cost as much as the physics
    watched = {name: getattr(data, name) for name in _WATCHED} | {name: getattr(data, name)[root] for name in _OF_ROOT}
    rows = {name: np.empty((frames, *value.shape)) for name, value in watched.items()}
    quarter = 3 * frames // 4
    place, changes = watched["xipos"], np.empty((frames - quarter, model.nbody, 3))
    latest = deque([place.copy()] * 3, maxlen=3)
    energy, ctrl, count = watched["energy"], data.ctrl, 0
    for frame in range(frames):
        if callable(target):
            ctrl[:] = target(frame * frame_s)
        elif target is not None:
            ctrl[:] = begin + min(1.0, frame / (0.25 * frames)) * (target - begin)
        if frame < quarter - 2:
            mujoco.mj_step(model, data, substeps)
        else:
            for _ in range(substeps):
                mujoco.mj_step(model, data)
                latest.append(place.copy())
        if not math.isfinite(energy[0] + energy[1]) or (frame % 16 == 0 and _has_failed(data)):
            break
        for name, value in watched.items():
            rows[name][frame] = value
        if frame >= quarter:
            changes[frame - quarter] = latest[2] - 2 * latest[1] + latest[0]
        count += 1
    world, frames_of_root = rows["xipos"][:count], rows["xmat"][:count].reshape(count, 3, 3)
    return Trace(
        timestep_s=frame_s,
        com_m=(world - rows["xpos"][:count, None]) @ frames_of_root,
        world_m=world,
        shaking_m_s2=np.linalg.norm(changes[: max(0, count - quarter)], axis=2) / model.opt.timestep**2,
        qpos=rows["qpos"][:count],
        qvel=rows["qvel"][:count],
        sensors=rows["sensordata"][:count],
        tendons_m=rows["ten_length"][:count],
        forces_n=rows["actuator_force"][:count] * model.actuator_gear[:, 0],
        energy_j=rows["energy"][:count].sum(axis=1),
        failed=count < frames or _has_failed(data),
        end=data,
    )


def _has_failed(data: mujoco.MjData) -> bool:
    return any(data.warning[kind].number for kind in _BAD)
