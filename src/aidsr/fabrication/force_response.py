"""Length by which each cable is reeled in at a given control, measured in simulation.

Cables are pulled one at a time until the robot is at rest, while the others are slack.
"""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Artifact
from aidsr.mjcf.compile import compile_mjcf
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.sim.actuator_force import gear_of, output_of
from aidsr.sim.deactivate import switched_off
from aidsr.sim.drive import Drive, neutral_ctrl, read_drives, set_act
from aidsr.sim.structure import name_of, read_structure

_LEVELS = 6
_SETTLING_S, _LOOK_S = 1.0, 0.1
"""Longest wait at a control value, and interval at which the motion of the cable is checked. Our choice: long compared
with the 0.05 s time constant of the winches and the swing of a limb; the remaining drift is part of the result."""

_STILL_M = 5e-6
"""Movement between two checks below which a cable is at rest. Our choice: below the resolution of a winch."""

_LIMITS = Limits(wall_s=300, cpu_s=120)


class Response(Artifact):
    """Static response of the robot to one actuator on a tendon, with no force by the others on tendons.

    All other actuators stay at their neutral controls.
    """

    actuator: str
    ctrl: tuple[float, ...]
    """Control values from the neutral one to the end that pulls hardest, in the units of the simulation."""
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
    drawn, structure = mujoco.MjData(model), read_structure(model)
    mujoco.mj_forward(model, drawn)
    neutral, found = neutral_ctrl(model, drawn), []
    for drive in read_drives(model, drawn, structure):
        if drive.on_tendon:
            others = [actuator for actuator in structure.tendon_actuators if actuator != drive.actuator]
            found.append(_response(switched_off(model, others), drive, neutral))
    return tuple(found)


def _response(model: mujoco.MjModel, drive: Drive, neutral: NDArray[np.float64]) -> Response:
    """Return the response from the neutral control to the one that pulls hardest; cables cannot push.

    Args:
        model: Model in which the other actuators on tendons are switched off.
        drive: Characteristic controls of the actuator.
        neutral: Neutral control of every actuator, (nu,).
    """
    data = mujoco.MjData(model)
    data.ctrl[:] = neutral
    set_act(model, data, neutral)
    mujoco.mj_forward(model, data)
    tendon = int(model.actuator_trnid[drive.actuator, 0])
    drawn, gear = float(data.ten_length[tendon]), float(gear_of(model, drive.actuator)[0])
    levels = np.linspace(drive.neutral, drive.pull, _LEVELS)
    forces, reeled = [], []
    for level in levels:
        data.ctrl[drive.ctrl] = level
        _settle(model, data, tendon)
        forces.append(-gear * float(data.actuator_force[output_of(model, drive.actuator)]))
        reeled.append(1000.0 * (drawn - float(data.ten_length[tendon])))
    return Response(
        actuator=name_of(model, mujoco.mjtObj.mjOBJ_ACTUATOR, drive.actuator),
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
