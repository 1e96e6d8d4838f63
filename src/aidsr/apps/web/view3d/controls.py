"""Sliders of a view: one for each actuator, and one for each group of actuators that act together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import ActuatorGroup
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sim.actuator_force import control_of
from aidsr.sim.command import command_of, is_spatial
from aidsr.sim.drive import UNLIMITED_END, Drive, held_forces
from aidsr.sim.structure import Structure, name_of

_ACTUATOR = mujoco.mjtObj.mjOBJ_ACTUATOR
_PLACES = 11
"""Number of positions along a slider at which the pull is computed; a page interpolates between them. Our choice: steps
of a tenth."""


def control_facts(
    model: mujoco.MjModel, data: mujoco.MjData, drives: Sequence[Drive], neutral: NDArray[np.float64]
) -> list[dict[str, Any]]:
    """Return a slider for each actuator, the robot's first.

    `pulls_n` is the pull on a cable at positions along its slider [N]. It is empty for any other actuator, also for one
    on a fixed tendon, whose pull is a force or a torque, depending on the tendon's coefficients.

    A slider runs from `release` to `pull`, so that moving it to the right always pulls a tendon, whatever the sign of
    the actuator's command.
    """
    pulls = _pulls(model, data, drives, neutral)
    driven = [_driven(model, drive, neutral, pull) for drive, pull in zip(drives, pulls, strict=True)]
    return driven + _others(model, drives, neutral)


def _driven(
    model: mujoco.MjModel, drive: Drive, neutral: NDArray[np.float64], pull: NDArray[np.float64]
) -> dict[str, Any]:
    cable = drive.on_tendon and is_spatial(model, int(model.actuator_trnid[drive.actuator, 0]))
    return {
        "name": name_of(model, _ACTUATOR, drive.actuator),
        "at": drive.ctrl,
        "pull": drive.pull,
        "release": drive.release,
        "neutral": float(neutral[drive.ctrl]),
        "robot": True,
        "pulls_tendon": drive.on_tendon,
        "unit": control_unit(model, drive.actuator),
        "pulls_n": [round(float(each), 4) for each in pull] if cable else [],
    }


def _others(model: mujoco.MjModel, drives: Sequence[Drive], neutral: NDArray[np.float64]) -> list[dict[str, Any]]:
    """Return a slider for each actuator that is not the robot's, over its control range."""
    facts = []
    for actuator in sorted(set(range(model.nactuator)) - {drive.actuator for drive in drives}):
        at = control_of(model, actuator)
        low, high = model.actuator_ctrlrange[at] if model.actuator_ctrllimited[at] else (-UNLIMITED_END, UNLIMITED_END)
        facts.append(
            {
                "name": name_of(model, _ACTUATOR, actuator),
                "at": at,
                "pull": float(high),
                "release": float(low),
                "neutral": float(neutral[at]),
                "robot": False,
                "pulls_tendon": False,
                "unit": control_unit(model, actuator),
                "pulls_n": [],
            }
        )
    return facts


def _pulls(
    model: mujoco.MjModel, data: mujoco.MjData, drives: Sequence[Drive], neutral: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return how hard each drive pulls in the robot's rest pose, (drives, positions along its slider) [N]."""
    probe = mujoco.MjData(model)
    probe.qpos[:] = data.qpos
    pulls = np.zeros((len(drives), _PLACES))
    for place, share in enumerate(np.linspace(0.0, 1.0, _PLACES)):
        ctrl = neutral.copy()
        for drive in drives:
            ctrl[drive.ctrl] = drive.release + share * (drive.pull - drive.release)
        forces = held_forces(model, probe, ctrl)
        pulls[:, place] = [max(-drive.side * forces[drive.actuator], 0.0) for drive in drives]
    return pulls


def control_unit(model: mujoco.MjModel, actuator: int) -> str:
    """Return the unit of an actuator's command; empty where it is unknown, or a gear or a gain scales the command."""
    command = command_of(model, actuator)
    return command.unit if command and np.isclose(abs(command.factor), 1.0) else ""


def group_facts(model: mujoco.MjModel, structure: Structure, declared: Sequence[ActuatorGroup]) -> list[dict[str, Any]]:
    """Return the robot's actuator groups as its author defines them, else actuators that do the same in equal limbs.

    Each group has a name and the names of its actuators; a declared group of one actuator is left out.
    """
    if declared:
        known = {name_of(model, _ACTUATOR, actuator) for actuator in range(model.nactuator)}
        named = {group.name: [n if n in known else ROBOT_PREFIX + n for n in group.actuators] for group in declared}
        return [
            {"name": name, "members": members}
            for name, members in named.items()
            if len(members) > 1 and known.issuperset(members)
        ]
    return [
        {
            "name": f"{name_of(model, _ACTUATOR, ids[0]).removeprefix(ROBOT_PREFIX)} and similar",
            "members": [name_of(model, _ACTUATOR, i) for i in ids],
        }
        for ids in structure.symmetric_groups
    ]
