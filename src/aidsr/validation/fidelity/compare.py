"""Comparison of a simulated limb with the exact elastic rod that it represents."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.elastica import Rod, Tip, curved_tip, first_frequency, loaded_tip
from aidsr.sim.tendon_effects import length_gradient
from aidsr.validation.fidelity.cables import Cable
from aidsr.validation.fidelity.limb import Limb, unloaded_pose
from aidsr.validation.fidelity.report import Comparison, cable_quantity
from aidsr.validation.fidelity.statics import Statics

Vector = NDArray[np.float64]

_STANDARD_GRAVITY_M_S2 = 9.80665
_LINEAR_SHARE = 1.0 / 3.0
"""Deflection / L that linear beam theory gives for the test load, equivalent to P L^2 / (E I) = 1. Our choice: a bend
of half a radian, large enough to need the elastica and usual for such robots."""
_MOST_SAG = 0.5
"""Deflection / L by linear beam theory up to which the full weight of the limb is applied."""
_LARGEST_BEND_RAD = 3.0
"""Largest bend by one cable at which it is compared. Source: docs/physics.md, the largest bend of its tables."""
_PLANAR = 0.98
"""|sum of the segments' bends| / sum of the segments' |bend|, above which a cable bends its limb in a plane."""


@dataclass(frozen=True)
class Arc:
    """The plane curve to which a cable bends a rod.

    Attributes:
        pull_n: Tension of the cable.
        transverse: Unit vector across the limb towards which it bends, world, (3,).
        tip: Tip of the bent rod.
    """

    pull_n: float
    transverse: Vector
    tip: Tip


def compare(model: mujoco.MjModel, limb: Limb, rod: Rod, cables: tuple[Cable, ...]) -> Iterator[Comparison]:
    """Yield the comparisons of a limb with its rod: tip load, own weight, first natural frequency, and each cable."""
    load_n = comparison_load_n(rod)
    exact, simulated = loaded_tip(rod, load_n=load_n), bend_by_load(model, limb, load_n)
    yield _bend("tip load", f"{load_n:.3g} N across the tip", limb, exact, simulated)
    yield _compare_weight(model, limb, rod)
    exact_hz, simulated_hz = first_frequency(rod) / (2 * math.pi), frequency_of(model, limb) / (2 * math.pi)
    yield Comparison(
        quantity="first frequency",
        how="of the clamped limb",
        unit="Hz",
        exact=exact_hz,
        simulated=simulated_hz,
        error_percent=100 * (simulated_hz / exact_hz - 1),
    )
    for cable in cables:
        yield _compare_cable(model, limb, cable)


def comparison_load_n(rod: Rod) -> float:
    """Return the transverse tip load for the comparison of a rod [N]."""
    return _LINEAR_SHARE * rod.length_m / _compliance(rod)


def bend_by_load(model: mujoco.MjModel, limb: Limb, load_n: float, *, gravity_m_s2: float = 0.0) -> Tip | None:
    """Return the tip of a limb at rest under a transverse tip load and transverse gravity; None if no rest is found."""
    statics = Statics(model, gravity_m_s2 * limb.transverse)

    def push(pushed: mujoco.MjModel, data: mujoco.MjData, forces: Vector) -> None:
        end = _end_m(unloaded, data, limb)
        mujoco.mj_applyFT(pushed, data, load_n * limb.transverse, np.zeros(3), end, limb.bodies[-1], forces)

    unloaded = unloaded_pose(model)
    turns = statics.rest(limb.turn_directions, push)
    if turns is None:
        return None
    return _tip(
        limb, _end_m(unloaded, statics.at(limb.turn_directions, turns), limb), limb.transverse, float(turns.sum())
    )


def bend_by_cable(model: mujoco.MjModel, limb: Limb, cable: Cable, arc: Arc) -> Tip | None:
    """Return the tip of a limb at rest under a cable's tension, without gravity; None if no rest is found."""
    statics, unloaded = Statics(model), unloaded_pose(model)
    directions = np.eye(model.nv)[list(limb.bending_dofs)]

    def pull(pulled: mujoco.MjModel, data: mujoco.MjData, forces: Vector) -> None:
        forces -= arc.pull_n * length_gradient(pulled, data, cable.tendon)

    turns = statics.rest(directions, pull)
    if turns is None:
        return None
    bends = _bends(model, unloaded, limb, turns @ directions)
    end = _end_m(unloaded, statics.at(directions, turns), limb)
    return _tip(limb, end, arc.transverse, float(np.linalg.norm(bends.sum(axis=0))))


def frequency_of(model: mujoco.MjModel, limb: Limb) -> float:
    """Return the first natural frequency of a simulated limb with the rest of the robot fixed [rad/s].

    Source: eigenvalues of M^-1 K in the pose in which all joint springs are at rest.
    """
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, unloaded_pose(model), mass)
    inverse = np.linalg.inv(np.linalg.cholesky(limb.turn_directions @ mass @ limb.turn_directions.T))
    squared = np.linalg.eigvalsh(inverse @ np.diag(limb.stiffness_n_m_rad) @ inverse.T)
    return float(math.sqrt(squared[0]))


def arc_of(model: mujoco.MjModel, limb: Limb, cable: Cable, pull_n: float = 0.0) -> Arc | None:
    """Return the arc to which one cable bends the rod, or None if that is not a plane curve.

    Args:
        model: The robot.
        limb: The limb.
        cable: The cable.
        pull_n: Tension of the cable [N]. 0: the cable's greatest tension (one that bends the limb by 1 rad if that is
            unknown), at most one that bends the limb by 3 rad.

    Source: curvature F r / (E I) along the cable, with its moment arm r at rest: constant curvature for a cable beside
        a uniform rod.
    """
    data = unloaded_pose(model)
    bends = _bends(model, data, limb, _gains(model, limb, length_gradient(model, data, cable.tendon)))
    if limb.clamp_doubled:
        bends[0] *= 2.0
    total = bends.sum(axis=0)
    size = float(np.linalg.norm(total))
    if size == 0.0 or size < _PLANAR * float(np.linalg.norm(bends, axis=1).sum()):
        return None
    pull_n = pull_n or min(cable.pull_n or 1.0 / size, _LARGEST_BEND_RAD / size)
    axis = total / size
    tip = curved_tip(limb.segment_m, pull_n * (bends @ axis) / limb.segment_m)
    return Arc(pull_n, np.cross(axis, limb.along), tip)


def _compare_cable(model: mujoco.MjModel, limb: Limb, cable: Cable) -> Comparison:
    """Compare the limb under one cable's full tension with the arc of the rod."""
    name, arc = cable_quantity(cable.name), arc_of(model, limb, cable)
    if arc is None:
        why = "it does not bend the limb in one plane, so there is no arc to hold it against"
        return Comparison(quantity=name, unit="rad", note=why)
    simulated = bend_by_cable(model, limb, cable, arc)
    how = f"{arc.pull_n:.3g} N against an arc"
    if simulated is None:
        return Comparison(quantity=name, how=how, unit="rad", note="no pose at rest was found")
    return Comparison(
        quantity=name,
        how=how,
        unit="rad",
        exact=arc.tip.angle_rad,
        simulated=simulated.angle_rad,
        error_percent=100 * (simulated.angle_rad / arc.tip.angle_rad - 1),
        tip_error_percent=tip_distance_percent(limb, simulated, arc.tip),
    )


def _compare_weight(model: mujoco.MjModel, limb: Limb, rod: Rod) -> Comparison:
    """Compare the sag of the limb held horizontally under its own weight.

    For a very soft limb, gravity is reduced so that linear beam theory gives a sag of `_MOST_SAG` L.
    """
    small = 1e-3 * _STANDARD_GRAVITY_M_S2
    linear_sag = 1e3 * loaded_tip(rod, gravity_m_s2=small).transverse_m
    share = min(1.0, _MOST_SAG * limb.length_m / linear_sag) if linear_sag > 0 else 1.0
    how = f"{'' if share == 1.0 else f'{100 * share:.0f} % of '}its own weight, held out sideways"
    gravity = share * _STANDARD_GRAVITY_M_S2
    simulated = bend_by_load(model, limb, 0.0, gravity_m_s2=gravity)
    return _bend("weight", how, limb, loaded_tip(rod, gravity_m_s2=gravity), simulated)


def _gains(model: mujoco.MjModel, limb: Limb, row: Vector) -> Vector:
    """Return the turn of each degree of freedom per newton of tension, with constant moment arms, (nv,) [rad/N].

    Args:
        model: The robot.
        limb: The limb.
        row: Change of the cable's length with each degree of freedom, (nv,).
    """
    gains = np.zeros(model.nv)
    for dof in limb.bending_dofs:
        stiffness = float(np.atleast_1d(model.jnt_stiffness[int(model.dof_jntid[dof])])[0])
        gains[dof] = -row[dof] / stiffness if stiffness > 0 else 0.0
    return gains


def _bends(model: mujoco.MjModel, unloaded: mujoco.MjData, limb: Limb, turns: Vector) -> Vector:
    """Return the bend of each segment as a rotation vector in the world, without twist, (n, 3)."""
    bends = np.zeros((len(limb.segment_m), 3))
    ball = int(mujoco.mjtJoint.mjJNT_BALL)
    for dof in limb.bending_dofs:
        joint = int(model.dof_jntid[dof])
        if int(model.jnt_type[joint]) == ball:
            frame = unloaded.xmat[int(model.jnt_bodyid[joint])].reshape(3, 3)
            axis = frame[:, dof - int(model.jnt_dofadr[joint])]
        else:
            axis = unloaded.xaxis[joint]
        along = float((unloaded.xanchor[joint] - limb.clamp_m) @ limb.along)
        segment = int(np.argmin(np.abs(limb.joint_m - along)))
        bends[segment] += turns[dof] * (axis - (axis @ limb.along) * limb.along)
    return bends


def _compliance(rod: Rod) -> float:
    """Return the deflection of the tip per newton of transverse tip load in linear beam theory [m/N].

    It is the integral of x^2 / (E I), with x the distance from the tip.
    """
    to_tip = np.append(np.cumsum(rod.lengths_m[::-1])[::-1], 0.0)
    return float(((to_tip[:-1] ** 3 - to_tip[1:] ** 3) / (3.0 * rod.bending_stiffness_n_m2)).sum())


def _end_m(unloaded: mujoco.MjData, data: mujoco.MjData, limb: Limb) -> Vector:
    """Return the position of the rod's end in another pose, world, (3,) [m]."""
    body = limb.bodies[-1]
    local = unloaded.xmat[body].reshape(3, 3).T @ (limb.end_m - unloaded.xpos[body])
    return np.asarray(data.xpos[body] + data.xmat[body].reshape(3, 3) @ local)


def _tip(limb: Limb, end_m: Vector, transverse: Vector, angle_rad: float) -> Tip:
    moved = end_m - limb.clamp_m
    return Tip(float(moved @ limb.along), float(moved @ transverse), angle_rad)


def _bend(quantity: str, how: str, limb: Limb, exact: Tip, simulated: Tip | None) -> Comparison:
    if simulated is None:
        return Comparison(quantity=quantity, how=how, unit="m", note="no pose at rest was found")
    return Comparison(
        quantity=quantity,
        how=how,
        unit="m",
        exact=exact.transverse_m,
        simulated=simulated.transverse_m,
        error_percent=100 * (simulated.transverse_m / exact.transverse_m - 1),
        tip_error_percent=tip_distance_percent(limb, simulated, exact),
    )


def tip_distance_percent(limb: Limb, one: Tip, other: Tip) -> float:
    """Return the distance between two tips [% of the limb's length]."""
    return 100 * math.hypot(one.along_m - other.along_m, one.transverse_m - other.transverse_m) / limb.length_m
