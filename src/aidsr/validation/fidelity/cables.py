"""The cables along a limb: their guides and their greatest tension."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.actuator_force import control_of, end_forces, output_of
from aidsr.sim.ownership import WRAP_SITE, tendon_wraps
from aidsr.sim.structure import Structure, name_of
from aidsr.validation.fidelity.limb import Limb, unloaded_pose

Vector = NDArray[np.float64]

_FIXED_GAIN = int(mujoco.mjtGain.mjGAIN_FIXED)


@dataclass(frozen=True)
class Cable:
    """A driven tendon that runs along one limb and no other.

    Attributes:
        tendon: Id of the tendon.
        name: Name of the tendon.
        pull_n: Greatest tension of all its actuators together in the unloaded pose; 0 if unknown.
    """

    tendon: int
    name: str
    pull_n: float


@dataclass(frozen=True)
class Guide:
    """A point through which a cable runs.

    Attributes:
        segment: Index of the segment that contains the guide; -1 on the base.
        place: Position along that segment, 0 to 1; on the base the position along the limb relative to the clamp [m].
        outer: Whether the guide moves with the part beyond the segment's joint.
        across_m: Offset from the backbone along `Limb.transverse` and `Limb.axis`, (2,) [m].
    """

    segment: int
    place: float
    outer: bool
    across_m: tuple[float, float]


def cables_along(model: mujoco.MjModel, structure: Structure, limb: Limb, others: set[int]) -> tuple[Cable, ...]:
    """Return the driven cables that run along a limb.

    Args:
        model: The robot.
        structure: The structure of the robot.
        limb: The limb.
        others: Bodies of other limbs; a cable that touches one of them is left out.
    """
    data = unloaded_pose(model)
    return tuple(
        Cable(tendon.id, name_of(model, mujoco.mjtObj.mjOBJ_TENDON, tendon.id), _pull_n(model, data, tendon.actuators))
        for tendon in structure.tendons
        if tendon.spatial
        and tendon.actuators
        and any(_link(model, limb, body) >= 0 for body in tendon.bodies)
        and not any(_link(model, limb, body) < 0 and body in others for body in tendon.bodies)
    )


def guides_of(model: mujoco.MjModel, limb: Limb, cable: Cable) -> tuple[Guide, ...] | None:
    """Return the guides of a cable from the base outwards.

    None if the cable wraps around geoms or runs over pulleys, or if its sites are not in order along the limb or belong
    to bodies of other segments.
    """
    data = unloaded_pose(model)
    wraps = tendon_wraps(model, cable.tendon)
    if any(kind != WRAP_SITE for kind, _ in wraps):
        return None
    ends = np.cumsum(limb.segment_m)
    guides = []
    for _, site in wraps:
        link = _link(model, limb, int(model.site_bodyid[site]))
        point = data.site_xpos[site] - limb.clamp_m
        along = float(point @ limb.along)
        across = (float(point @ limb.transverse), float(point @ limb.axis))
        on_base = link < 0 and limb.joints_at == "starts"
        if along < -1e-6 * limb.length_m or on_base:
            guides.append(Guide(-1, along, False, across))
            continue
        segment = min(int(np.searchsorted(ends, along + 1e-9)), len(ends) - 1)
        place = (along - float(ends[segment] - limb.segment_m[segment])) / float(limb.segment_m[segment])
        if link not in (segment - 1, segment):
            return None
        guides.append(Guide(segment, place, link == segment, across))
    keys = [(guide.segment, guide.place) for guide in guides]
    ordered = guides if keys == sorted(keys) else guides[::-1]
    return tuple(ordered) if keys in (sorted(keys), sorted(keys)[::-1]) else None


def _link(model: mujoco.MjModel, limb: Limb, body: int) -> int:
    """Return the index of the turning point that moves a body, or -1 if the body is not part of the limb."""
    while body and body not in limb.bodies:
        body = int(model.body_parentid[body])
    return limb.bodies.index(body) if body in limb.bodies else -1


def _pull_n(model: mujoco.MjModel, data: mujoco.MjData, actuators: tuple[int, ...]) -> float:
    """Return the greatest tension of some actuators together at the ends of their ranges [N]; 0 if unknown."""
    total = 0.0
    for actuator in actuators:
        control, length = control_of(model, actuator), float(data.actuator_length[output_of(model, actuator)])
        if int(model.actuator_gaintype[actuator]) != _FIXED_GAIN or not model.actuator_ctrllimited[control]:
            return 0.0
        forces = end_forces(model, actuator, length, *model.actuator_ctrlrange[control])
        if forces is None:
            return 0.0
        total += max(0.0, *(-force for force in forces))
    return total
