"""Search for the cause of a divergence: change one property at a time and run the whole protocol again."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from aidsr.core.formatting import format_number
from aidsr.sim.structure import STANDARD_GRAVITY_M_S2
from aidsr.validation.protocol import Protocol, Variant, gather_evidence
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.stiffness import integration_numbers

_EXPLICIT = (int(mujoco.mjtIntegrator.mjINT_EULER), int(mujoco.mjtIntegrator.mjINT_RK4))
_LONG_STEP_S = 0.003
_SHORTEST_STEP_S = 1e-4
_LEAST_DAMPING_S, _DAMPING_S = 0.005, 0.02
"""Damping / stiffness [s] below which the damping of a joint is unusually low, and the value that is tried. Our
choice."""
_LOUD_N, _LOUD_WEIGHTS = 30.0, 50.0
"""Actuator force that is unreasonable for a cable robot: above both 30 N and 50 times its weight; see
`actuator_overforce`."""
_MOST_STEPS = 1_000_000
"""Most time steps of all trials together. Our choice: half of the limit for one validation."""


@dataclass(frozen=True)
class Trial:
    """One change of the model that may remove a divergence.

    Attributes:
        words: Description of the change that completes "it no longer fails ...".
        cure: The same change as an instruction to the author of the robot.
        change: Function that makes the change.
        odd: Whether the property that is changed has an unusual value; such changes are tried first.
    """

    words: str
    cure: str
    change: Variant
    odd: bool


def find_cause(robot: RobotUnderTest) -> Trial | None:
    """Return the first change with which no test of a robot diverges.

    None if no change helps, or if the trials would take more than `_MOST_STEPS` time steps.
    """
    steps = 0
    for trial in sorted(_trials(robot), key=lambda trial: not trial.odd):
        changed = copy.copy(robot.model)
        trial.change(changed)
        steps += Protocol().steps(changed, robot.structure)
        if steps > _MOST_STEPS:
            return None
        evidence = gather_evidence(changed, robot.structure)
        if not RobotUnderTest(model=changed, structure=robot.structure, evidence=evidence).diverges:
            return trial
    return None


def _trials(robot: RobotUnderTest) -> Iterator[Trial]:
    """Yield the changes in the order of how much they alter the robot, the smallest first."""
    yield from _of_integration(robot)
    yield from _of_strength(robot)
    yield from _of_surroundings(robot)


def _of_integration(robot: RobotUnderTest) -> Iterator[Trial]:
    model = robot.model
    timestep_s = float(model.opt.timestep)
    if int(model.opt.integrator) in _EXPLICIT:

        def implicit(changed: mujoco.MjModel) -> None:
            changed.opt.integrator = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)

        yield Trial('with integrator="implicitfast"', 'Set <option integrator="implicitfast"/>.', implicit, odd=True)
    floor = _DAMPING_S * np.asarray(model.jnt_stiffness).reshape(model.njnt, -1)[:, 0][model.dof_jntid]
    inner = np.isin(model.dof_jntid, robot.structure.joints)
    hardly = inner & (model.dof_damping < _LEAST_DAMPING_S / _DAMPING_S * floor)
    if (inner & (model.dof_damping < floor)).any():

        def damped(changed: mujoco.MjModel) -> None:
            changed.dof_damping[:] = np.maximum(changed.dof_damping, np.where(inner, floor, 0.0))

        most = format_number(float(floor[inner].max()))
        yield Trial(
            f"with joint damping of {_DAMPING_S:g} s times the stiffness ({most} at most)",
            f"Give each joint damping of {_DAMPING_S:g} s times its stiffness, {most} for the stiffest.",
            damped,
            odd=bool(hardly.any()),
        )
    for parts in (2, 4, 8):
        shorter_s = timestep_s / parts
        if shorter_s >= _SHORTEST_STEP_S:

            def finer(changed: mujoco.MjModel, step_s: float = shorter_s) -> None:
                changed.opt.timestep = step_s

            yield Trial(
                f"with a time step of {shorter_s:g} s",
                f'Set <option timestep="{shorter_s:g}"/>.',
                finer,
                odd=timestep_s > _LONG_STEP_S,
            )


def _of_strength(robot: RobotUnderTest) -> Iterator[Trial]:
    drives, weight_n = robot.driven.drives, robot.structure.mass_kg * STANDARD_GRAVITY_M_S2
    force_n = max((max(abs(drive.force_low_n), abs(drive.force_high_n)) for drive in drives), default=0.0)
    reason_n = max(_LOUD_N, _LOUD_WEIGHTS * weight_n)
    stiff = bool(robot.model.nv) and integration_numbers(robot.model)[0] > 2
    for share in (0.2, 0.04, *((reason_n / force_n,) if force_n > 25 * reason_n else ())):

        def weaker(changed: mujoco.MjModel, factor: float = share) -> None:
            changed.actuator_gainprm[:] *= factor
            changed.actuator_biasprm[:] *= factor

        def softer(changed: mujoco.MjModel, factor: float = share) -> None:
            for values in (changed.jnt_stiffness, changed.tendon_stiffness):
                values[:] *= factor

        times = format_number(1 / share)
        if force_n:
            yield Trial(
                f"with {times} times weaker actuators (now {format_number(force_n)} N, the robot weighs "
                f"{format_number(weight_n)} N)",
                f"Make the actuators {times} times weaker: ctrlrange, forcerange, kp and gear.",
                weaker,
                odd=force_n > reason_n,
            )
        yield Trial(
            f"with {times} times softer springs",
            f"Make joints and tendon springs {times} times softer.",
            softer,
            odd=stiff,
        )


def _of_surroundings(robot: RobotUnderTest) -> Iterator[Trial]:
    gravity_m_s2 = float(np.linalg.norm(robot.model.opt.gravity))

    def untouched(changed: mujoco.MjModel) -> None:
        changed.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)

    def weightless(changed: mujoco.MjModel) -> None:
        changed.opt.gravity[:] = 0

    yield Trial(
        "without contacts",
        "Keep the parts that meet apart, or add <contact><exclude body1=... body2=.../></contact> for them.",
        untouched,
        odd=False,
    )
    if gravity_m_s2:
        yield Trial(
            "without gravity",
            "Hold the robot up: stiffer joints, less mass, or a root that is fixed.",
            weightless,
            odd=gravity_m_s2 > 3 * STANDARD_GRAVITY_M_S2,
        )
