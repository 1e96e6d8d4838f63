"""What the robot does when nobody drives it: stand, sag, fall, ring."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.validation.protocol import STANDARD_GRAVITY_M_S2
from aidsr.validation.robot_under_test import RobotUnderTest

_WITH_GRAVITY, _WEIGHTLESS = 0, 1
_SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)
_WINDOW = 3 / 8
"""Share of the settling phase in each window: 4.5 sqrt(L / g), longer than half a swing of the slowest pendulum."""
_CURE_SAG = "Raise the joint stiffness, make the limb lighter or shorter, or taper it towards the tip."


def gravity_collapse(robot: RobotUnderTest) -> Iterator[Fault]:
    """The robot keeps about its shape under its own weight, and its weight is what bends it."""
    limits = robot.limits
    if not robot.settled:
        return
    sag, names = _deformation(robot, _WITH_GRAVITY)
    without, _ = _deformation(robot, _WEIGHTLESS)
    if sag <= limits.collapse_warning or without > limits.weightless_share * sag:
        return
    severe = sag > limits.collapse_error
    yield Fault(
        code="gravity_collapse",
        layer="simulate",
        severity="error" if severe else "warning",
        names=names,
        measured=sag,
        limit=limits.collapse_error if severe else limits.collapse_warning,
        unit="of the robot's length",
        whole=robot.length_m,
        whole_unit="m",
        message="sag under its own weight with slack tendons",
        likely_cause="the backbone is too soft for its weight",
        cure=_CURE_SAG,
    )


def passive_collapse(robot: RobotUnderTest) -> Iterator[Fault]:
    """Without gravity the robot stays as it was drawn."""
    without, names = _deformation(robot, _WEIGHTLESS)
    if robot.settled and without > robot.limits.passive_collapse:
        yield Fault(
            code="passive_collapse",
            layer="simulate",
            severity="error",
            names=names,
            measured=without,
            limit=robot.limits.passive_collapse,
            unit="of the robot's length",
            whole=robot.length_m,
            whole_unit="m",
            message="deforms by itself, without gravity and with slack tendons",
            likely_cause="springs are not at rest in the drawn pose (springref, springlength, equality constraints)",
            cure="Leave springref and springlength out, or draw the robot in the pose where its springs rest.",
        )


def _deformation(robot: RobotUnderTest, simulation: int) -> tuple[float, tuple[str, ...]]:
    """Largest displacement from the drawn pose after settling / L, and the body where it is."""
    evidence, structure = robot.driven, robot.structure
    moved = np.linalg.norm(evidence.settling_m[simulation, -1] - evidence.drawn_m, axis=-1)[: len(structure.bodies)]
    if not moved.size:
        return 0.0, ()
    worst = int(np.argmax(moved))
    return float(moved[worst]) / robot.length_m, (robot.body(structure.bodies[worst]),)


def drop(robot: RobotUnderTest) -> Iterator[Fault]:
    """The root of the robot stays where it was put: it neither falls for ever nor lands from above.

    Environment joints that carry the robot are forgiven: only roots with joints of their own can drop.
    """
    model, evidence = robot.model, robot.driven
    down = np.array(model.opt.gravity)
    if not down.any() or not robot.settled:
        return
    down /= np.linalg.norm(down)
    drops: dict[bool, list[_Drop]] = {}
    for root in robot.structure.roots:
        if root not in robot.structure.moving:
            continue
        path = (evidence.settle.fields["xpos"][_WITH_GRAVITY, :, root] - evidence.start.xpos[root]) @ down
        if path[-1] > robot.limits.drop * robot.length_m:
            speed = float(evidence.settle.speed_m_s[_WITH_GRAVITY, -1, root])
            landed = speed < robot.limits.landed * math.sqrt(STANDARD_GRAVITY_M_S2 * robot.length_m)
            first = int(np.argmax(path > robot.limits.drop * robot.length_m))
            found = _Drop(robot.body(root), float(path[-1]) / robot.length_m, (first + 1) * evidence.settle.frame_s)
            drops.setdefault(landed, []).append(found)
    for landed, dropped in drops.items():
        yield _drop_fault(robot, dropped, landed)


@dataclass(frozen=True)
class _Drop:
    """A root that fell: by how much / L, and when that was too much."""

    name: str
    share: float
    first_time_s: float


def _drop_fault(robot: RobotUnderTest, dropped: list[_Drop], landed: bool) -> Fault:
    return Fault(
        code="base_not_attached" if landed else "free_fall",
        layer="simulate",
        severity="error",
        names=tuple(each.name for each in dropped),
        measured=max(each.share for each in dropped),
        limit=robot.limits.drop,
        unit="of the robot's length",
        whole=robot.length_m,
        whole_unit="m",
        message="the root drops and lands" if landed else "the root falls and does not land",
        likely_cause="the root has a free or slide joint and starts above the ground"
        if landed
        else "the root has a free or slide joint and nothing below it that it can touch",
        cure="Remove the root's joint to fix it, or start it on the ground with contacts enabled.",
        first_time_s=min(each.first_time_s for each in dropped),
    )


def energy_growth(robot: RobotUnderTest) -> Iterator[Fault]:
    """Passive, the robot gains no mechanical energy.

    Measured only where every actuator is a slack tendon actuator: any other may do work while it holds.

    Source: energy of a passive mechanism with losses can only fall.
    """
    model, evidence, limit = robot.model, robot.driven, robot.limits.energy_growth
    scale = robot.structure.mass_kg * STANDARD_GRAVITY_M_S2 * robot.length_m
    if len(robot.structure.tendon_actuators) < model.nactuator or not robot.settled or scale <= 0:
        return
    energy = evidence.settle.fields["energy"][_WITH_GRAVITY].sum(axis=-1)
    gain = (energy - energy[0]) / scale
    if gain.max() > limit:
        yield Fault(
            code="energy_growth",
            layer="simulate",
            severity="error",
            measured=float(gain.max()),
            limit=limit,
            unit="m g L",
            whole=scale,
            whole_unit="J",
            message="mechanical energy rises while nothing drives the robot",
            likely_cause="the time step is too large for the stiffness",
            cure="Raise joint damping, or reduce the time step.",
            first_time_s=float(np.argmax(gain > limit) + 1) * evidence.settle.frame_s,
        )


def negative_damping(robot: RobotUnderTest) -> Iterator[Fault]:
    """No joint or tendon feeds energy in: MuJoCo accepts negative damping without a word."""
    model, structure = robot.model, robot.structure
    dofs = {int(model.dof_jntid[dof]): float(model.dof_damping[dof]) for dof in range(model.nv)}
    found = {robot.joint(joint): (dofs[joint], _damping_unit(robot, joint)) for joint in structure.joints}
    found |= {robot.tendon(each.id): (float(model.tendon_damping[each.id]), "N s/m") for each in structure.tendons}
    negative = {name: damping for name, damping in found.items() if damping[0] < 0}
    if negative:
        lowest, unit = min(negative.values())
        yield Fault(
            code="energy_growth",
            layer="simulate",
            severity="error",
            names=tuple(negative),
            measured=lowest,
            limit=0,
            unit=unit,
            message="negative damping feeds energy in",
            cure="Make damping positive.",
            first_time_s=0.0,
        )


def _damping_unit(robot: RobotUnderTest, joint: int) -> str:
    return "N s/m" if int(robot.model.jnt_type[joint]) == _SLIDE else "N m s/rad"


def underdamped(robot: RobotUnderTest) -> Iterator[Fault]:
    """The robot comes to rest.

    Damping ratio from the decay between two windows at the end of settling and the reversals in the last. What swings
    does so several times alike; a ring that rolls on to its next link late moves once, and that is no swing.

    Source: logarithmic decrement; amplitude falls by exp(-pi zeta) from one reversal to the next for small zeta.
    """
    evidence, limits = robot.driven, robot.limits
    if not robot.settled:
        return
    points = evidence.settling_m[_WITH_GRAVITY]
    window = int(_WINDOW * points.shape[0])
    later = points[-window:]
    amplitude_m = np.linalg.norm(np.ptp(later, axis=0), axis=-1) / 2
    point = int(np.argmax(amplitude_m))
    if amplitude_m[point] <= limits.ringing * robot.length_m:
        return
    axis = int(np.argmax(np.ptp(later[:, point], axis=0)))
    before, after = points[-2 * window : -window, point, axis], later[:, point, axis]
    reversals = int(np.count_nonzero(np.diff(np.sign(np.diff(after)))))
    if not reversals or not _is_even(points[-2 * window :, point, axis], limits.swing_share):
        return  # it creeps, still falls, or topples
    decay = math.log(max(float(np.ptp(before)), 1e-12) / float(np.ptp(after)))
    ratio = decay / (math.pi * reversals)
    if ratio < limits.damping_ratio:
        yield Fault(
            code="underdamped",
            layer="simulate",
            severity="error",
            names=_owner_of_point(robot, point),
            measured=max(ratio, 0.0),
            limit=limits.damping_ratio,
            unit="damping ratio",
            message=f"still swings by {1000 * float(amplitude_m[point]):.2g} mm "
            f"({100 * float(amplitude_m[point]) / robot.length_m:.2g} % of the robot's length) after settling",
            likely_cause="joints have little or no damping",
            cure="Give each joint damping of about 0.02 to 0.1 s times its stiffness.",
        )


def _is_even(path_m: NDArray[np.float64], share: float) -> bool:
    """Whether the third largest way from one reversal to the next is at least a share of the largest."""
    turns = 1 + np.flatnonzero(np.diff(np.sign(np.diff(path_m))))
    ways_m = np.sort(np.abs(np.diff(path_m[[0, *turns, -1]])))
    return bool(len(ways_m) >= 3 and ways_m[-3] >= share * ways_m[-1])


def _owner_of_point(robot: RobotUnderTest, point: int) -> tuple[str, ...]:
    bodies = robot.structure.bodies
    body = (
        bodies[point]
        if point < len(bodies)
        else int(robot.model.site_bodyid[robot.structure.marks[point - len(bodies)]])
    )
    return (robot.body(body),)
