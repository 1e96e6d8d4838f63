"""Direction in which actuators act, measured by holding commands and changing the length of cables."""

from __future__ import annotations

import mujoco
import numpy as np
from benchmarks.validator.oracle.loop import Bench
from benchmarks.validator.oracle.trace import Array

_MUSCLE = int(mujoco.mjtGain.mjGAIN_MUSCLE)
_BENT_RAD = 0.05


def inverted(bench: Bench) -> float:
    """Return 2 if one cable is pushed at every command while another is pulled, or one runs away or never lets go.

    Otherwise return 0.
    """
    model = bench.model
    cables = [
        actuator
        for actuator in bench.pulling
        if int(model.wrap_type[model.tendon_adr[model.actuator_trnid[actuator, 0]]]) != int(mujoco.mjtWrap.mjWRAP_JOINT)
        and int(model.actuator_gaintype[actuator]) != _MUSCLE
    ]
    poses = [bend * np.ones(model.nv) for bend in (0.0, _BENT_RAD, -_BENT_RAD)]
    held = {actuator: [_held(bench, actuator, pose) for pose in poses] for actuator in cables}
    signs = {actuator: [force for pose in poses_held for force in pose[1]] for actuator, poses_held in held.items()}
    pulls = any(min(forces) < 0 for forces in signs.values())
    pushes = any(min(forces) >= 0 and max(forces) > 0 for forces in signs.values())
    runs = any(_grows(poses_held) for poses_held in held.values())
    return 2.0 if (pushes and pulls) or runs or any(_never_lets_go(bench, a) for a in cables) else 0.0


def _held(bench: Bench, actuator: int, turn: Array) -> tuple[float, tuple[float, float]]:
    """Return a cable's length in a pose [m], and the force on it at both ends of the range [N], negative for a pull."""
    model, data = bench.model, mujoco.MjData(bench.model)
    inner = np.array([int(model.jnt_type[joint]) != int(mujoco.mjtJoint.mjJNT_FREE) for joint in model.dof_jntid])
    mujoco.mj_integratePos(model, data.qpos, np.where(inner, turn, 0.0), 1.0)
    forces = []
    for command in bench.range_of(actuator):
        data.ctrl[:], data.act[:] = command, command
        mujoco.mj_forward(model, data)
        forces.append(float(data.actuator_force[actuator] * model.actuator_gear[actuator, 0]))
    return float(data.ten_length[int(model.actuator_trnid[actuator, 0])]), (forces[0], forces[1])


def _grows(held: list[tuple[float, tuple[float, float]]]) -> bool:
    """Return whether the force on a cable pushes more the longer the cable is; it should pull it back."""
    by_length = sorted(held)
    (short, first), (long, last) = by_length[0], by_length[-1]
    room = max(map(abs, (*first, *last)), default=0.0)
    return long - short > 0 and any(b - a > 1e-6 * room for a, b in zip(first, last, strict=True))


def _never_lets_go(bench: Bench, actuator: int) -> bool:
    """Return whether a servo without force limits would pull a cable of length 0 at both ends of its range."""
    model = bench.model
    gain, bias, gear = model.actuator_gainprm[actuator, 0], model.actuator_biasprm[actuator], model.actuator_gear
    if not bias[1]:
        return False
    return all((gain * end + bias[0]) * gear[actuator, 0] < 0 for end in bench.range_of(actuator))
