"""A chain of a compiled robot as an elastic limb: the bounds of its segments and their stiffness."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.extent import half_width_m
from aidsr.sim.structure import Chain, name_of

Vector = NDArray[np.float64]

_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)
_BALL = int(mujoco.mjtJoint.mjJNT_BALL)
_CAPSULE_LIKE = (int(mujoco.mjtGeom.mjGEOM_CAPSULE), int(mujoco.mjtGeom.mjGEOM_CYLINDER))

_FEWEST = 3
"""Fewest turning points of an elastic rod; a limb with fewer is a linkage."""
_MOST_DOFS = 120
"""Most bending degrees of freedom of a limb that is checked. Our choice: the check then takes about a minute."""
_STRAIGHT_COSINE = math.cos(math.radians(2.0))
"""Cosine of the largest bend between neighbouring segments at rest of a straight limb. Our choice: a rod that is curved
at rest needs another theory; two degrees is an inaccuracy of written coordinates."""
_PARALLEL = 0.99
"""Cosine above which two axes count as parallel. Our choice: 8 degrees."""
_MIDDLE_REACH = 0.75
"""Reach of the last link / distance between the last two joints, below which joints are in the middles of segments
(ideal value 1/2) and above which they are at the starts (ideal value 1)."""
_SNAP = 0.2
"""Largest distance / segment length between the end of the last geom and the end of the last segment. Our choice: at
joints, geoms leave gaps of up to a fifth of a segment."""
_EVEN = 0.02
"""Relative difference between the distances of joints up to which segments have equal lengths."""


class LimbError(Exception):
    """Raised if a chain does not qualify as an elastic rod; the message gives the reason."""


@dataclass(frozen=True)
class Limb:
    """One limb in the pose in which its springs are at rest.

    Attributes:
        name: Names of its first and last body.
        bodies: Id of the body that each turning point moves, (n,).
        axis: Unit axis about which the limb is bent in the comparisons, world.
        along: Unit direction from the clamp to the tip, world.
        clamp_m: Position of the start of the rod, world [m].
        turn_directions: Velocity of all degrees of freedom for a unit turn of each turning point about `axis`, (n, nv).
        bending_dofs: Indices of the degrees of freedom that bend the limb about any axis.
        joints_at: Whether joints are in the middles or at the starts of segments.
        clamp_doubled: Whether joints are at the starts and the first has twice the stiffness, because it represents
            half a segment.
        segment_m: Length of each segment, (n,) [m].
        stiffness_n_m_rad: Stiffness of each turning point about `axis`, (n,).
        radius_m: Median half thickness of the links [m].
    """

    name: str
    bodies: tuple[int, ...]
    axis: Vector
    along: Vector
    clamp_m: Vector
    turn_directions: Vector
    bending_dofs: tuple[int, ...]
    joints_at: Literal["middles", "starts"]
    clamp_doubled: bool
    segment_m: Vector
    stiffness_n_m_rad: Vector
    radius_m: float

    @property
    def length_m(self) -> float:
        """Length of the limb from the clamp to the tip [m]."""
        return float(self.segment_m.sum())

    @property
    def end_m(self) -> Vector:
        """Position of the end of the rod, world [m]."""
        return np.asarray(self.clamp_m + self.length_m * self.along)

    @property
    def transverse(self) -> Vector:
        """Unit direction in which a positive turn about `axis` moves the tip, world."""
        return np.cross(self.axis, self.along)

    @property
    def joint_m(self) -> Vector:
        """Distance of each turning point from the clamp, (n,) [m]."""
        starts = np.concatenate([[0.0], np.cumsum(self.segment_m)[:-1]])
        return np.asarray(starts + (self.segment_m / 2.0 if self.joints_at == "middles" else 0.0))


def unloaded_pose(model: mujoco.MjModel) -> mujoco.MjData:
    """Return data in the pose in which all joint springs are at rest."""
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos_spring
    mujoco.mj_forward(model, data)
    return data


def read_limb(model: mujoco.MjModel, chain: Chain) -> Limb:
    """Return a chain as an elastic limb.

    Raises:
        LimbError: The chain has too few joints or too many degrees of freedom, is curved at rest, or has joints without
            stiffness or at uneven distances.
    """
    data = unloaded_pose(model)
    along = _direction(data, model, chain)
    axis = _bending_axis(model, data, chain, along)
    points = _turning_points(model, data, chain, axis)
    if len(points) < _FEWEST:
        raise LimbError(f"only {len(points)} of its joints turn about one axis across it")
    anchors = np.array([data.xanchor[joint] for joint, _ in points])
    bending_dofs = _bending_dofs(model, data, chain, along)
    if len(bending_dofs) > _MOST_DOFS:
        raise LimbError(f"it can bend in {len(bending_dofs)} ways, and at most {_MOST_DOFS} are followed")
    gaps = np.diff(anchors @ along)
    bodies = tuple(int(model.jnt_bodyid[joint]) for joint, _ in points)
    reach = _reach_m(model, data, bodies, anchors[-1], along, float(gaps[-1]))
    joints_at: Literal["middles", "starts"] = "middles" if reach < _MIDDLE_REACH * gaps[-1] else "starts"
    segments = _segments(gaps, reach, joints_at)
    stiffness = np.array([float(np.atleast_1d(model.jnt_stiffness[joint])[0]) for joint, _ in points])
    if (stiffness <= 0).any():
        raise LimbError("it has joints without stiffness, so it is no elastic rod")
    doubled = joints_at == "starts" and _is_doubled(stiffness, segments)
    clamp = anchors[0] - (segments[0] / 2.0 if joints_at == "middles" else 0.0) * along
    names = [name_of(model, mujoco.mjtObj.mjOBJ_BODY, body) for body in (bodies[0], bodies[-1])]
    return Limb(
        name=" to ".join(names),
        bodies=bodies,
        axis=axis,
        along=along,
        clamp_m=clamp,
        turn_directions=np.array([row for _, row in points]),
        bending_dofs=bending_dofs,
        joints_at=joints_at,
        clamp_doubled=doubled,
        segment_m=segments,
        stiffness_n_m_rad=stiffness,
        radius_m=float(np.median([_radius_m(model, body) for body in bodies])),
    )


def _direction(data: mujoco.MjData, model: mujoco.MjModel, chain: Chain) -> Vector:
    if len(chain.bodies) < _FEWEST:
        raise LimbError(f"it has {len(chain.bodies)} joints in series, and a rod needs {_FEWEST}")
    anchors = np.array([data.xanchor[int(model.body_jntadr[body])] for body in chain.bodies])
    steps = np.diff(anchors, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    if (steps[1:] * steps[:-1]).sum(axis=1).min() < _STRAIGHT_COSINE:
        raise LimbError("it is curved at rest")
    line = anchors[-1] - anchors[0]
    return np.asarray(line / np.linalg.norm(line))


def _is_bending(model: mujoco.MjModel, data: mujoco.MjData, joint: int, along: Vector) -> bool:
    """Return whether a joint bends a limb instead of twisting it."""
    return int(model.jnt_type[joint]) == _BALL or abs(float(data.xaxis[joint] @ along)) < math.sqrt(0.5)


def _bending_axis(model: mujoco.MjModel, data: mujoco.MjData, chain: Chain, along: Vector) -> Vector:
    """Return the unit axis across the limb about which most of its joints can turn."""
    hinges = [
        joint
        for joint in chain.joints
        if int(model.jnt_type[joint]) == _HINGE and _is_bending(model, data, joint, along)
    ]
    if hinges:
        axes = np.array([data.xaxis[joint] for joint in hinges])
        axis = axes[int(np.argmax((np.abs(axes @ axes.T) > _PARALLEL).sum(axis=1)))]
    else:
        axis = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    across = axis - (axis @ along) * along
    return np.asarray(across / np.linalg.norm(across))


def _turning_points(model: mujoco.MjModel, data: mujoco.MjData, chain: Chain, axis: Vector) -> list[tuple[int, Vector]]:
    """Return the joints that can turn about an axis, each with the velocities (nv,) of a unit turn about it."""
    points = []
    for joint in chain.joints:
        first, speeds = int(model.jnt_dofadr[joint]), np.zeros(model.nv)
        if int(model.jnt_type[joint]) == _BALL:
            # the velocity of a ball joint is in the frame of its body
            speeds[first : first + 3] = data.xmat[int(model.jnt_bodyid[joint])].reshape(3, 3).T @ axis
            points.append((joint, speeds))
        elif abs(cosine := float(data.xaxis[joint] @ axis)) > _PARALLEL:
            speeds[first] = math.copysign(1.0, cosine)
            points.append((joint, speeds))
    return points


def _bending_dofs(model: mujoco.MjModel, data: mujoco.MjData, chain: Chain, along: Vector) -> tuple[int, ...]:
    dofs: list[int] = []
    for joint in chain.joints:
        if _is_bending(model, data, joint, along):
            first = int(model.jnt_dofadr[joint])
            dofs += range(first, first + (3 if int(model.jnt_type[joint]) == _BALL else 1))
    return tuple(dofs)


def _reach_m(
    model: mujoco.MjModel, data: mujoco.MjData, bodies: tuple[int, ...], joint_m: Vector, along: Vector, gap_m: float
) -> float:
    """Return the distance that the last link extends beyond its joint, at most `gap_m` [m].

    A geom thicker than the limb is a tool and not part of the limb. If no geom of the last link looks like the rest of
    the limb, the last link counts as half a segment.
    """
    width = _radius_m(model, bodies[-2])
    reach = 0.0
    for geom in _geoms(model, bodies[-1]):
        size, kind = model.geom_size[geom], int(model.geom_type[geom])
        turned = abs(float(data.geom_xmat[geom].reshape(3, 3)[:, 2] @ along))
        if kind in _CAPSULE_LIKE and turned > _PARALLEL and 0.5 * width <= size[0] <= 1.1 * width:
            reach = max(reach, float((data.geom_xpos[geom] - joint_m) @ along) + float(size[1]))
    if reach <= 0.0:
        return gap_m / 2.0
    return min(reach, gap_m)


def _segments(gaps: Vector, reach: float, joints_at: Literal["middles", "starts"]) -> Vector:
    """Return the lengths of the segments, computed from the distances between joints and the reach of the last link.

    Raises:
        LimbError: Joints in the middles of segments are at uneven distances.
    """
    last = float(gaps[-1])
    even = float(gaps.max() - gaps.min()) <= _EVEN * last
    whole = last / 2.0 if joints_at == "middles" else last
    if even and abs(reach - whole) <= _SNAP * last:
        reach = whole
    if joints_at == "starts":
        return np.append(gaps, reach)
    lengths = [2.0 * reach]
    for gap in gaps[::-1]:
        lengths.append(2.0 * float(gap) - lengths[-1])
    if min(lengths) < 0.2 * max(lengths):
        raise LimbError("its joints are at uneven distances, neither in the middles nor at the starts of segments")
    return np.array(lengths[::-1])


def _is_doubled(stiffness: Vector, segments: Vector) -> bool:
    """Return whether the first joint represents half a segment: it has twice the next one's stiffness x length."""
    ratio = stiffness[0] * segments[0] / (stiffness[1] * segments[1])
    return bool(1.8 < ratio < 2.2)


def _geoms(model: mujoco.MjModel, body: int) -> range:
    first = int(model.body_geomadr[body])
    return range(first, first + int(model.body_geomnum[body])) if model.body_geomnum[body] else range(0)


def _radius_m(model: mujoco.MjModel, body: int) -> float:
    """Return the half thickness of a link [m]: the smallest half width of its largest geom."""
    sizes = [(float(model.geom_rbound[geom]), half_width_m(model, geom)) for geom in _geoms(model, body)]
    return max(sizes, default=(0.0, 0.0))[1]
