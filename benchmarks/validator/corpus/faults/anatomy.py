"""Limbs of a robot and the tendons along them, read from a specification and its compiled model."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from benchmarks.validator.corpus.faults.injection import UnsuitableError
from numpy.typing import NDArray

Array = NDArray[np.float64]
_TURNING = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_BALL))
_SITE = int(mujoco.mjtWrap.mjWRAP_SITE)
_TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)


@dataclass(frozen=True)
class Limb:
    """A chain of bodies with hinge or ball joints, from root to tip.

    Attributes:
        bodies: Ids of the bodies.
        anchors_m: Position of each body's joint in the world, (n, 3).
    """

    bodies: tuple[int, ...]
    anchors_m: Array

    @property
    def spacing_m(self) -> float:
        """Median distance between successive joints."""
        return float(np.median(np.linalg.norm(np.diff(self.anchors_m, axis=0), axis=1)))

    def direction(self, index: int) -> Array:
        """Return the unit vector along the limb at a body, in the world; `index` is the body's place in the limb."""
        after = min(index + 1, len(self.bodies) - 1)
        along = self.anchors_m[after] - self.anchors_m[after - 1]
        return np.asarray(along / np.linalg.norm(along))


@dataclass(frozen=True)
class Anatomy:
    """A robot's limbs and tendons.

    Attributes:
        routes: Site ids of every spatial tendon that runs over sites only, by tendon id.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    limbs: tuple[Limb, ...]
    routes: dict[int, tuple[int, ...]]

    def to_local(self, body: int, point: Array) -> Array:
        """Return a point of the world in the frame of a body."""
        return np.asarray((point - self.data.xpos[body]) @ self.data.xmat[body].reshape(3, 3))

    def half_width_m(self, body: int) -> float:
        """Return half the width of a body: the middle one of the three half sizes of its largest geom."""
        sizes = [
            np.sort(self.model.geom_aabb[g][3:]) for g in range(self.model.ngeom) if self.model.geom_bodyid[g] == body
        ]
        if not sizes:
            raise UnsuitableError("a body without geoms")
        return float(max(sizes, key=lambda size: float(size.prod()))[1])


def read_anatomy(spec: mujoco.MjSpec) -> Anatomy:
    """Return the limbs with at least three joints, longest first, and the routes of tendons."""
    model = spec.copy().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    limbs = []
    for leaf in range(1, model.nbody):
        if not (model.body_parentid == leaf).any():
            line, at = [], leaf
            while at:
                line.append(at)
                at = int(model.body_parentid[at])
            limb = _limb(model, data, line[::-1])
            if limb and len(limb.bodies) >= 3:
                limbs.append(limb)
    routes = {}
    for tendon in range(model.ntendon):
        wraps = range(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon])
        if all(int(model.wrap_type[k]) == _SITE for k in wraps):
            routes[tendon] = tuple(int(model.wrap_objid[k]) for k in wraps)
    return Anatomy(model, data, tuple(sorted(limbs, key=lambda limb: -len(limb.bodies))), routes)


def _limb(model: mujoco.MjModel, data: mujoco.MjData, line: list[int]) -> Limb | None:
    bodies, anchors = [], []
    for body in line:
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        if count and int(model.jnt_type[first]) in _TURNING:
            anchor = np.array(data.xanchor[first])
            if anchors and np.linalg.norm(anchor - anchors[-1]) < 1e-6:
                bodies[-1] = body
                continue
            bodies.append(body)
            anchors.append(anchor)
    return Limb(tuple(bodies), np.array(anchors)) if bodies else None


def first_of(limbs: tuple[Limb, ...]) -> Limb:
    """Return the longest limb."""
    if not limbs:
        raise UnsuitableError("a robot without a limb of three joints")
    return limbs[0]


def inner_joints(spec: mujoco.MjSpec) -> list[mujoco.MjsJoint]:
    """Return hinge and ball joints."""
    return [joint for joint in spec.joints if int(joint.type) in _TURNING]


def pull_actuators(spec: mujoco.MjSpec) -> list[mujoco.MjsActuator]:
    """Return actuators on tendons."""
    pulling = [actuator for actuator in spec.actuators if int(actuator.trntype) == _TENDON]
    if not pulling:
        raise UnsuitableError("a robot without tendon actuators")
    return pulling
