"""Rules for robots that lose their shape without being driven: without gravity, or under their own weight."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from dataclasses import replace

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.validation.consequences import NO_MOTION, SHAKING
from aidsr.validation.curves import limits_of, settling_signal
from aidsr.validation.protocol import Variant, gather_evidence
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.signals import Signal

COLLAPSE_ERROR = 0.9
COLLAPSE_WARNING = 0.35
"""Sag / L above which it is an error or a warning. Soft arms sag by up to a third under their own weight and can still
be driven. Our choice."""
WEIGHTLESS_SHARE = 0.5
"""Largest share of the deformation that remains after its cause (gravity or springs) is removed. Our choice."""
PASSIVE_COLLAPSE_SHARE = 0.6
"""Deformation / L without gravity above which springs are not at rest in the reference pose. Our choice."""
_OFF_REST_RAD = 0.02
"""Angle between a joint's springref and its reference pose, above which the joint is a possible cause. Our choice."""
_WITH_GRAVITY, _WEIGHTLESS = 0, 1
_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)


def _find_gravity_collapse(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find robots that sag too far under their own weight, if they do not deform as much without gravity."""
    if not robot.settled:
        return
    sag, names = _deformation(robot, _WITH_GRAVITY)
    without, _ = _deformation(robot, _WEIGHTLESS)
    if sag <= COLLAPSE_WARNING or without > WEIGHTLESS_SHARE * sag:
        return
    # limbs that motors in their joints hold up sag when the motors are off, so that is no error
    severe = sag > COLLAPSE_ERROR and bool(robot.structure.tendon_actuators)
    yield GRAVITY_COLLAPSE.fault(
        severity="error" if severe else "warning",
        names=names,
        measured=sag,
        limit=COLLAPSE_ERROR if severe else COLLAPSE_WARNING,
        whole=robot.length_m,
        whole_unit="m",
        message="sag under its own weight with slack tendons",
        likely_cause="the backbone is too soft for its weight",
    )


def _find_passive_collapse(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find robots that deform without gravity."""
    without, names = _deformation(robot, _WEIGHTLESS)
    if robot.settled and without > PASSIVE_COLLAPSE_SHARE:
        likely, cure = _why_deformed(robot, without)
        yield PASSIVE_COLLAPSE.fault(
            names=names,
            measured=without,
            limit=PASSIVE_COLLAPSE_SHARE,
            whole=robot.length_m,
            whole_unit="m",
            message="deforms by itself, without gravity and with slack tendons",
            likely_cause=likely,
            cure=cure,
        )


def _why_deformed(robot: RobotUnderTest, deformation: float) -> tuple[str, str | None]:
    """Return the likely cause of a deformation without gravity and its cure; None instead of a cure if unknown.

    Joint springs, tendon springs and equality constraints are removed in turn in counterfactual simulations.
    """
    model = robot.model
    off_rest = {
        robot.joint(joint): math.degrees(away)
        for joint in robot.structure.joints
        if int(model.jnt_type[joint]) == _HINGE
        and (away := abs(float(np.subtract(*(q[model.jnt_qposadr[joint]] for q in (model.qpos_spring, model.qpos0))))))
        > _OFF_REST_RAD
    }

    def joints_at_rest(changed: mujoco.MjModel) -> None:
        changed.qpos_spring[:] = changed.qpos0

    def tendons_at_rest(changed: mujoco.MjModel) -> None:
        changed.tendon_lengthspring[:] = changed.tendon_length0[:, None]

    def unconstrained(changed: mujoco.MjModel) -> None:
        changed.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_EQUALITY)

    farthest = max(off_rest, key=lambda name: off_rest[name], default="")
    springs = f"springref bends joints in the drawn pose, {farthest} by {off_rest.get(farthest, 0):.3g} deg"
    trials: list[tuple[bool, Variant, str, str]] = [
        (bool(off_rest), joints_at_rest, springs, "Leave springref out, or draw the robot bent as its springs rest."),
        (
            bool(model.tendon_stiffness.any()),
            tendons_at_rest,
            "springs of tendons are stretched in the drawn pose",
            "Leave springlength and stiffness of the tendons out, or set springlength to their drawn length.",
        ),
        (
            bool(model.neq),
            unconstrained,
            "equality constraints pull the robot",
            "Leave the equality constraints out, or let them hold in the drawn pose.",
        ),
    ]
    for possible, variant, why, cure in trials:
        if possible and _deformation_if(robot, variant) < WEIGHTLESS_SHARE * deformation:
            return f"{why}: it keeps its shape without", cure
    return "springs are not at rest in the drawn pose (springref, springlength, equality constraints)", None


def _deformation_if(robot: RobotUnderTest, variant: Variant) -> float:
    """Return the deformation / L without gravity in a changed model."""
    changed = copy.copy(robot.model)
    variant(changed)
    evidence = gather_evidence(changed, robot.structure)
    return _deformation(
        replace(robot, model=changed, evidence=evidence, found=[], counterfactual_effects={}), _WEIGHTLESS
    )[0]


def _deformation(robot: RobotUnderTest, simulation: int) -> tuple[float, tuple[str, ...]]:
    """Return the largest displacement / L of a body from the reference pose after settling, and the body's name.

    Args:
        robot: The tested robot.
        simulation: `_WITH_GRAVITY` or `_WEIGHTLESS`.
    """
    evidence, structure = robot.driven, robot.structure
    moved = np.linalg.norm(evidence.settling_m[simulation, -1] - evidence.drawn_m, axis=-1)[: len(structure.bodies)]
    if not moved.size:
        return 0.0, ()
    worst = int(np.argmax(moved))
    return float(moved[worst]) / robot.length_m, (robot.body(structure.bodies[worst]),)


def _deformation_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    return settling_signal(robot, fault, limits_of(fault))


PASSIVE_COLLAPSE = Rule(
    code="passive_collapse",
    stage=Stage.PASSIVE,
    finds="The robot deforms by itself, without gravity and with slack tendons.",
    why="Its springs are not at rest in the drawn pose, so what is simulated is not the robot that was drawn.",
    limit=f"deformation without gravity / the robot's length: at most {PASSIVE_COLLAPSE_SHARE:g}",
    check=_find_passive_collapse,
    unit="of the robot's length",
    cure="Leave springref and springlength out, or draw the robot in the pose where its springs rest.",
    explains=("gravity_collapse", *SHAKING, *NO_MOTION),
    signal=_deformation_signal,
    example=Example((('stiffness="1"', 'stiffness="1" springref="25"'),)),
)

GRAVITY_COLLAPSE = Rule(
    code="gravity_collapse",
    stage=Stage.PASSIVE,
    finds="The robot sags under its own weight with slack tendons.",
    why="Tendons that have to hold a limb up have nothing left to move it with.",
    limit=f"sag / the robot's length, of which at most {100 * WEIGHTLESS_SHARE:g} % remain without gravity: at most "
    f"{COLLAPSE_ERROR:g} where tendons drive the robot; a warning above {COLLAPSE_WARNING:g}",
    check=_find_gravity_collapse,
    unit="of the robot's length",
    cure="Raise the joint stiffness, make the limb lighter or shorter, or taper it towards the tip.",
    explains=(*SHAKING, *NO_MOTION),
    signal=_deformation_signal,
    example=Example((('stiffness="1" damping="0.05"', 'stiffness="0.01" damping="0.005"'),)),
)
