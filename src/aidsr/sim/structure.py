"""Structure of the robot in a compiled model: chains, tendons, actuators and the characteristic length."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.extent import UNBOUNDED, characteristic_length_m, geoms_box_m, outside_m
from aidsr.sim.ownership import (
    WRAP_JOINT,
    WRAP_SITE,
    equality_bodies,
    joins_bodies,
    read_ownership,
    tendon_bodies,
    tendon_wraps,
)
from aidsr.sim.tendon_effects import opposite_pairs, symmetric_groups, unit_pull

Vector = NDArray[np.float64]

NEIGHBOURS = 2
"""Steps between two bodies, see `neighbours`, up to which an overlap is intended. Our choice."""
_HINGE, _BALL, _SLIDE, _FREE = (
    int(getattr(mujoco.mjtJoint, f"mjJNT_{kind}")) for kind in ("HINGE", "BALL", "SLIDE", "FREE")
)
_TURNING = (_HINGE, _BALL)
_TENDON_TRANSMISSION = int(mujoco.mjtTrn.mjTRN_TENDON)

STANDARD_GRAVITY_M_S2 = 9.81
SAME_POINT = 1e-3
"""Distance / L below which two joints turn about the same point, like a universal joint made of two hinges. Our choice:
a hundredth of a segment of a ten-segment limb."""
OFF_SHARE = 0.05
"""Distance / L from the bounding box of the robot's solid geoms beyond which a site is a point in the air and no point
of the robot. Our choice: points between fingers and on tips are inside the box, in all 320 recorded designs."""


@dataclass(frozen=True)
class Chain:
    """Hinge and ball joints in series, without a branch between them.

    A turning point is the position of a joint, or of several joints that turn about the same point.

    Attributes:
        bodies: Body ids from the root outwards, one per turning point (the last body of a universal joint).
        joints: Ids of the hinge and ball joints, in the same order.
        anchors_m: Turning points in the reference pose, (n_bodies, 3) [m].
    """

    bodies: tuple[int, ...]
    joints: tuple[int, ...]
    anchors_m: Vector

    @property
    def spacing_m(self) -> float:
        """Median distance between neighbouring turning points [m], the length of a segment; 0 for a single point."""
        if len(self.bodies) < 2:
            return 0.0
        return float(np.median(np.linalg.norm(np.diff(self.anchors_m, axis=0), axis=1)))


@dataclass(frozen=True)
class Tendon:
    """A tendon of the robot and its path.

    Attributes:
        id: Tendon id.
        spatial: Whether it has a path; a fixed tendon is a weighted sum of joint positions and has none.
        sites: Ids of its sites in order; empty for a fixed tendon.
        bodies: Ids of the bodies along it in order, without immediate repetitions.
        spans: Number of parts along it that can move relative to each other; for a fixed tendon, number of joints + 1.
        actuators: Ids of the actuators that act on it.
    """

    id: int
    spatial: bool
    sites: tuple[int, ...]
    bodies: tuple[int, ...]
    spans: int
    actuators: tuple[int, ...]


@dataclass(frozen=True)
class Structure:
    """The robot in a compiled model. Elements are given by their ids in that model.

    Attributes:
        is_scene: Whether the model is a robot placed in an environment.
        bodies: All bodies of the robot, parents first.
        roots: Bodies whose parent does not belong to the robot.
        free_roots: Roots with a free joint.
        moving: Bodies with a joint, or with an ancestor in the robot that has one.
        joints, geoms, sites: All joints, geoms and sites of the robot's bodies.
        marks: Sites that no tendon runs through, such as tips and other named points, without points in the air; see
            `OFF_SHARE`.
        chains: Series of hinge and ball joints, longest first.
        longest_series: Largest number of turning points between a root and a leaf; the path may pass through branches.
        tendons: Tendons of the robot.
        actuators: Actuators of the robot.
        tendon_actuators: Actuators of the robot that act on a tendon.
        sensors: Sensors of the robot.
        characteristic_length_m: Characteristic length L, with which rules and tasks normalize lengths [m].
        mass_kg: Mass of the moving bodies [kg].
        opposite_pairs: Pairs of actuators whose tendons pull the same joints in opposite directions.
        symmetric_groups: Groups of two or more actuators that have the same effect in different limbs of equal build.
    """

    is_scene: bool
    bodies: tuple[int, ...]
    roots: tuple[int, ...]
    free_roots: tuple[int, ...]
    moving: tuple[int, ...]
    joints: tuple[int, ...]
    geoms: tuple[int, ...]
    sites: tuple[int, ...]
    marks: tuple[int, ...]
    chains: tuple[Chain, ...]
    longest_series: int
    tendons: tuple[Tendon, ...]
    actuators: tuple[int, ...]
    tendon_actuators: tuple[int, ...]
    sensors: tuple[int, ...]
    characteristic_length_m: float
    mass_kg: float
    opposite_pairs: tuple[tuple[int, int], ...]
    symmetric_groups: tuple[tuple[int, ...], ...]

    @property
    def weight_n(self) -> float:
        """Weight of the moving bodies on Earth [N]."""
        return self.mass_kg * STANDARD_GRAVITY_M_S2


def name_of(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> str:
    """Return the name of an element, or its kind and id if it has none."""
    name: str = mujoco.mj_id2name(model, kind, index) or ""
    return name or f"{kind.name.removeprefix('mjOBJ_').lower()} {index}"


def names_of(model: mujoco.MjModel, kind: mujoco.mjtObj, indices: tuple[int, ...]) -> tuple[str, ...]:
    """Return the names of several elements of one kind."""
    return tuple(name_of(model, kind, index) for index in indices)


def read_structure(model: mujoco.MjModel) -> Structure:
    """Return the structure of the robot in a compiled model, in its reference pose."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    ours = read_ownership(model)
    owned = ours.bodies
    roots = tuple(body for body in owned if model.body_parentid[body] not in owned)
    moving = _moving_bodies(model, owned)
    length_m = characteristic_length_m(model, data, owned, moving)
    actuators = tuple(i for i in range(model.nactuator) if ours.actuator(i))
    tendon_actuators = tuple(i for i in actuators if int(model.actuator_trntype[i]) == _TENDON_TRANSMISSION)
    chains, longest_series = _read_chains(model, data, moving, length_m)
    pulls = {i: unit_pull(model, data, int(model.actuator_trnid[i, 0])) for i in tendon_actuators}
    geoms = tuple(i for i in range(model.ngeom) if model.geom_bodyid[i] in owned)
    sites = tuple(i for i in range(model.nsite) if model.site_bodyid[i] in owned)
    tendons = tuple(_read_tendon(model, i, actuators) for i in range(model.ntendon) if ours.tendon(i))
    return Structure(
        is_scene=ours.is_scene,
        bodies=owned,
        roots=roots,
        free_roots=tuple(body for body in roots if _joint_types(model, body)[:1] == [_FREE]),
        moving=moving,
        joints=tuple(i for i in range(model.njnt) if model.jnt_bodyid[i] in owned),
        geoms=geoms,
        sites=sites,
        marks=_marks(model, data, geoms, sites, tendons, length_m),
        chains=chains,
        longest_series=longest_series,
        tendons=tendons,
        actuators=actuators,
        tendon_actuators=tendon_actuators,
        sensors=tuple(i for i in range(model.nsensor) if ours.sensor(i)),
        characteristic_length_m=length_m,
        mass_kg=float(sum(model.body_mass[body] for body in moving)),
        opposite_pairs=opposite_pairs(pulls),
        symmetric_groups=symmetric_groups([_dofs(model, chain) for chain in chains], pulls),
    )


def _marks(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    geoms: tuple[int, ...],
    sites: tuple[int, ...],
    tendons: tuple[Tendon, ...],
    length_m: float,
) -> tuple[int, ...]:
    """Return the sites that no tendon runs through and that are not in the air; see `Structure.marks`."""
    routing = {site for tendon in tendons for site in tendon.sites}
    marks = tuple(site for site in sites if site not in routing)
    touching = [geom for geom in geoms if model.geom_contype[geom] or model.geom_conaffinity[geom]]
    solid = [geom for geom in touching if int(model.geom_type[geom]) not in UNBOUNDED]
    if not solid:
        return marks
    low, high = geoms_box_m(model, data, solid)
    return tuple(site for site in marks if outside_m(low, high, data.site_xpos[site]) <= OFF_SHARE * length_m)


def joined_bodies(model: mujoco.MjModel) -> set[frozenset[int]]:
    """Return the pairs of bodies that an active connect or weld constraint joins, whether given by bodies or sites."""
    return {
        frozenset(equality_bodies(model, equality))
        for equality in np.flatnonzero(model.eq_active0).tolist()
        if joins_bodies(model, equality)
    }


def neighbours(model: mujoco.MjModel, structure: Structure) -> dict[int, set[int]]:
    """Return, for the world and each body of the robot, all of these bodies up to `NEIGHBOURS` steps away.

    A step is from child to parent, from parent to child, or across an equality constraint that joins two bodies.
    """
    bodies = (0, *structure.bodies)
    beside: dict[int, set[int]] = {body: set() for body in bodies}
    pairs = [(body, int(model.body_parentid[body])) for body in structure.bodies]
    pairs += [(min(pair), max(pair)) for pair in joined_bodies(model)]
    for one, other in pairs:
        if one in beside and other in beside:
            beside[one].add(other)
            beside[other].add(one)
    near = {body: {body} for body in bodies}
    for _ in range(NEIGHBOURS):
        near = {body: reached.union(*(beside[other] for other in reached)) for body, reached in near.items()}
    return near


def root_of(model: mujoco.MjModel, structure: Structure, body: int) -> int:
    """Return the root of the robot that carries a body; 0 for the world and the bodies of an environment."""
    while body and body not in structure.roots:
        body = int(model.body_parentid[body])
    return body


def string_ends(model: mujoco.MjModel, structure: Structure) -> Iterator[list[int]]:
    """Yield, for each string, the roots it runs between; 0 is the world.

    A string is a tendon without an actuator that has a limit or a stiffness. Driven cables do not hold separate parts
    together, and a tendon that is only measured holds nothing.
    """
    for tendon in structure.tendons:
        if not tendon.actuators and (model.tendon_limited[tendon.id] or np.any(model.tendon_stiffness[tendon.id])):
            yield list(dict.fromkeys(root_of(model, structure, body) for body in tendon.bodies))


def _moving_bodies(model: mujoco.MjModel, owned: tuple[int, ...]) -> tuple[int, ...]:
    moving: list[int] = []
    for body in owned:
        if model.body_jntnum[body] or int(model.body_parentid[body]) in moving:
            moving.append(body)
    return tuple(moving)


def _joint_types(model: mujoco.MjModel, body: int) -> list[int]:
    first = int(model.body_jntadr[body])
    return [int(model.jnt_type[first + k]) for k in range(model.body_jntnum[body])]


def _read_tendon(model: mujoco.MjModel, index: int, actuators: tuple[int, ...]) -> Tendon:
    wraps = tendon_wraps(model, index)
    spatial = not any(kind == WRAP_JOINT for kind, _ in wraps)
    bodies = tuple(tendon_bodies(model, index))
    return Tendon(
        id=index,
        spatial=spatial,
        sites=tuple(target for kind, target in wraps if kind == WRAP_SITE),
        bodies=bodies,
        spans=len({int(model.body_weldid[body]) for body in bodies}) if spatial else len(wraps) + 1,
        actuators=tuple(
            i
            for i in actuators
            if int(model.actuator_trntype[i]) == _TENDON_TRANSMISSION and int(model.actuator_trnid[i, 0]) == index
        ),
    )


def _read_chains(
    model: mujoco.MjModel, data: mujoco.MjData, moving: tuple[int, ...], length_m: float
) -> tuple[tuple[Chain, ...], int]:
    """Return the chains, longest first, and the largest number of turning points between a root and a leaf."""
    turning = [body for body in moving if any(kind in _TURNING for kind in _joint_types(model, body))]
    before = {body: _turning_parent(model, body, turning) for body in turning}
    after = {body: [child for child in turning if before[child] == body] for body in turning}
    chains, depth = [], dict.fromkeys([0, *turning], 0)
    for body in turning:
        parent = before[body]
        depth[body] = depth[parent] + (parent == 0 or not _together(data, model, parent, body, length_m))
        if parent == 0 or len(after[parent]) > 1:
            series = [body]
            while len(after[series[-1]]) == 1:
                series.append(after[series[-1]][0])
            chains.append(_make_chain(model, data, series, length_m))
    return tuple(sorted(chains, key=lambda chain: -len(chain.bodies))), max(depth.values())


def _turning_parent(model: mujoco.MjModel, body: int, turning: list[int]) -> int:
    """Return the nearest ancestor among the bodies in `turning`; 0 if there is none."""
    parent = int(model.body_parentid[body])
    while parent and parent not in turning:
        parent = int(model.body_parentid[parent])
    return parent


def _together(data: mujoco.MjData, model: mujoco.MjModel, parent: int, body: int, length_m: float) -> bool:
    gap = _anchor_m(model, data, body) - _anchor_m(model, data, parent)
    return bool(np.linalg.norm(gap) < SAME_POINT * length_m)


def _anchor_m(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> Vector:
    return np.array(data.xanchor[int(model.body_jntadr[body])])


def _make_chain(model: mujoco.MjModel, data: mujoco.MjData, series: list[int], length_m: float) -> Chain:
    bodies: list[int] = []
    joints: list[int] = []
    for body in series:
        if bodies and _together(data, model, bodies[-1], body, length_m):
            bodies.pop()
        bodies.append(body)
        first = int(model.body_jntadr[body])
        joints += [first + k for k, kind in enumerate(_joint_types(model, body)) if kind in _TURNING]
    anchors = np.array([_anchor_m(model, data, body) for body in bodies])
    return Chain(bodies=tuple(bodies), joints=tuple(joints), anchors_m=anchors)


def _dofs(model: mujoco.MjModel, chain: Chain) -> list[int]:
    sizes = {int(mujoco.mjtJoint.mjJNT_BALL): 3}
    return [
        int(model.jnt_dofadr[joint]) + k
        for joint in chain.joints
        for k in range(sizes.get(int(model.jnt_type[joint]), 1))
    ]
