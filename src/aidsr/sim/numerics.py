"""Copies of a compiled model of the same physics, computed in another way: what is real survives that."""

from __future__ import annotations

import copy

import mujoco

_INTEGRATORS = {
    "discrete": int(mujoco.mjtIntegrator.mjINT_DISCRETE),
    "implicitfast": int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST),
    "Euler": int(mujoco.mjtIntegrator.mjINT_EULER),
}
"""To be tried, in this order. The first computes limits and contacts in another way than all others do, and differs
most; at 2 ms it also lets them give way more than it does at smaller steps (docs/physics.md)."""


def at_half_the_time_step(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy with half the time step."""
    changed = copy.copy(model)
    changed.opt.timestep /= 2
    return changed


def with_other_integrators(model: mujoco.MjModel) -> dict[str, mujoco.MjModel]:
    """Return two copies by the names of their integrators, neither the model's own, the more different one first."""
    others = [name for name, number in _INTEGRATORS.items() if number != model.opt.integrator][:2]
    return {name: _with_integrator(model, _INTEGRATORS[name]) for name in others}


def _with_integrator(model: mujoco.MjModel, number: int) -> mujoco.MjModel:
    changed = copy.copy(model)
    changed.opt.integrator = number
    return changed
