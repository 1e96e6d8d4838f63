"""Likely causes of divergence, from the dimensionless numbers that limit the stability of integrators."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.actuator_force import output_of
from aidsr.sim.structure import Structure
from aidsr.sim.tendon_effects import length_gradient
from aidsr.validation.counterfactuals import mass_ratio
from aidsr.validation.thresholds import MAX_MASS_RATIO

_RK4, _EULER = int(mujoco.mjtIntegrator.mjINT_RK4), int(mujoco.mjtIntegrator.mjINT_EULER)
_STABLE_STEP = 2.0
"""dt * omega above which an undamped oscillator diverges. Source: stability of the semi-implicit Euler method."""
_STABLE_RK4_DAMPING = 2.7
"""dt * c / I above which Runge-Kutta of fourth order diverges. Source: its stability interval, 2.785 on the real
axis."""


def integration_numbers(model: mujoco.MjModel) -> tuple[float, float]:
    """Return dt * omega_max and dt * (damping / inertia)_max in the reference pose.

    omega_max is the largest natural frequency of joint springs, tendon springs and position servos together.

    Source: eigenvalues of M^-1 K and M^-1 C, with tendons and servos as J' k J.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    stiffness, damping = np.zeros_like(mass), np.diag(np.array(model.dof_damping))
    for joint in range(model.njnt):
        first = int(model.jnt_dofadr[joint])
        last = int(model.jnt_dofadr[joint + 1]) if joint + 1 < model.njnt else model.nv
        for dof in range(first, last):
            stiffness[dof, dof] += float(np.atleast_1d(model.jnt_stiffness[joint])[0])
    for tendon in range(model.ntendon):
        row = length_gradient(model, data, tendon)
        stiffness += float(np.atleast_1d(model.tendon_stiffness[tendon])[0]) * np.outer(row, row)
        damping += float(np.atleast_1d(model.tendon_damping[tendon])[0]) * np.outer(row, row)
    for actuator in range(model.nactuator):
        row = _actuator_row(model, data, actuator)
        stiffness += max(0.0, -float(model.actuator_biasprm[actuator, 1])) * np.outer(row, row)
        damping += max(0.0, -float(model.actuator_biasprm[actuator, 2])) * np.outer(row, row)
    timestep_s = float(model.opt.timestep)
    squared = np.linalg.eigvals(_per_inertia(mass, stiffness)).real.max(initial=0.0)
    rate = np.linalg.eigvals(_per_inertia(mass, damping)).real.max(initial=0.0)
    return timestep_s * float(np.sqrt(max(squared, 0.0))), timestep_s * float(rate)


def _per_inertia(mass: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return M^-1 A, with the pseudoinverse if M is singular, as with two hinges about one line."""
    try:
        return np.asarray(np.linalg.solve(mass, values))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(mass, hermitian=True) @ values)


def explain_divergence(model: mujoco.MjModel, structure: Structure) -> str:
    """Return the likely causes of a divergence in words, "" if no number indicates one."""
    if not model.nv:
        return ""
    step, damping = integration_numbers(model)
    weakest = min((float(model.dof_damping[dof]) for dof in _inner_dofs(model, structure)), default=0.0)
    servos = _explicit_servo_damping(model)
    ratio = mass_ratio(model, structure)
    causes = []
    if weakest < 0:
        causes.append(f"negative joint damping ({weakest:.3g})")
    if int(model.opt.integrator) == _RK4 and damping > _STABLE_RK4_DAMPING:
        causes.append(f"RK4 treats damping explicitly: dt x damping / inertia is {damping:.3g}, stable below 2.8")
    elif servos > _STABLE_STEP:
        causes.append(f"Euler treats kv explicitly: dt x kv / inertia is {servos:.3g}, stable below 2")
    if ratio > MAX_MASS_RATIO:
        causes.append(f"the heaviest body has {ratio:.3g} times the median's mass")
    if step > _STABLE_STEP:
        causes.append(f"too stiff for the time step: dt x omega is {step:.3g}, stable below 2 unless damped")
    if not causes and weakest == 0:
        causes.append(f"joints without damping (dt x omega is {step:.3g}; only damping takes out what a sweep puts in)")
    return "; ".join(causes)


def _explicit_servo_damping(model: mujoco.MjModel) -> float:
    """Return the largest eigenvalue of dt (M + dt D)^-1 J' kv J for the Euler integrator, 0 for any other.

    Source: MuJoCo documentation, Computation, "Numerical integration": Euler is implicit in joint damping D alone.
    """
    if int(model.opt.integrator) != _EULER:
        return 0.0
    data, mass = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    servos = np.zeros_like(mass)
    for actuator in range(model.nactuator):
        row = _actuator_row(model, data, actuator)
        servos += max(0.0, -float(model.actuator_biasprm[actuator, 2])) * np.outer(row, row)
    timestep_s = float(model.opt.timestep)
    mass += timestep_s * np.diag(np.array(model.dof_damping))
    return timestep_s * float(np.linalg.eigvals(_per_inertia(mass, servos)).real.max(initial=0.0))


def _inner_dofs(model: mujoco.MjModel, structure: Structure) -> list[int]:
    return [dof for dof in range(model.nv) if int(model.dof_jntid[dof]) in structure.joints]


def _actuator_row(model: mujoco.MjModel, data: mujoco.MjData, actuator: int) -> NDArray[np.float64]:
    row = np.zeros(model.nv)
    output = output_of(model, actuator)
    first, count = int(data.moment_rowadr[output]), int(data.moment_rownnz[output])
    row[data.moment_colind[first : first + count]] = data.actuator_moment.reshape(-1)[first : first + count]
    return row
