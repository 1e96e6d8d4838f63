"""Division of a robot into the bodies that its cables bend and its rigid parts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.bending import bends_by_cables, constraint_jacobian, stiffness_alone
from aidsr.sim.couplings import coupled_dofs
from aidsr.sim.drive import read_drives
from aidsr.sim.limbs import SERIES_JOINTS, cloud_m, dofs_of, longest_lever, read_limbs
from aidsr.sim.ownership import equality_bodies, joins_bodies
from aidsr.sim.poses import bent_pose
from aidsr.sim.structure import Structure
from aidsr.sim.tendon_effects import unit_pull

Vector = NDArray[np.float64]
Mask = NDArray[np.bool_]

CHAIN_BEND_RAD = 0.1
"""Bend of a whole limb. A joint counts as bent from its even share of this angle. Our choice: this bend moves a limb's
tip by a twentieth of the limb's length, the displacement that the validator requires of an actuator."""

_BENT_RAD = 0.02
"""Rotation of every joint in the pose in which moment arms are read. It is not zero because in a straight limb a cable
that crosses the joint axes has an extreme length, and so a moment arm of zero."""
_LEVER = 1e-4
"""Moment arm / L below which a cable does not act on a joint. Our choice: 0.1 mm for a length of 1 m."""
_LOCKED = 1e-3
"""Share of a joint's motion that equality constraints leave, below which it is locked. Our choice: above rounding."""
_HINGE, _BALL = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL)
_SLIDE, _FREE = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_FREE)


@dataclass(frozen=True)
class SoftBody:
    """A robot divided into the bodies that its cables bend and its rigid parts.

    Attributes:
        series: Largest number of joints in series that cables bend.
        bent: Bodies with joints that cables bend, in series of three or more joints that share the bending.
        linkage: Bodies with other joints that cables turn or slide, directly or through couplings to a limb's joints.
        length_m: Total length of the bent series [m].
        largest_part: Bodies of the largest rigid part; no joint between them can bend.
        largest_part_m: Extent of that part [m]: the largest distance between two points of its colliding geoms. For the
            part that is fixed to a mount, it is instead the largest distance of these points from the straight lines
            between the mount and the limbs.
        heaviest_part: Bodies of the heaviest rigid part that can move.
        heaviest_share: Mass of that part / moving mass.
        unmoved: Moving bodies of a robot with a fixed root that come before every joint that cables bend.
        unmoved_share: Mass of those bodies / moving mass; 0 for a free root, which moves with its limbs.
        lever_part: Bodies of the rigid part that reaches farthest, relative to its limb, from the joint that carries
            it, of the parts that fewer than three bent joints in series carry.
        lever_m: That distance [m].
        lever_limb_m: Length of the longest limb through that part, from its first bent joint to its end; of all limbs
            for a part on a joint that no cable bends [m].
    """

    series: int
    bent: tuple[int, ...]
    linkage: tuple[int, ...]
    length_m: float
    largest_part: tuple[int, ...]
    largest_part_m: float
    heaviest_part: tuple[int, ...]
    heaviest_share: float
    unmoved: tuple[int, ...]
    unmoved_share: float
    lever_part: tuple[int, ...]
    lever_m: float
    lever_limb_m: float


def read_soft_body(model: mujoco.MjModel, structure: Structure, cables: Iterable[int]) -> SoftBody:
    """Return which bodies of a robot some of its actuators bend, calculated statically in the reference pose.

    A joint is bent if the strongest cable turns it by its share of `CHAIN_BEND_RAD` against its springs and within its
    range. A joint is rigid if neither a cable nor the robot's weight on a lever arm of L turns it that far.

    Args:
        model: Compiled model.
        structure: The robot in the model.
        cables: Ids of the actuators that pull on cables.
    """
    if not structure.bodies:
        return SoftBody(0, (), (), 0.0, (), 0.0, (), 0.0, (), 0.0, (), 0.0, 0.0)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    least_rad = CHAIN_BEND_RAD / max(structure.longest_series, SERIES_JOINTS)
    free = unlocked_dofs(model, data)
    lengths_m = _slide_unit(model, structure)
    turned = bent_pose(model, structure, _BENT_RAD)
    room, pulls = _room(model), _pulls(model, data, turned, structure, cables)
    torque, bend = bends_by_cables(model, data, turned, structure, pulls, room)
    weight = structure.weight_n * structure.characteristic_length_m
    with np.errstate(divide="ignore"):
        sag = weight / stiffness_alone(model, data, turned, structure, least_rad * lengths_m)
    bend_rad, sag_rad = bend / lengths_m, np.minimum(sag, room) / lengths_m
    bends, gives = free & (bend_rad >= least_rad), free & (sag_rad >= least_rad)
    limbs = read_limbs(model, data, structure, np.where(bends, np.minimum(bend_rad, np.pi), 0.0))
    bent = limbs.bent
    parts = _parts(model, structure, bends | gives)
    extents = {root: _extent_m(model, data, bodies) for root, bodies in parts.items()}
    for root in set(structure.roots) - set(structure.moving):
        extents[root] = _beyond_posts_m(model, data, root, parts[root], _limb_starts(model, data, bent))
    largest = max(extents, key=lambda root: extents[root])
    masses = {
        root: sum(float(model.body_mass[b]) for b in bodies if b in structure.moving) for root, bodies in parts.items()
    }
    heaviest = max(masses, key=lambda root: masses[root])
    unmoved = () if structure.free_roots else _unmoved(model, structure, bent)
    moved = bends | _geared(model, data, structure, torque > 0)
    lever_part, lever_m, lever_limb_m = longest_lever(model, data, limbs, parts)
    whole_kg = max(structure.mass_kg, np.finfo(float).tiny)
    return SoftBody(
        series=limbs.series,
        bent=bent,
        linkage=tuple(
            body
            for body in structure.moving
            if body not in bent
            and any(moved[dof] for dof in dofs_of(model, body) if model.jnt_type[model.dof_jntid[dof]] != _FREE)
        ),
        length_m=limbs.length_m,
        largest_part=parts[largest],
        largest_part_m=extents[largest],
        heaviest_part=parts[heaviest],
        heaviest_share=masses[heaviest] / whole_kg,
        unmoved=unmoved,
        unmoved_share=sum(float(model.body_mass[body]) for body in unmoved) / whole_kg,
        lever_part=lever_part,
        lever_m=lever_m,
        lever_limb_m=lever_limb_m,
    )


def _pulls(
    model: mujoco.MjModel, data: mujoco.MjData, turned: mujoco.MjData, structure: Structure, cables: Iterable[int]
) -> Iterator[Vector]:
    """Yield the generalized force of each cable at its strongest, (nv,) [N m; N for a slide].

    Moment arms are read in the pose of `turned`.
    """
    wanted = set(cables)
    for drive in read_drives(model, data, structure):
        if drive.actuator in wanted:
            arms = unit_pull(model, turned, int(model.actuator_trnid[drive.actuator, 0]))
            arms[np.abs(arms) < _LEVER * structure.characteristic_length_m] = 0.0
            yield max(-drive.force_low_n, -drive.force_high_n, 0.0) * arms


def _room(model: mujoco.MjModel) -> Vector:
    """Return how far each degree of freedom may move from the reference pose to the farther end of its range.

    (nv,) [rad or m]; infinite for a joint without a range.
    """
    joints = np.asarray(model.dof_jntid)
    start = np.array(
        [
            model.qpos0[model.jnt_qposadr[joint]] if model.jnt_type[joint] in (_HINGE, _SLIDE) else 0.0
            for joint in joints
        ]
    )
    ends = np.abs(np.asarray(model.jnt_range)[joints] - start[:, None]).max(axis=1, initial=0.0)
    room = np.maximum(ends - np.asarray(model.jnt_margin)[joints], 0.0)
    return np.where(np.asarray(model.jnt_limited, dtype=bool)[joints], room, np.inf)


def unlocked_dofs(model: mujoco.MjModel, data: mujoco.MjData) -> Mask:
    """Return which degrees of freedom the active equality constraints do not lock, (nv,).

    Args:
        model: Compiled model.
        data: Data of the model after `mj_forward`.
    """
    rows = np.flatnonzero(np.asarray(data.efc_type) == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY))
    if not rows.size:
        return np.ones(model.nv, dtype=bool)
    equal = constraint_jacobian(model, data)[rows]
    left = 1.0 - np.einsum("ij,ji->i", np.linalg.pinv(equal, rcond=1e-6), equal)
    return np.asarray(left > _LOCKED)


def _geared(model: mujoco.MjModel, data: mujoco.MjData, structure: Structure, pulled: Mask) -> Mask:
    """Return which degrees of freedom are coupled to a limb that a cable acts on and are not the limb's own, (nv,).

    Connect and weld constraints couple joints too, except those of other limbs of three or more joints: limbs whose
    ends are joined are one closed soft body.

    Args:
        model: Compiled model.
        data: Data of the model after `mj_forward`.
        structure: The robot in the model.
        pulled: Which degrees of freedom a cable acts on, (nv,).
    """
    joints = np.asarray(model.dof_jntid)
    inner = np.asarray(model.jnt_type)[joints] != _FREE
    limbs = [np.isin(joints, chain.joints) for chain in structure.chains if len(chain.bodies) >= SERIES_JOINTS]
    of_limbs = np.any(limbs, axis=0) if limbs else np.zeros(model.nv, dtype=bool)
    couples, joined = coupled_dofs(model, data) & inner, _joined_dofs(model) & inner
    geared = np.zeros(model.nv, dtype=bool)
    for chain in structure.chains if len(couples) or len(joined) else ():
        own = np.isin(joints, chain.joints)
        couples = np.concatenate([couples, joined & (own | ~of_limbs)])
        reached, count = own & pulled, -1
        while reached.sum() > count:
            count = reached.sum()
            reached = reached | couples[(couples & reached).any(axis=1)].any(axis=0)
        geared |= reached & ~own
    return geared


def _joined_dofs(model: mujoco.MjModel) -> Mask:
    """Return which degrees of freedom move one of the two bodies of each connect or weld and not the other, (n, nv)."""
    rows = [np.zeros(model.nv, dtype=bool)]
    for equality in np.flatnonzero(np.asarray(model.eq_active0)).tolist():
        if joins_bodies(model, equality):
            row = np.zeros(model.nv, dtype=bool)
            for end in equality_bodies(model, equality):
                row ^= _moves(model, end)
            rows.append(row)
    return np.array(rows)


def _moves(model: mujoco.MjModel, body: int) -> Mask:
    """Return which degrees of freedom move a body, (nv,)."""
    moves = np.zeros(model.nv, dtype=bool)
    while body:
        moves[dofs_of(model, body)] = True
        body = int(model.body_parentid[body])
    return moves


def _limb_starts(model: mujoco.MjModel, data: mujoco.MjData, bent: tuple[int, ...]) -> list[Vector]:
    """Return the world positions of the first bent joint of each limb [m]."""
    starts, passed = [], set[int]()
    for body in range(model.nbody):
        if int(model.body_parentid[body]) in passed:
            passed.add(body)
        elif body in bent:
            passed.add(body)
            starts.append(np.array(data.xanchor[int(model.body_jntadr[body])]))
    return starts


def _beyond_posts_m(
    model: mujoco.MjModel, data: mujoco.MjData, root: int, bodies: Iterable[int], starts: list[Vector]
) -> float:
    """Return the largest distance of a mounted part from the straight lines between the mount and the limbs [m].

    Args:
        model: Compiled model.
        data: Data of the model in the reference pose.
        root: Root body, whose origin is on the mount.
        bodies: Bodies of the mounted part.
        starts: World positions at which the limbs begin [m].
    """
    cloud = cloud_m(model, data, bodies)
    if not len(cloud):
        return 0.0
    origin = data.xpos[root]
    away_m = np.linalg.norm(cloud - origin, axis=1)
    for start in starts:
        line = start - origin
        along = np.clip((cloud - origin) @ line / max(float(line @ line), 1e-12), 0.0, 1.0)
        away_m = np.minimum(away_m, np.linalg.norm(cloud - origin - along[:, None] * line, axis=1))
    return float(away_m.max())


def _parts(model: mujoco.MjModel, structure: Structure, moves: Mask) -> dict[int, tuple[int, ...]]:
    """Return the rigid parts, keyed by their first body: groups of bodies with no movable joint between them.

    `moves` says which degrees of freedom can move, (nv,).
    """
    first: dict[int, int] = {}
    for body in structure.bodies:
        parent = int(model.body_parentid[body])
        stays = not any(moves[dof] for dof in dofs_of(model, body))
        first[body] = first[parent] if stays and parent in first else body
    parts: dict[int, list[int]] = {}
    for body, root in first.items():
        parts.setdefault(root, []).append(body)
    return {root: tuple(bodies) for root, bodies in parts.items()}


def _extent_m(model: mujoco.MjModel, data: mujoco.MjData, bodies: Iterable[int]) -> float:
    """Return the largest distance between two points of some bodies' colliding geoms [m]."""
    cloud = cloud_m(model, data, bodies)
    if not len(cloud):
        return 0.0
    along = cloud @ _directions().T
    return float((along.max(axis=0) - along.min(axis=0)).max())


def _directions() -> Vector:
    """Return unit vectors spread over a hemisphere, (n, 3).

    The largest projected length along one of them is the extent of a body within 2 %.
    """
    count = 128
    k = np.arange(count) + 0.5
    height, turn = k / count, np.pi * (1 + 5**0.5) * k
    ring = np.sqrt(1 - height**2)
    return np.stack([ring * np.cos(turn), ring * np.sin(turn), height], axis=1)


def _slide_unit(model: mujoco.MjModel, structure: Structure) -> Vector:
    """Return the unit of each degree of freedom's motion, (nv,): L for a slide, 1 for a rotational one.

    Motion along a slide is thus measured as a share of L.
    """
    kinds = np.asarray(model.jnt_type)[np.asarray(model.dof_jntid)]
    return np.where(kinds == _SLIDE, structure.characteristic_length_m, 1.0)


def _unmoved(model: mujoco.MjModel, structure: Structure, bent: tuple[int, ...]) -> tuple[int, ...]:
    moved: set[int] = set(bent)
    for body in structure.bodies:
        if int(model.body_parentid[body]) in moved:
            moved.add(body)
    return tuple(body for body in structure.moving if body not in moved)
