"""Copies of a compiled model with the same physics and other numerics, to test whether a result depends on them."""

from __future__ import annotations

import copy

import mujoco

_INTEGRATORS = {
    "discrete": int(mujoco.mjtIntegrator.mjINT_DISCRETE),
    "implicitfast": int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST),
    "Euler": int(mujoco.mjtIntegrator.mjINT_EULER),
}
"""Integrators to try, in this order. The first one differs most from the others: it computes limits and contacts in a
different way. At 2 ms its limits and contacts are also softer than at smaller time steps (docs/physics.md)."""


def at_half_the_time_step(model: mujoco.MjModel) -> mujoco.MjModel:
    """Return a copy with half the time step."""
    changed = copy.copy(model)
    changed.opt.timestep /= 2
    return changed


def with_other_integrators(model: mujoco.MjModel) -> dict[str, mujoco.MjModel]:
    """Return two copies with integrators other than the model's, by integrator name; the most different one first."""
    others = [name for name, number in _INTEGRATORS.items() if number != model.opt.integrator][:2]
    return {name: _with_integrator(model, _INTEGRATORS[name]) for name in others}


def _with_integrator(model: mujoco.MjModel, number: int) -> mujoco.MjModel:
    changed = copy.copy(model)
    changed.opt.integrator = number
    return changed
