"""What keeps a scene from being simulated on a graphics processor by MuJoCo Warp.

Our own episodes run on processors only. This check is what a way over CUDA has to ask first; the functions of the tasks
are arrays throughout and would not change.

Source: MuJoCo Warp 4.0.0, `put_model` in io.py, which refuses what is listed here, and types.py, where the fields of
the model that may differ between simulations have a leading "*".
"""

from __future__ import annotations

from collections.abc import Iterable

import mujoco
import numpy as np

from aidsr.tasks import Task

__all__ = ["warp_lacks", "warp_sentence"]

_ELEMENTS = {
    "actuator_trntype": (mujoco.mjtTrn, {"mjTRN_SO3", "mjTRN_UNDEFINED"}),
    "actuator_dyntype": (mujoco.mjtDyn, {"mjDYN_PID"}),
    "actuator_gaintype": (mujoco.mjtGain, {"mjGAIN_PID"}),
    "actuator_biastype": (mujoco.mjtBias, {"mjBIAS_SO3"}),
    "eq_type": (mujoco.mjtEq, {"mjEQ_FLEXVERT", "mjEQ_DISTANCE"}),
    "sensor_type": (mujoco.mjtSensor, {"mjSENS_PLUGIN"}),
}
"""Fields of MjModel with one entry for each element, and the kinds that Warp lacks."""
_FLAGS = ("mjENBL_OVERRIDE", "mjENBL_FWDINV", "mjENBL_DIAGEXACT", "mjENBL_IPC")
_SHARED = ("geom_type",)
"""Fields that our tasks vary and that all simulations of Warp share."""
_DRAWN = 50
"""Variations looked at. Our choice: a third of the objects being of another shape is seen in any of them."""


def warp_lacks(model: mujoco.MjModel, task: Task) -> tuple[str, ...]:
    """Return what a scene uses and MuJoCo Warp does not support, by MuJoCo's names; empty where it could run.

    Args:
        model: The compiled scene.
        task: Its task, whose variations have to differ between the simulations of a batch.
    """
    found: list[str] = []
    for field, (kinds, lacking) in _ELEMENTS.items():
        found += [name for name in sorted(lacking) if (getattr(model, field) == int(getattr(kinds, name))).any()]
    if model.opt.solver == int(mujoco.mjtSolver.mjSOL_PGS):
        found.append("mjSOL_PGS")
    if model.opt.noslip_iterations and model.opt.integrator == int(mujoco.mjtIntegrator.mjINT_DISCRETE):
        found.append("noslip iterations with mjINT_DISCRETE")
    found += [flag for flag in _FLAGS if model.opt.enableflags & int(getattr(mujoco.mjtEnableBit, flag))]
    if any((getattr(model, f"{element}_plugin") != -1).any() for element in ("body", "actuator", "sensor")):
        found.append("plugins")
    return (*found, *(f"{field} that differs between simulations" for field in _varied(model, task)))


def warp_sentence(model: mujoco.MjModel, task: Task) -> str:
    """Return in one sentence whether MuJoCo Warp could run a scene, naming what it lacks."""
    lacks = warp_lacks(model, task)
    if not lacks:
        return "MuJoCo Warp supports all that this scene uses"
    return f"MuJoCo Warp does not support {', '.join(lacks)}, which this scene uses; simulate it on processors"


def _varied(model: mujoco.MjModel, task: Task) -> Iterable[str]:
    """Return the shared fields to which the task's variations give different values."""
    drawn = [task.variation("development", index) for index in range(_DRAWN)]
    for field in _SHARED:
        values: dict[str, set[float]] = {}
        for variation in drawn:
            for change in variation.changes:
                if change.field == field:
                    present = np.atleast_1d(
                        getattr(model, field)[getattr(model, field.partition("_")[0])(change.name).id]
                    )
                    values.setdefault(change.name, {float(present[0])}).add(change.value[0])
        if any(len(different) > 1 for different in values.values()):
            yield field
