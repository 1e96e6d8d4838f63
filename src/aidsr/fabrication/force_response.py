"""Length by which each cable is reeled in at a given control, measured in simulation.

Cables are pulled one at a time until the robot is at rest.
"""

from __future__ import annotations

import mujoco
import numpy as np

from aidsr.core.artifacts import Artifact
from aidsr.mjcf.compile import compile_mjcf
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.sim.actuator_force import control_of, gear_of, output_of
from aidsr.sim.structure import name_of

_LEVELS = 6
_SETTLING_S, _LOOK_S = 1.0, 0.1
"""Longest wait at a control value, and interval at which the motion of the cable is checked. Our choice: long compared
with the 0.05 s time constant of the winches and the swing of a limb; the remaining drift is part of the result."""

_STILL_M = 5e-6
"""Movement between two checks below which a cable is at rest. Our choice: below the resolution of a winch."""

_LIMITS = Limits(wall_s=300, cpu_s=120)
_TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)


class Response(Artifact):
    """Static response of the robot to one actuator, with all others at zero control."""

    actuator: str
    ctrl: tuple[float, ...]
    """Control values from rest to the end of its range, in the units of the simulation."""
    force_n: tuple[float, ...]
    """Tension of the cable at each control value, with the robot at rest."""
    reeled_in_mm: tuple[float, ...]
    """Length reeled in at each control value, from the length in the initial pose."""


@isolated(limits=_LIMITS)
def responses(mjcf: str) -> tuple[Response, ...]:
    """Return the response of each tendon actuator of a robot.

    Raises:
        IsolationError: The simulation exceeded a limit.
    """
    model = compile_mjcf(mjcf)
    model.opt.gravity[:] = 0.0  # the same result for every orientation of the mount
    actuators = [index for index in range(model.nactuator) if int(model.actuator_trntype[index]) == _TENDON]
    return tuple(_response(model, index) for index in actuators)


def _response(model: mujoco.MjModel, actuator: int) -> Response:
    """Return the response from rest to the end of the control range that pulls harder; cables cannot push."""
    control = control_of(model, actuator)
    low, high = model.actuator_ctrlrange[control] if model.actuator_ctrllimited[control] else (0.0, 1.0)
    rest = float(np.clip(0.0, low, high))
    ends = [float(end) for end in (low, high) if end != rest] or [rest]
    return max((_towards(model, actuator, rest, end) for end in ends), key=lambda found: found.force_n[-1])


def _towards(model: mujoco.MjModel, actuator: int, rest: float, far: float) -> Response:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    tendon = int(model.actuator_trnid[actuator, 0])
    drawn, gear = float(data.ten_length[tendon]), float(gear_of(model, actuator)[0])
    control, output = control_of(model, actuator), output_of(model, actuator)
    levels = np.linspace(rest, far, _LEVELS)
    forces, reeled = [], []
    for level in levels:
        data.ctrl[control] = level
        _settle(model, data, tendon)
        forces.append(-gear * float(data.actuator_force[output]))
        reeled.append(1000.0 * (drawn - float(data.ten_length[tendon])))
    return Response(
        actuator=name_of(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator),
        ctrl=tuple(levels.tolist()),
        force_n=tuple(round(force, 4) for force in forces),
        reeled_in_mm=tuple(round(length, 3) for length in reeled),
    )


def _settle(model: mujoco.MjModel, data: mujoco.MjData, tendon: int) -> None:
    """Step the simulation until a cable is at rest, at most `_SETTLING_S`."""
    steps = max(1, round(_LOOK_S / model.opt.timestep))
    for look in range(round(_SETTLING_S / _LOOK_S)):
        before = float(data.ten_length[tendon])
        mujoco.mj_step(model, data, steps)
        if look and abs(float(data.ten_length[tendon]) - before) < _STILL_M:
            return
