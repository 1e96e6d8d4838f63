"""Division of a robot into the bodies that its cables bend and its rigid parts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.couplings import coupled_dofs
from aidsr.sim.drive import read_drives
from aidsr.sim.extent import UNBOUNDED, box_corners_m
from aidsr.sim.poses import bent_pose
from aidsr.sim.structure import SAME_POINT, Structure
from aidsr.sim.tendon_effects import length_gradient

Vector = NDArray[np.float64]
Mask = NDArray[np.bool_]

SERIES_JOINTS = 3
"""Smallest number of joints in series that a continuum limb bends; a limb with two joints is a linkage. Our choice."""

CHAIN_BEND_RAD = 0.1
"""Bend of a whole limb. A joint counts as bent from its even share of this angle. Our choice: this bend moves a limb's
tip by a twentieth of the limb's length, the displacement that the validator requires of an actuator."""

_BENT_RAD = 0.02
"""Rotation of every joint in the pose in which moment arms are read. It is not zero because in a straight limb a cable
that crosses the joint axes has an extreme length, and so a moment arm of zero."""
_SLOWEST_S = 10.0
"""Time within which a joint has to bend; a joint that damping and armature hold longer counts as rigid. Our choice:
about the length of an episode."""
_LEVER = 1e-4
"""Moment arm / L below which a cable does not act on a joint. Our choice: 0.1 mm for a length of 1 m."""
_LOCKED = 1e-3
"""Share of a joint's motion that equality constraints leave, below which it is locked. Our choice: above rounding."""
EVEN_JOINTS = 2.0
"""Smallest effective number of bent joints, (sum b)^2 / sum b^2 with the bends b, of a limb that shares its bending
among its joints. Our choice: the number is 1 to 1.6 for a rod on one soft hinge, and 3 for three equal joints."""
_LONG_LINK = 2.0
"""Link length / median link length above which the remainder of a link counts as rigid. Our choice."""

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
        return SoftBody(0, (), (), 0.0, (), 0.0, (), 0.0, (), 0.0)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    least_rad = CHAIN_BEND_RAD / max(structure.longest_series, SERIES_JOINTS)
    free = unlocked_dofs(model, data)
    holding = _holding(model)
    room_rad = _room(model)
    torque = _cable_torques(model, data, structure, cables)
    weight = structure.weight_n * structure.characteristic_length_m
    lengths_m = _slide_unit(model, structure)
    with np.errstate(divide="ignore", invalid="ignore"):
        bend_rad = np.where(torque > 0, np.minimum(torque / holding, room_rad), 0.0) / lengths_m
        sag_rad = np.minimum(weight / holding, room_rad) / lengths_m
    bends, gives = free & (bend_rad >= least_rad), free & (sag_rad >= least_rad)
    series, bent, length_m = _series(model, data, structure, np.where(bends, np.minimum(bend_rad, np.pi), 0.0))
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
    whole_kg = max(structure.mass_kg, np.finfo(float).tiny)
    return SoftBody(
        series=series,
        bent=bent,
        linkage=tuple(
            body
            for body in structure.moving
            if body not in bent
            and any(moved[dof] for dof in _dofs(model, body) if model.jnt_type[model.dof_jntid[dof]] != _FREE)
        ),
        length_m=length_m,
        largest_part=parts[largest],
        largest_part_m=extents[largest],
        heaviest_part=parts[heaviest],
        heaviest_share=masses[heaviest] / whole_kg,
        unmoved=unmoved,
        unmoved_share=sum(float(model.body_mass[body]) for body in unmoved) / whole_kg,
    )


def _cable_torques(model: mujoco.MjModel, data: mujoco.MjData, structure: Structure, cables: Iterable[int]) -> Vector:
    """Return the largest force of a single cable on each degree of freedom, (nv,) [N m; N for a slide].

    The friction loss of the degree of freedom is subtracted.
    """
    bent = bent_pose(model, structure, _BENT_RAD)
    largest = np.zeros(model.nv)
    wanted = set(cables)
    for drive in read_drives(model, data, structure):
        if drive.actuator not in wanted:
            continue
        pull_n = max(-drive.force_low_n, -drive.force_high_n, 0.0)
        tendon = int(model.actuator_trnid[drive.actuator, 0])
        arms = np.abs(length_gradient(model, bent, tendon))
        arms[arms < _LEVER * structure.characteristic_length_m] = 0.0
        largest = np.maximum(largest, pull_n * arms)
    return np.asarray(np.maximum(largest - np.asarray(model.dof_frictionloss), 0.0))


def _holding(model: mujoco.MjModel) -> Vector:
    """Return the effective stiffness of each degree of freedom, (nv,) [N m/rad].

    It includes the resistance of damping and armature to a motion within `_SLOWEST_S`.
    """
    joints = np.asarray(model.dof_jntid)
    springs = np.abs(np.asarray(model.jnt_stiffness)[joints])
    dampers = np.abs(np.asarray(model.dof_damping)) / _SLOWEST_S
    return np.asarray(springs + dampers + 2.0 * np.asarray(model.dof_armature) / _SLOWEST_S**2)


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
    return np.where(np.asarray(model.jnt_limited, dtype=bool)[joints], ends, np.inf)


def unlocked_dofs(model: mujoco.MjModel, data: mujoco.MjData) -> Mask:
    """Return which degrees of freedom the active equality constraints do not lock, (nv,).

    Args:
        model: Compiled model.
        data: Data of the model after `mj_forward`.
    """
    rows = np.flatnonzero(np.asarray(data.efc_type) == int(mujoco.mjtConstraint.mjCNSTR_EQUALITY))
    if not rows.size:
        return np.ones(model.nv, dtype=bool)
    jacobian = np.zeros((data.nefc, model.nv))
    if mujoco.mj_isSparse(model):
        mujoco.mju_sparse2dense(jacobian, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
    else:
        jacobian = np.asarray(data.efc_J).reshape(data.nefc, model.nv)
    equal = jacobian[rows]
    left = 1.0 - np.einsum("ij,ji->i", np.linalg.pinv(equal, rcond=1e-6), equal)
    return np.asarray(left > _LOCKED)


def _geared(model: mujoco.MjModel, data: mujoco.MjData, structure: Structure, pulled: Mask) -> Mask:
    """Return which degrees of freedom are coupled to a limb that a cable acts on and are not the limb's own, (nv,).

    Args:
        model: Compiled model.
        data: Data of the model after `mj_forward`.
        structure: The robot in the model.
        pulled: Which degrees of freedom a cable acts on, (nv,).
    """
    joints = np.asarray(model.dof_jntid)
    couples = coupled_dofs(model, data) & (np.asarray(model.jnt_type)[joints] != _FREE)
    geared = np.zeros(model.nv, dtype=bool)
    for chain in structure.chains if len(couples) else ():
        own = np.isin(joints, chain.joints)
        reached, count = own & pulled, -1
        while reached.sum() > count:
            count = reached.sum()
            reached = reached | couples[(couples & reached).any(axis=1)].any(axis=0)
        geared |= reached & ~own
    return geared


def _dofs(model: mujoco.MjModel, body: int) -> list[int]:
    first = int(model.body_dofadr[body])
    return list(range(first, first + int(model.body_dofnum[body]))) if first >= 0 else []


def _turns(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the degrees of freedom of a body's hinges and balls."""
    return [dof for dof in _dofs(model, body) if int(model.jnt_type[model.dof_jntid[dof]]) in (_HINGE, _BALL)]


def _series(
    model: mujoco.MjModel, data: mujoco.MjData, structure: Structure, bends_rad: Vector
) -> tuple[int, tuple[int, ...], float]:
    """Return the series of joints that bend between the root and the leaves; a series may pass through branches.

    Args:
        model: Compiled model.
        data: Data of the model in the reference pose.
        structure: The robot in the model.
        bends_rad: Angle by which cables bend each degree of freedom, 0 if it is too small to count, (nv,).

    Returns:
        Largest number of joints in series that share the bending; the bodies in series of three or more such joints;
        the total length of these series [m].
    """
    parents = model.body_parentid
    bend_rad = {body: max((bends_rad[dof] for dof in _turns(model, body)), default=0.0) for body in structure.moving}
    bending = [body for body in structure.moving if bend_rad[body] > 0]
    anchors = {body: np.array(data.xanchor[int(model.body_jntadr[body])]) for body in bending}
    before: dict[int, int] = {}
    for body in bending:
        parent = int(parents[body])
        while parent and parent not in anchors:
            parent = int(parents[parent])
        before[body] = parent
    distances_m = {
        body: float(np.linalg.norm(anchors[body] - anchors[parent])) if parent else 0.0
        for body, parent in before.items()
    }
    new = {
        body: not before[body] or distances_m[body] >= SAME_POINT * structure.characteristic_length_m
        for body in bending
    }
    series, kept = 0, set[int]()
    for leaf in set(bending) - set(before.values()):
        line = [leaf]
        while before[line[-1]]:
            line.append(before[line[-1]])
        bends = np.array([bend_rad[body] for body in line if new[body]])
        shared = len(bends) if bends.sum() ** 2 >= EVEN_JOINTS * (bends**2).sum() else 1
        series = max(series, shared)
        if shared >= SERIES_JOINTS:
            kept.update(line)
    links_m = [distances_m[body] for body in kept if before[body] and new[body]]
    if not links_m:
        return series, tuple(sorted(kept)), 0.0
    median_m = float(np.median(links_m))
    ends = len(kept - {before[body] for body in kept})
    length_m = sum(min(link_m, _LONG_LINK * median_m) for link_m in links_m) + ends * median_m
    return series, tuple(sorted(kept)), length_m


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
    cloud = _cloud(model, data, bodies)
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
        stays = not any(moves[dof] for dof in _dofs(model, body))
        first[body] = first[parent] if stays and parent in first else body
    parts: dict[int, list[int]] = {}
    for body, root in first.items():
        parts.setdefault(root, []).append(body)
    return {root: tuple(bodies) for root, bodies in parts.items()}


def _cloud(model: mujoco.MjModel, data: mujoco.MjData, bodies: Iterable[int]) -> Vector:
    """Return the corners of the bounding boxes of some bodies' colliding geoms, (n, 3) [m]."""
    points = []
    for body in bodies:
        for geom in range(model.body_geomadr[body], model.body_geomadr[body] + model.body_geomnum[body]):
            solid = model.geom_contype[geom] or model.geom_conaffinity[geom]
            if solid and int(model.geom_type[geom]) not in UNBOUNDED:
                points.append(box_corners_m(model, data, geom))
    return np.concatenate(points) if points else np.zeros((0, 3))


def _extent_m(model: mujoco.MjModel, data: mujoco.MjData, bodies: Iterable[int]) -> float:
    """Return the largest distance between two points of some bodies' colliding geoms [m]."""
    cloud = _cloud(model, data, bodies)
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
