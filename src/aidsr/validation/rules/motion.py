"""Does the simulation stay a simulation while the robot is driven: divergence, chatter, overrun limits."""

from __future__ import annotations

import math
from collections.abc import Iterator

import mujoco
import numpy as np

from aidsr.artifacts import Fault
from aidsr.sim.rollout import Recording
from aidsr.validation.case import Case
from aidsr.validation.protocol import STANDARD_GRAVITY_M_S2
from aidsr.validation.stiffness import explain_divergence

__all__ = ["chatter", "describe_test", "divergence", "limit_overrun", "numerical_instability"]

_HINGE, _SLIDE = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
_PARTS = 4
_FREE = int(mujoco.mjtJoint.mjJNT_FREE)


def numerical_instability(case: Case) -> Iterator[Fault]:
    """No test ends in numbers that are not finite, warned about, or faster than anything real."""
    phases = [("settling", case.driven.settle, 0)]
    battery = case.driven.battery
    if battery is not None:
        phases += [(describe_test(case, row), battery, row) for row in range(len(case.driven.tests))]
    for phase, recording, row in phases:
        found = divergence(case, recording, row)
        if found is None:
            continue
        measured, limit, unit, names, time_s = found
        what = recording.failures[row] or "faster than anything real"
        yield Fault(
            code="numerical_instability",
            layer="simulate",
            severity="error",
            names=names,
            measured=measured,
            limit=limit,
            unit=unit,
            message=f"the simulation fails during {phase}: {what}",
            likely_cause=explain_divergence(case.model, case.structure),
            cure='Use <option integrator="implicitfast" timestep="0.002"/>, joint damping of at least 0.02 s times its '
            "stiffness, heavier segments or softer joints and servos.",
            first_time_s=time_s,
        )
        return


def describe_test(case: Case, row: int) -> str:
    """Return a test of the battery in words."""
    test = case.driven.tests[row]
    if test.drive >= 0:
        actuator = case.actuator(case.driven.drives[test.drive].actuator)
        return f"the test of {actuator} at ctrl {test.command:.4g}"
    return {
        "reference": "the test with slack tendons",
        "rest": "the test at rest with all actuators on",
        "all": "the test of all actuators together",
    }.get(test.kind, "the random sweep of all actuators")


def divergence(
    case: Case, recording: Recording, row: int
) -> tuple[float | None, float | None, str, tuple[str, ...], float] | None:
    """Return (measured, limit, unit, names, time) of the first sign of divergence in a simulation, None without one."""
    limits, frame_s = case.limits, recording.frame_s
    dofs = [dof for dof in range(case.model.nv) if int(case.model.dof_jntid[dof]) in case.structure.joints]
    bodies = list(case.structure.bodies)
    turning = np.array([_is_turning(case, dof) for dof in dofs], dtype=bool)
    allowed = np.where(turning, limits.joint_speed_rad_s, limits.body_speed_m_s)
    too_fast = recording.fastest[row][:, dofs] / allowed if dofs else np.zeros((1, 1))
    too_far = recording.speed_m_s[row][:, bodies] / limits.body_speed_m_s
    by_joint, by_body = (np.argmax((ratio > 1).any(axis=1)) for ratio in (too_fast, too_far))
    if (too_fast > 1).any() and (not (too_far > 1).any() or by_joint <= by_body):
        dof = int(np.argmax(too_fast[by_joint]))
        measured, unit = float(recording.fastest[row, by_joint, dofs[dof]]), "rad/s" if turning[dof] else "m/s"
        joint = case.joint(int(case.model.dof_jntid[dofs[dof]]))
        return measured, float(allowed[dof]), unit, (joint,), float(by_joint + 1) * frame_s
    if (too_far > 1).any():
        body = int(np.argmax(too_far[by_body]))
        measured = float(recording.speed_m_s[row, by_body, bodies[body]])
        return measured, limits.body_speed_m_s, "m/s", (case.body(bodies[body]),), float(by_body + 1) * frame_s
    if recording.failed(row):
        return None, None, "", (), float(recording.good_frames[row] + 1) * frame_s
    return None


def _is_turning(case: Case, dof: int) -> bool:
    joint = int(case.model.dof_jntid[dof])
    kind = int(case.model.jnt_type[joint])
    if kind == _FREE:
        return dof - int(case.model.jnt_dofadr[joint]) >= 3
    return kind != _SLIDE


def chatter(case: Case) -> Iterator[Fault]:
    """Under constant commands, after settling, the robot stands still.

    Root mean square acceleration of each centre of mass in the last quarter of each test with constant commands, in the
    calmest of four parts: a robot that topples late and hits the ground once does not chatter.
    """
    evidence, limits = case.driven, case.limits
    rows = [("settling", evidence.settle, 0)]
    if evidence.battery is not None:
        constant = [row for row, test in enumerate(evidence.tests) if test.kind != "sweep"]
        rows += [(describe_test(case, row), evidence.battery, row) for row in constant]
    worst, where, what = 0.0, -1, ""
    for phase, recording, row in rows:
        squares = case.tail(recording.acceleration_m_s2[row] ** 2, axis=0)[:, list(case.structure.bodies)]
        parts = np.array_split(squares, min(_PARTS, len(squares)))
        rms = np.sqrt(np.min([part.mean(axis=0) for part in parts], axis=0)) / STANDARD_GRAVITY_M_S2
        if rms.size and rms.max() > worst:
            worst, where, what = float(rms.max()), int(np.argmax(rms)), phase
    if worst > limits.chatter_warning_g:
        severe = worst > limits.chatter_error_g
        yield Fault(
            code="chatter",
            layer="simulate",
            severity="error" if severe else "warning",
            names=(case.body(case.structure.bodies[where]),),
            measured=worst,
            limit=limits.chatter_error_g if severe else limits.chatter_warning_g,
            unit="g",
            message=f"keeps accelerating under constant commands, at the end of {what}",
            likely_cause=_why_chatter(case),
            cure="Raise joint damping, soften servos (kp) or give them kv, and separate parts that rub.",
        )


def _why_chatter(case: Case) -> str:
    """A tendon whose ends meet has no direction left to pull in; otherwise something is too stiff."""
    evidence, shortest = case.driven, case.limits.slack_length * case.length_m
    pulled = [tendon.id for tendon in case.structure.tendons if tendon.spatial and tendon.actuators]
    if evidence.battery is not None and pulled:
        lengths = evidence.battery.fields["ten_length"][:, -1, pulled].min(axis=0)
        met = [case.tendon(tendon) for tendon, length in zip(pulled, lengths, strict=True) if length < shortest]
        if met:
            return f"{met[0]} is pulled to no length, where its direction flips"
    return "contacts, limits or servos are stiffer than the time step can follow"


def limit_overrun(case: Case) -> Iterator[Fault]:
    """Driven joints stay about within their ranges.

    Source: MuJoCo documentation, Modeling, "Solver parameters": limits are soft, and softer for light links.
    """
    model, evidence, limits = case.model, case.driven, case.limits
    if evidence.battery is None:
        return
    worst_deg, at = 0.0, -1
    for joint in case.structure.joints:
        if int(model.jnt_type[joint]) != _HINGE or not model.jnt_limited[joint]:
            continue
        angles = evidence.battery.fields["qpos"][:, :, int(model.jnt_qposadr[joint])]
        low, high = model.jnt_range[joint]
        beyond_deg = math.degrees(max(float(low - angles.min()), float(angles.max() - high)))
        if beyond_deg > worst_deg:
            worst_deg, at = beyond_deg, joint
    if worst_deg > limits.overrun_warning_deg:
        severe = worst_deg > limits.overrun_error_deg
        yield Fault(
            code="limit_overrun",
            layer="simulate",
            severity="error" if severe else "warning",
            names=(case.joint(at),),
            measured=worst_deg,
            limit=limits.overrun_error_deg if severe else limits.overrun_warning_deg,
            unit="deg beyond its range",
            message="pulled past its limit under load",
            likely_cause="limits are soft for light links with the default solreflimit",
            cure='Set solreflimit="0.004 1" on the joints, or reduce the tendon force.',
        )
