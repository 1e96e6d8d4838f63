"""The properties of the rod that a limb represents: bending stiffness, mass, and a rigid part on its end."""

from __future__ import annotations

import mujoco
import numpy as np

from aidsr.sim.elastica import Rod
from aidsr.sim.structure import Structure
from aidsr.validation.fidelity.limb import Limb, unloaded_pose

_EXTRA = 0.1
"""Relative excess of the last link's mass per length over its neighbour's, above which a rigid part sits on the last
link. Our choice: rounded ends add a few per cent."""


def rod_of(model: mujoco.MjModel, structure: Structure, limb: Limb) -> Rod:
    """Return the rod that a limb represents.

    For each segment, E I is the joint stiffness times the segment length. The mass of each link is distributed evenly
    from joint to joint. If the last link is heavier per length than its neighbour by more than `_EXTRA`, the excess is
    a rigid part on the end.
    """
    bending = limb.stiffness_n_m_rad * limb.segment_m
    if limb.clamp_doubled:
        bending[0] /= 2.0
    links = [_hanging(model, structure, body) for body in limb.bodies]
    links = [link - links[i + 1] if i + 1 < len(links) else link for i, link in enumerate(links)]
    masses = np.array([sum(float(model.body_mass[body]) for body in link) for link in links])
    middles = limb.joints_at == "middles"
    spans = (limb.segment_m + np.append(limb.segment_m[1:], 0.0)) / 2.0 if middles else limb.segment_m
    densities = masses / spans
    tip = (0.0, 0.0, 0.0)
    if densities[-1] > (1.0 + _EXTRA) * densities[-2]:
        densities[-1] = densities[-2]
        tip = _rigid_part(model, limb, links[-1], float(spans[-1]), float(densities[-1]))
    if not middles:
        return Rod(limb.segment_m, bending, densities, *tip)
    before = np.append(densities[:1], densities[:-1])
    halves = np.stack([before, densities], axis=1).ravel()
    return Rod(np.repeat(limb.segment_m / 2.0, 2), np.repeat(bending, 2), halves, *tip)


def _rigid_part(
    model: mujoco.MjModel, limb: Limb, link: set[int], span_m: float, density_kg_m: float
) -> tuple[float, float, float]:
    """Return the mass, the offset from the rod's end and the inertia of the rigid part on the last link."""
    data = unloaded_pose(model)
    mass = first = second = 0.0
    for body in link:
        m, at = float(model.body_mass[body]), float((data.xipos[body] - limb.end_m) @ limb.along)
        frame = data.ximat[body].reshape(3, 3)
        mass, first = mass + m, first + m * at
        second += m * at**2 + float(limb.axis @ (frame * model.body_inertia[body]) @ frame.T @ limb.axis)
    share = density_kg_m * span_m
    mass, first, second = mass - share, first + share * span_m / 2.0, second - share * span_m**2 / 3.0
    return mass, first / mass, max(0.0, second - first**2 / mass)


def _hanging(model: mujoco.MjModel, structure: Structure, body: int) -> set[int]:
    """Return a body and all its descendants in the robot."""
    hanging = {body}
    for other in structure.bodies:
        if int(model.body_parentid[other]) in hanging:
            hanging.add(other)
    return hanging
