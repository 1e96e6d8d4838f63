"""One simulation of the oracle: a loop over `mj_step` that records all quantities."""

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
    """Record of one simulation, with one row per time step of the robot.

    Attributes:
        timestep_s: Time between two rows.
        com_m: Centres of mass in the frame of the root body, (n_rows, nbody, 3).
        world_m: Centres of mass in the world, (n_rows, nbody, 3).
        shaking_m_s2: Magnitude of the accelerations of the centres of mass in the last quarter, from the oracle's last
            three steps. Differences between rows would not show a body that shakes at every other step.
        qpos, qvel, sensors, tendons_m: Positions, velocities, sensor data and tendon lengths as in MjData.
        forces_n: Force of every actuator on its joint or tendon, negative if a tendon is pulled, (n_rows, nu).
        energy_j: Sum of potential and kinetic energy.
        failed: Whether MuJoCo warned of bad numbers, or the energy was not finite.
        end: State at the end.
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
    """Simulate and record every `substeps`-th step, which gives one row per time step of the robot.

    Args:
        model: Model with the time step of the oracle.
        data: State at the start; it is advanced to the end.
        begin: Commands at the start.
        target: Commands that are reached in a quarter of the time, or commands as a function of time [s]; None to keep
            those of the start.
        duration_s: Duration of the simulation [s].
        root: Body in whose frame centres of mass are recorded.
        substeps: Steps of the oracle per row.
    """
    frame_s = float(model.opt.timestep) * substeps
    frames = round(duration_s / frame_s)
    data.time = 0
    data.ctrl[:] = begin
    for i in range(model.nu):
        if model.actuator_actnum[i] == 1:
            data.act[model.actuator_actadr[i]] = begin[i]
    # views of MjData are read in place; accessing its attributes in each step would cost as much as the physics
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
