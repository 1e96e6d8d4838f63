"""How far each cable is reeled in for a given control: pulled one at a time in simulation, until the robot rests."""

from __future__ import annotations

import mujoco
import numpy as np

from aidsr.core.artifacts import Artifact
from aidsr.mjcf.compile import compile_mjcf
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.sim.structure import name_of

_LEVELS = 6
_SETTLING_S, _LOOK_S = 1.0, 0.1
"""Longest wait at a control, and how often it is looked whether the cable still moves. Our choice: long against the
0.05 s of the winches and the swing of a limb; the drift that is left is recorded."""

_STILL_M = 5e-6
"""What a cable may still move between two looks. Our choice: below what a winch resolves."""

_LIMITS = Limits(wall_s=300, cpu_s=120)
_TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)


class Response(Artifact):
    """What one actuator does alone."""

    actuator: str
    ctrl: tuple[float, ...]
    """From rest to the end of its range, in the units of the simulation."""
    force_n: tuple[float, ...]
    """Tension of the cable at rest there."""
    reeled_in_mm: tuple[float, ...]


@isolated(limits=_LIMITS)
def responses(mjcf: str) -> tuple[Response, ...]:
    """Return the response of each tendon actuator of a robot.

    Raises:
        IsolationError: Simulating ran past a limit.
    """
    model = compile_mjcf(mjcf)
    model.opt.gravity[:] = 0.0  # the same answer however the robot is mounted
    actuators = [index for index in range(model.nu) if int(model.actuator_trntype[index]) == _TENDON]
    return tuple(_response(model, index) for index in actuators)


def _response(model: mujoco.MjModel, actuator: int) -> Response:
    """Return what one actuator does from rest to the end of its range that pulls hardest: cables cannot push."""
    low, high = model.actuator_ctrlrange[actuator] if model.actuator_ctrllimited[actuator] else (0.0, 1.0)
    rest = float(np.clip(0.0, low, high))
    ends = [float(end) for end in (low, high) if end != rest] or [rest]
    return max((_towards(model, actuator, rest, end) for end in ends), key=lambda found: found.force_n[-1])


def _towards(model: mujoco.MjModel, actuator: int, rest: float, far: float) -> Response:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    tendon = int(model.actuator_trnid[actuator, 0])
    drawn, gear = float(data.ten_length[tendon]), float(model.actuator_gear[actuator, 0])
    levels = np.linspace(rest, far, _LEVELS)
    forces, reeled = [], []
    for level in levels:
        data.ctrl[actuator] = level
        _settle(model, data, tendon)
        forces.append(-gear * float(data.actuator_force[actuator]))
        reeled.append(1000.0 * (drawn - float(data.ten_length[tendon])))
    return Response(
        actuator=name_of(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator),
        ctrl=tuple(levels.tolist()),
        force_n=tuple(round(force, 4) for force in forces),
        reeled_in_mm=tuple(round(length, 3) for length in reeled),
    )


def _settle(model: mujoco.MjModel, data: mujoco.MjData, tendon: int) -> None:
    """Step until a cable rests, or for as long as is waited at most."""
    steps = max(1, round(_LOOK_S / model.opt.timestep))
    for look in range(round(_SETTLING_S / _LOOK_S)):
        before = float(data.ten_length[tendon])
        mujoco.mj_step(model, data, steps)
        if look and abs(float(data.ten_length[tendon]) - before) < _STILL_M:
            return
