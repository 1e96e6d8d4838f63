"""What the robot does undriven: stand, sag, fall, ring."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.sim.overlap import OVERLAP_NOTICED
from aidsr.validation.consequences import COLLAPSE, NO_MOTION, SHAKING
from aidsr.validation.curves import (
    MAX_CURVES,
    OF_LENGTH,
    SETTLING,
    Array,
    find_body,
    limits_of,
    make_signal,
    settling_signal,
)
from aidsr.validation.protocol import STANDARD_GRAVITY_M_S2
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.signals import Signal

COLLAPSE_ERROR = 0.9
COLLAPSE_WARNING = 0.35
"""Sag / L. Soft arms under their own weight sag by up to a third and can still be driven. Our choice."""
WEIGHTLESS_SHARE = 0.5
"""Share of the sag that may remain without gravity for gravity to be the cause. Our choice."""
PASSIVE_COLLAPSE_SHARE = 0.6
"""Deformation / L without gravity: springs are not at rest in the drawn pose. Our choice."""
DROP_SHARE = 0.3
"""Fall of a root / L: the whole of one that does not land, of another what is below it in the drawn pose, since what
stands may topple. Our choice."""
_LANDED_SPEED = 0.3
"""Speed of the root / sqrt(g L) below which a fall has ended. Our choice."""
ENERGY_GROWTH_SHARE = 0.05
"""Rise of mechanical energy while passive / (m g L). Our choice."""
DAMPING_RATIO = 0.02
"""Of the slowest visible oscillation. Soft bodies with any loss reach 0.05. Our choice."""
RINGING_SHARE = 0.02
"""Amplitude / L of an oscillation that is still visible after settling. Our choice."""
_SWING_SHARE = 0.35
"""Third largest way between reversals / the largest, from where it is a swing. Below a half, since the slowest
pendulum is seen for less than three ways, of which the first and the last are cut off. Our choice."""
_STRAINED_RAD = 0.02
"""Angle beyond a joint's range in the drawn pose, from where its stop is a spring let go. Our choice."""
_WITH_GRAVITY, _WEIGHTLESS = 0, 1
_OF_JOINT = int(mujoco.mjtTrn.mjTRN_JOINT)
_SLIDE = int(mujoco.mjtJoint.mjJNT_SLIDE)
_WINDOW = 3 / 8
"""Share of the settling phase in each window: 4.5 sqrt(L / g), longer than half a swing of the slowest pendulum."""


def _find_gravity_collapse(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find robots that lose their shape under their own weight, where their weight is what bends them."""
    if not robot.settled:
        return
    sag, names = _deformation(robot, _WITH_GRAVITY)
    without, _ = _deformation(robot, _WEIGHTLESS)
    if sag <= COLLAPSE_WARNING or without > WEIGHTLESS_SHARE * sag:
        return
    # limbs that motors in their joints hold are limp when the motors are off, as those of an animal
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
    """Find robots that do not stay as they were drawn without gravity."""
    without, names = _deformation(robot, _WEIGHTLESS)
    if robot.settled and without > PASSIVE_COLLAPSE_SHARE:
        yield PASSIVE_COLLAPSE.fault(
            names=names,
            measured=without,
            limit=PASSIVE_COLLAPSE_SHARE,
            whole=robot.length_m,
            whole_unit="m",
            message="deforms by itself, without gravity and with slack tendons",
            likely_cause="springs are not at rest in the drawn pose (springref, springlength, equality constraints)",
        )


def _deformation(robot: RobotUnderTest, simulation: int) -> tuple[float, tuple[str, ...]]:
    """Largest displacement from the drawn pose after settling / L, and the body where it is."""
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


def _find_drops(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find roots that do not stay where they were put: that fall for ever, or land from above.

    Environment joints that carry the robot are forgiven: only roots with joints of their own can drop.
    """
    model, evidence = robot.model, robot.driven
    down = np.array(model.opt.gravity)
    if not down.any() or not robot.settled:
        return
    down /= np.linalg.norm(down)
    held = set(_held_roots(robot))
    drops: dict[bool, list[_Drop]] = {}
    for root in robot.structure.roots:
        if root not in robot.structure.moving or root in held:
            continue
        path = (evidence.settle.fields["xpos"][_WITH_GRAVITY, :, root] - evidence.start.xpos[root]) @ down
        if path[-1] > DROP_SHARE * robot.length_m:
            speed = float(evidence.settle.speed_m_s[_WITH_GRAVITY, -1, root])
            landed = speed < _LANDED_SPEED * math.sqrt(STANDARD_GRAVITY_M_S2 * robot.length_m)
            if landed and _clearance_m(robot, root) < DROP_SHARE * robot.length_m:
                continue  # it stood on the ground or just above it and toppled, as a limp animal does
            first = int(np.argmax(path > DROP_SHARE * robot.length_m))
            found = _Drop(robot.body(root), float(path[-1]) / robot.length_m, (first + 1) * evidence.settle.frame_s)
            drops.setdefault(landed, []).append(found)
    for landed, dropped in drops.items():
        yield _drop_fault(robot, dropped, landed)


def _held_roots(robot: RobotUnderTest) -> Iterator[int]:
    """Roots that something else than the ground holds: motors of their own joints, or a string to another root."""
    model = robot.model
    for actuator in robot.structure.actuators:
        if int(model.actuator_trntype[actuator]) == _OF_JOINT:
            yield int(model.jnt_bodyid[int(model.actuator_trnid[actuator, 0])])
    for tendon in robot.structure.tendons:
        if not tendon.actuators and tendon.spans > 1:
            yield from tendon.bodies


def _clearance_m(robot: RobotUnderTest, root: int) -> float:
    """Smallest distance in the drawn pose between what hangs from a root and what is around the robot [m].

    Up to `DROP_SHARE` L; that where nothing is near.
    """
    model, reach_m = robot.model, DROP_SHARE * robot.length_m
    ours = [geom for geom in robot.structure.geoms if int(model.body_rootid[model.geom_bodyid[geom]]) == root]
    around = sorted(set(range(model.ngeom)) - set(robot.structure.geoms))
    distances = (
        float(mujoco.mj_geomDistance(model, robot.driven.start, one, other, reach_m, None))
        for one in ours
        for other in around
    )
    return min(distances, default=reach_m)


@dataclass(frozen=True)
class _Drop:
    """A root that fell: by how much / L, and when that was too much."""

    name: str
    share: float
    first_time_s: float


def _drop_fault(robot: RobotUnderTest, dropped: list[_Drop], landed: bool) -> Fault:
    rule = BASE_NOT_ATTACHED if landed else FREE_FALL
    return rule.fault(
        names=tuple(each.name for each in dropped),
        measured=max(each.share for each in dropped),
        limit=DROP_SHARE,
        whole=robot.length_m,
        whole_unit="m",
        message="the root drops and lands" if landed else "the root falls and does not land",
        likely_cause="the root has a free or slide joint and starts above the ground"
        if landed
        else "the root has a free or slide joint and nothing below it that it can touch",
        first_time_s=min(each.first_time_s for each in dropped),
    )


def _drop_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    down = np.array(robot.model.opt.gravity)
    down /= np.linalg.norm(down)
    evidence = robot.driven
    curves: dict[str, Array] = {}
    for name in fault.names[:MAX_CURVES]:
        root = find_body(robot, name)
        way = (evidence.settle.fields["xpos"][0, :, root] - evidence.start.xpos[root]) @ down
        curves[name] = way / robot.length_m
    frame_s = evidence.settle.frame_s
    return make_signal("fall", OF_LENGTH, SETTLING, frame_s, curves, (DROP_SHARE,), fault.first_time_s)


_CURE_FALL = "Remove the root's joint to fix it, or start it on the ground with contacts enabled."

FREE_FALL = Rule(
    code="free_fall",
    stage=Stage.PASSIVE,
    finds="The root of the robot falls and does not land.",
    why="It has a free or slide joint, and nothing below it that it can touch.",
    limit=f"fall of a root with joints of its own / the robot's length: at most {DROP_SHARE:g}",
    check=_find_drops,
    unit="of the robot's length",
    cure=_CURE_FALL,
    explains=(*COLLAPSE, *SHAKING, *NO_MOTION),
    blame="integrator",
    signal=_drop_signal,
    example=Example(
        (
            (
                '<body name="base">',
                '<body name="base">\n      <joint name="lift" type="slide" axis="0 0 1" stiffness="0" damping="0" '
                'limited="false"/>',
            ),
        )
    ),
)

BASE_NOT_ATTACHED = Rule(
    code="base_not_attached",
    stage=Stage.PASSIVE,
    finds="The root of the robot drops before it lands.",
    why="It has a free or slide joint and starts above the ground, so it does not stand where it was put.",
    limit=f"fall of a root with joints of its own / the robot's length: at most {DROP_SHARE:g}; one that starts nearer "
    "than that to the ground may topple",
    check=_find_drops,
    unit="of the robot's length",
    cure=_CURE_FALL,
    explains=(*COLLAPSE, *SHAKING, *NO_MOTION),
    blame="integrator",
    signal=_drop_signal,
    example=Example(
        (
            ('<body name="base">', '<body name="base">\n      <freejoint/>'),
            ("<worldbody>", '<worldbody>\n    <geom name="floor" type="plane" size="1 1 0.1" pos="0 0 -0.2"/>'),
        )
    ),
)


def _find_energy_growth(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find robots that gain mechanical energy by negative damping, or while passive.

    Measured only where every actuator is a slack tendon actuator: any other may do work while it holds.

    Source: energy of a passive mechanism with losses can only fall.
    """
    yield from _find_negative_damping(robot)
    model, evidence, limit = robot.model, robot.driven, ENERGY_GROWTH_SHARE
    scale = robot.structure.mass_kg * STANDARD_GRAVITY_M_S2 * robot.length_m
    if len(robot.structure.tendon_actuators) < model.nactuator or not robot.settled or scale <= 0:
        return
    if _is_strained(robot):
        return
    energy = evidence.settle.fields["energy"][_WITH_GRAVITY].sum(axis=-1)
    gain = (energy - energy[0]) / scale
    if gain.max() > limit:
        yield ENERGY_GROWTH.fault(
            measured=float(gain.max()),
            limit=limit,
            whole=scale,
            whole_unit="J",
            message="mechanical energy rises while nothing drives the robot",
            likely_cause="the time step is too large for the stiffness",
            first_time_s=float(np.argmax(gain > limit) + 1) * evidence.settle.frame_s,
        )


def _is_strained(robot: RobotUnderTest) -> bool:
    """Whether limits or contacts hold energy in the drawn pose, which MuJoCo leaves out until it is set free."""
    data, model = robot.drawn, robot.model
    strained = data.efc_pos < -OVERLAP_NOTICED * robot.length_m
    limits = data.efc_type == int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
    contacts = data.efc_type >= int(mujoco.mjtConstraint.mjCNSTR_CONTACT_FRICTIONLESS)
    bent = limits & (data.efc_pos < -_STRAINED_RAD)
    return bool(model.nv and (bent.any() or (contacts & strained).any()))


def _find_negative_damping(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find joints and tendons that feed energy in: MuJoCo accepts negative damping without a word."""
    model, structure = robot.model, robot.structure
    dofs = {int(model.dof_jntid[dof]): float(model.dof_damping[dof]) for dof in range(model.nv)}
    found = {robot.joint(joint): (dofs[joint], _damping_unit(robot, joint)) for joint in structure.joints}
    found |= {robot.tendon(each.id): (float(model.tendon_damping[each.id]), "N s/m") for each in structure.tendons}
    negative = {name: damping for name, damping in found.items() if damping[0] < 0}
    if negative:
        lowest, unit = min(negative.values())
        yield ENERGY_GROWTH.fault(
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


def _energy_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    settle, scale = robot.driven.settle, robot.structure.mass_kg * STANDARD_GRAVITY_M_S2 * robot.length_m
    good = int(settle.good_frames[_WITH_GRAVITY])
    energy = settle.fields["energy"][_WITH_GRAVITY, :good].sum(axis=-1)
    if scale <= 0 or not good:
        return None
    curve, limits = {"potential and kinetic": (energy - energy[0]) / scale}, (ENERGY_GROWTH_SHARE,)
    quantity = "rise of mechanical energy"
    return make_signal(quantity, "m g L", SETTLING, settle.frame_s, curve, limits, fault.first_time_s)


ENERGY_GROWTH = Rule(
    code="energy_growth",
    stage=Stage.PASSIVE,
    finds="The robot gains mechanical energy while nothing drives it, or a damping is negative.",
    why="The energy of a passive mechanism with losses can only fall: a rise is made by the integrator or by a sign.",
    limit="rise of mechanical energy / (m g L), where all actuators are slack tendon actuators: at most "
    f"{ENERGY_GROWTH_SHARE:g}; damping: at least 0",
    check=_find_energy_growth,
    unit="m g L",
    cure="Raise joint damping, or reduce the time step.",
    explains=SHAKING[1:],
    signal=_energy_signal,
    example=Example((('damping="0.05"', 'damping="-0.0005"'),)),
)


def _find_underdamped(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find robots that do not come to rest.

    Damping ratio from the decay between two windows at the end of settling and the reversals in the last. What swings
    does so several times alike; a ring that rolls on to its next link late moves once, and that is no swing.

    Source: logarithmic decrement; amplitude falls by exp(-pi zeta) from one reversal to the next for small zeta.
    """
    evidence = robot.driven
    if not robot.settled:
        return
    points = evidence.settling_m[_WITH_GRAVITY]
    window = int(_WINDOW * points.shape[0])
    later = points[-window:]
    amplitude_m = np.linalg.norm(np.ptp(later, axis=0), axis=-1) / 2
    point = int(np.argmax(amplitude_m))
    if amplitude_m[point] <= RINGING_SHARE * robot.length_m:
        return
    axis = int(np.argmax(np.ptp(later[:, point], axis=0)))
    before, after = points[-2 * window : -window, point, axis], later[:, point, axis]
    reversals = int(np.count_nonzero(np.diff(np.sign(np.diff(after)))))
    if not reversals or not _is_even(points[-2 * window :, point, axis], _SWING_SHARE):
        return  # it creeps, still falls, or topples
    decay = math.log(max(float(np.ptp(before)), 1e-12) / float(np.ptp(after)))
    ratio = decay / (math.pi * reversals)
    if ratio < DAMPING_RATIO:
        yield UNDERDAMPED.fault(
            severity="error" if robot.structure.tendon_actuators else "warning",
            names=_owner_of_point(robot, point),
            measured=max(ratio, 0.0),
            limit=DAMPING_RATIO,
            message=f"still swings by {1000 * float(amplitude_m[point]):.2g} mm "
            f"({100 * float(amplitude_m[point]) / robot.length_m:.2g} % of the robot's length) after settling",
            likely_cause="joints have little or no damping",
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


def _swing_signal(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    return settling_signal(robot, fault, ())


UNDERDAMPED = Rule(
    code="underdamped",
    stage=Stage.PASSIVE,
    finds="The robot still swings after settling, with hardly any loss.",
    why="Every command starts a swing that outlasts it; soft materials damp far more.",
    limit=f"damping ratio of a swing of more than {RINGING_SHARE:g} of the robot's length at the end of settling: at "
    f"least {DAMPING_RATIO:g}. What moves once, as a ring that rolls on, does not swing. A warning where no "
    "tendon drives the robot: pendulums are meant to swing",
    check=_find_underdamped,
    unit="damping ratio",
    cure="Give each joint damping of about 0.02 to 0.1 s times its stiffness.",
    explains=("chatter",),
    signal=_swing_signal,
    example=Example(
        (
            ('damping="0.05"', 'damping="0.0001"'),
            ('timestep="0.002"', 'timestep="0.0005"'),
            ('<body name="base">', '<body name="base" euler="0 90 0">'),
        )
    ),
)
