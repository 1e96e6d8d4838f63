"""What a person can pull: one slider for each actuator, and one for those that act together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import ActuatorGroup
from aidsr.sim.drive import Drive
from aidsr.sim.ownership import ROBOT_PREFIX
from aidsr.sim.structure import Structure, name_of

_ACTUATOR = mujoco.mjtObj.mjOBJ_ACTUATOR
_UNLIMITED_END = 1.0  # as in `aidsr.sim.drive`


def control_facts(model: mujoco.MjModel, drives: Sequence[Drive], neutral: NDArray[np.float64]) -> list[dict[str, Any]]:
    """Return a slider for each actuator, the robot's first.

    A slider runs from `release` to `pull`, so that to the right always pulls a tendon, whatever sign the actuator gives
    to it.
    """
    return [_driven(model, drive, neutral) for drive in drives] + _others(model, drives, neutral)


def _driven(model: mujoco.MjModel, drive: Drive, neutral: NDArray[np.float64]) -> dict[str, Any]:
    return {
        "name": name_of(model, _ACTUATOR, drive.actuator),
        "at": drive.ctrl,
        "pull": drive.pull,
        "release": drive.release,
        "neutral": float(neutral[drive.ctrl]),
        "robot": True,
        "pulls_tendon": drive.on_tendon,
    }


def _others(model: mujoco.MjModel, drives: Sequence[Drive], neutral: NDArray[np.float64]) -> list[dict[str, Any]]:
    """Return a slider for each actuator of the surroundings, over its range."""
    facts = []
    for actuator in sorted(set(range(model.nactuator)) - {drive.actuator for drive in drives}):
        limited = bool(model.actuator_ctrllimited[actuator])
        low, high = model.actuator_ctrlrange[actuator] if limited else (-_UNLIMITED_END, _UNLIMITED_END)
        at = int(model.actuator_ctrladr[actuator])
        facts.append(
            {
                "name": name_of(model, _ACTUATOR, actuator),
                "at": at,
                "pull": float(high),
                "release": float(low),
                "neutral": float(neutral[at]),
                "robot": False,
                "pulls_tendon": False,
            }
        )
    return facts


def group_facts(model: mujoco.MjModel, structure: Structure, declared: Sequence[ActuatorGroup]) -> list[dict[str, Any]]:
    """Return the robot's actuator groups as its author defines them, else limbs of the same build, by name."""
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
            "name": f"{name_of(model, _ACTUATOR, ids[0]).removeprefix(ROBOT_PREFIX)} and alike",
            "members": [name_of(model, _ACTUATOR, i) for i in ids],
        }
        for ids in structure.symmetric_groups
    ]
