"""Gaps between parts at each joint, with their largest bending angles, and limbs as joints in series."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from aidsr.fabrication.anatomy import Anatomy, Cable, Guide, Joint, Shape, Vector

_LEAST_HALF_GAP_MM = 1.0
"""Smallest distance of a part's face from the joint's anchor. Our choice: faces of a gap narrower than 2 mm touch after
little bending."""

_SHARE_OF_SEGMENT = 0.25
"""Half gap / distance to the next joint, where no cable's guide defines the end of a part. docs/physics.md places
guides there."""

_LEAST_RIGID_MM = 4.0
"""Shortest rigid portion of a part between two gaps, which has to hold a rod. Our choice."""

_LONGEST_HALF_GAP_MM = 40.0
_ANGLES = 65
"""Number of angles at which the moments of springs and cables are compared. Our choice: the angle of balance is right
to 0.1 %."""

STRAIGHT = 0.9995
"""Cosine above which a limb counts as straight at rest, and two axes as parallel."""


@dataclass(frozen=True)
class Gap:
    """The gap between two parts at a joint.

    Attributes:
        joint: Index of the joint in the anatomy.
        anchor: Centre of rotation (3,) [mm].
        before: Unit vector along the limb in the parent part, from parent to child (3,).
        after: Unit vector along the limb in the child part, from parent to child (3,).
        before_mm: Distance from the anchor back to the parent's face.
        after_mm: Distance from the anchor to the child's face.
        radius_mm: Radius of the limb at the joint.
        reach_mm: Largest distance of a cable from the limb's axis at the joint; 0 without cables.
        touch_rad: Angle at which the two parts touch, which is the only mechanical stop of the built joint.
        bend_rad: Largest angle to which the cables can pull the joint, at most `touch_rad`.
    """

    joint: int
    anchor: Vector
    before: Vector
    after: Vector
    before_mm: float
    after_mm: float
    radius_mm: float
    reach_mm: float
    touch_rad: float
    bend_rad: float

    @property
    def length_mm(self) -> float:
        """Length of the gap from face to face."""
        return self.before_mm + self.after_mm

    @property
    def straight(self) -> bool:
        """Whether the limb runs straight through the joint at rest."""
        return float(self.before @ self.after) > STRAIGHT


class Skeleton:
    """The gaps and limbs of a robot.

    Args:
        anatomy: The robot.
        wall_mm: Outer radius of the wall around each cable.
    """

    def __init__(self, anatomy: Anatomy, wall_mm: float = 0.0) -> None:
        self.anatomy, self.wall_mm = anatomy, wall_mm
        self.anchors = [np.array(joint.anchor_mm) for joint in anatomy.joints]
        self._out: dict[int, list[int]] = {}
        self._into: dict[int, int] = {}
        for index, joint in enumerate(anatomy.joints):
            self._out.setdefault(joint.parent, []).append(index)
            self._into.setdefault(joint.child, index)

    @cached_property
    def gaps(self) -> tuple[Gap, ...]:
        """Gap of each joint, in the order of the anatomy."""
        return tuple(self._gap(index) for index in range(len(self.anatomy.joints)))

    @cached_property
    def limbs(self) -> tuple[tuple[int, ...], ...]:
        """Indices of the joints of each limb, in series from its root outwards."""
        starts = [joint for joint in range(len(self.anchors)) if self._before(joint) is None]
        return tuple(tuple(self._onward(joint)) for joint in starts)

    def spine(self, part: int) -> tuple[Vector, Vector] | None:
        """Return a point on the limb's axis through a part and its direction, or None for a part without joints."""
        into, out = self._into.get(part), self._out.get(part, [])
        if into is not None and not (len(out) > 1 and self.anatomy.parts[part].held):
            return self.anchors[into], self.gaps[into].after
        return (self.anchors[out[0]], self.gaps[out[0]].before) if out else None

    def crossings(self, joint: int) -> Iterator[tuple[Guide, Guide]]:
        """Yield for each cable that crosses a joint the last guide on either side, the parent's first."""
        for cable in self.anatomy.cables:
            yield from self._crossings_of(cable, self.anatomy.joints[joint])

    def _crossings_of(self, cable: Cable, joint: Joint) -> Iterator[tuple[Guide, Guide]]:
        for one, other in pairwise(cable.guides):
            if (one.part, other.part) == (joint.parent, joint.child):
                yield one, other
            elif (other.part, one.part) == (joint.parent, joint.child):
                yield other, one

    def _before(self, joint: int) -> int | None:
        """Return the previous joint in the limb of a joint; None for the first."""
        parent = self.anatomy.joints[joint].parent
        into = self._into.get(parent)
        alone = len(self._out.get(parent, [])) == 1
        return into if alone and into is not None and not self._closes_a_loop(parent) else None

    def _closes_a_loop(self, part: int) -> bool:
        """Whether a part is the one at which a closed ring of parts is taken to begin."""
        first = self._out[part][0]
        return self.anatomy.joints[first].parent == part and part == min(self._ring(part), default=-1)

    def _ring(self, part: int) -> list[int]:
        seen, here = [], part
        while here not in seen and here in self._into:
            seen.append(here)
            here = self.anatomy.joints[self._into[here]].parent
        return seen if here == part else []

    def _onward(self, joint: int) -> Iterator[int]:
        while True:
            yield joint
            following = [j for j in self._out.get(self.anatomy.joints[joint].child, []) if self._before(j) == joint]
            if not following:
                return
            joint = following[0]

    def _gap(self, index: int) -> Gap:
        joint, anchor = self.anatomy.joints[index], self.anchors[index]
        before, after = self._axes(index)
        crossings = list(self.crossings(index))
        behind = [float((anchor - np.array(one.position_mm)) @ before) for one, _ in crossings]
        ahead = [float((np.array(other.position_mm) - anchor) @ after) for _, other in crossings]
        offsets = [_distance(np.array(other.position_mm), anchor, after) for _, other in crossings]
        half_mm = _half_gap([*behind, *ahead], self._room(index))  # the same on both sides: hinges bend in the middle
        radius_mm, reach_mm = self._radius(joint, anchor, after), max(offsets, default=0.0)
        touch_rad = _touching_rad(2 * half_mm, max(radius_mm, reach_mm + self.wall_mm))
        return Gap(
            joint=index,
            anchor=anchor,
            before=before,
            after=after,
            before_mm=half_mm,
            after_mm=half_mm,
            radius_mm=radius_mm,
            reach_mm=reach_mm,
            touch_rad=touch_rad,
            bend_rad=self._pulled_rad(index, touch_rad),
        )

    def _axes(self, index: int) -> tuple[Vector, Vector]:
        """Return the directions of the limb in the parent and in the child of a joint."""
        joint, anchor = self.anatomy.joints[index], self.anchors[index]
        following = self._out.get(joint.child, [])
        if len(following) == 1 and np.linalg.norm(self.anchors[following[0]] - anchor) > _LEAST_HALF_GAP_MM:
            after = unit(self.anchors[following[0]] - anchor)
        else:
            after = self._along(joint.child, anchor, joint)
        into = self._into.get(joint.parent)
        alone = len(self._out[joint.parent]) == 1
        if into is not None and alone and np.linalg.norm(anchor - self.anchors[into]) > _LEAST_HALF_GAP_MM:
            return unit(anchor - self.anchors[into]), after
        return after, after

    def _along(self, part: int, anchor: Vector, joint: Joint) -> Vector:
        """Return the direction in which the last part of a limb extends from its joint."""
        guides = [np.array(other.position_mm) for _, other in self.crossings(self.anatomy.joints.index(joint))]
        middles = [np.array(shape.position_mm) for shape in self.anatomy.parts[part].shapes]
        ends = [middle for middle in middles if np.linalg.norm(middle - anchor) > _LEAST_HALF_GAP_MM]
        ahead = unit(np.mean(ends, axis=0) - anchor) if ends else unit(np.mean(guides, axis=0) - anchor)
        for shape in self.anatomy.parts[part].shapes:
            axis = np.array(shape.rotation).reshape(3, 3)[:, 2]
            if shape.kind in ("capsule", "cylinder") and _distance(anchor, np.array(shape.position_mm), axis) < 0.5:
                return axis if axis @ ahead > 0 else -axis
        return ahead

    def _room(self, index: int) -> float:
        """Return the largest distance of a gap's faces from the anchor, limited by the nearest joint [mm]."""
        joint, anchor = self.anatomy.joints[index], self.anchors[index]
        others = self._out.get(joint.child, []) + [j for j in (self._into.get(joint.parent),) if j is not None]
        apart = [float(np.linalg.norm(self.anchors[other] - anchor)) for other in others if other != index]
        nearest = min((distance for distance in apart if distance > 0), default=4 * _LONGEST_HALF_GAP_MM)
        return max(_LEAST_HALF_GAP_MM, min((nearest - _LEAST_RIGID_MM) / 2, _SHARE_OF_SEGMENT * 2 * nearest))

    def _radius(self, joint: Joint, anchor: Vector, axis: Vector) -> float:
        """Return the radius of the limb at a joint [mm].

        It is the radius of a capsule or cylinder along the limb's axis; where there is none, the smallest dimension of
        the child's shapes.
        """
        radii = [
            shape.size_mm[0]
            for part in (joint.child, joint.parent)
            for shape in self.anatomy.parts[part].shapes
            if part >= 0 and _is_along(shape, anchor, axis)
        ]
        if radii:
            return radii[0]
        sizes = [min(size for size in shape.size_mm if size > 0) for shape in self.anatomy.parts[joint.child].shapes]
        return min(sizes, default=5.0)

    def _pulled_rad(self, index: int, touch_rad: float) -> float:
        """Return the largest angle of a joint under the largest tensions, at most the angle of touch [rad].

        It is the first angle at which the spring balances all cables that pull in one direction. The angle of touch is
        returned where tensions or stiffness are not known.

        Source: balance of moments, k phi = sum of T r(phi), with the moment arms of docs/physics.md, which grow with
        the angle.
        """
        joint = self.anatomy.joints[index]
        stiffness, angles = min(joint.stiffness_n_m_rad), np.linspace(0.0, touch_rad, _ANGLES)
        cables = [cable for cable in self.anatomy.cables if cable.actuator and {*joint.names} & {*cable.torques_mm}]
        known = np.isfinite([cable.largest_pull_n for cable in cables]).all()
        if stiffness <= 0 or joint.kind != "hinge" or not known:
            return touch_rad
        turns = np.linspace(0, 2 * math.pi, 36, endpoint=False)
        wheel = np.stack([np.cos(turns), np.sin(turns), *([np.zeros(36)] * (len(joint.names) - 2))], axis=1)
        wheel = wheel[:, : len(joint.names)] if len(joint.names) > 1 else np.array([[1.0], [-1.0]])
        largest = 0.0
        for direction in wheel:
            pulls = [cable.largest_pull_n * self._arm_mm(index, cable, direction, angles) / 1000.0 for cable in cables]
            left = np.maximum(np.reshape(pulls, (-1, _ANGLES)), 0.0).sum(axis=0) - stiffness * angles
            largest = max(largest, _first_zero(angles, left))
        return largest

    def _arm_mm(self, index: int, cable: Cable, direction: Vector, angles: Vector) -> Vector:
        """Return the moment arm of a cable at a joint that is bent in a direction (n,) [mm].

        A cable runs straight from the last guide before the joint to the first one behind it. Where one of the two is
        in a part that is not beside the joint, the arm in the initial pose is returned.

        Args:
            index: Index of the joint.
            cable: The cable.
            direction: Components of the axis of rotation along the joint's axes (1,) or (2,).
            angles: Angles of the joint (n,) [rad].
        """
        joint, anchor = self.anatomy.joints[index], self.anchors[index]
        crossings = list(self._crossings_of(cable, joint))
        if not crossings:
            at_rest = [cable.torques_mm.get(name, 0.0) for name in joint.names]
            return np.full(len(angles), float(np.dot(at_rest, direction)))
        axis = unit(direction @ np.array(joint.axes))
        cos, sin = np.cos(angles)[:, None], np.sin(angles)[:, None]
        arm = np.zeros(len(angles))
        for one, other in crossings:
            fixed, moved = np.array(one.position_mm) - anchor, np.array(other.position_mm) - anchor
            turned = cos * moved + sin * np.cross(axis, moved) + (1 - cos) * (axis @ moved) * axis
            apart_mm = np.linalg.norm(fixed - turned, axis=1)[:, None]
            pull = (fixed - turned) / np.maximum(apart_mm, 1e-9)  # no pull where the two guides meet
            arm += np.cross(turned, pull) @ axis
        return arm


def _first_zero(angles: Vector, left: Vector) -> float:
    """Return the first angle at which a moment vanishes, interpolated linearly; the last angle if it does nowhere."""
    over = np.flatnonzero(left <= 0)
    if not len(over):
        return float(angles[-1])
    after = int(over[0])
    if after == 0:
        return float(angles[0])
    share = left[after - 1] / (left[after - 1] - left[after])
    return float(angles[after - 1] + share * (angles[after] - angles[after - 1]))


def unit(vector: Vector) -> Vector:
    """Return a vector of length 1 in the same direction."""
    return np.asarray(vector / np.linalg.norm(vector))


def _half_gap(guides: list[float], room_mm: float) -> float:
    """Return the distance from the anchor to a part's face: at the nearest guide, where the cable leaves the part [mm].

    Args:
        guides: Distances of the guides from the anchor along the limb [mm].
        room_mm: Largest allowed distance; also used where there are no guides.
    """
    asked = min(guides, default=room_mm)
    return float(np.clip(asked, _LEAST_HALF_GAP_MM, min(room_mm, _LONGEST_HALF_GAP_MM)))


def _touching_rad(gap_mm: float, outside_mm: float) -> float:
    """Return the angle at which the faces of a gap touch [rad].

    Source: two flat faces of radius R, each at half a gap g from the middle of the hinge, touch at 2 atan(g / 2 R).
    """
    return 2 * math.atan(gap_mm / 2 / outside_mm)


def _distance(point: Vector, on_axis: Vector, axis: Vector) -> float:
    away = point - on_axis
    return float(np.linalg.norm(away - (away @ axis) * axis))


def _is_along(shape: Shape, anchor: Vector, axis: Vector) -> bool:
    own = np.array(shape.rotation).reshape(3, 3)[:, 2]
    centred = _distance(np.array(shape.position_mm), anchor, axis) < shape.size_mm[0] / 2
    return shape.kind in ("capsule", "cylinder") and abs(float(own @ axis)) > 0.9 and centred
