"""Joints and actuators of an environment, with their ranges, and how far the joints let a body move."""

from __future__ import annotations

import itertools
import math
from typing import Literal

import mujoco
import numpy as np

from aidsr.core.artifacts import Artifact, Vec3
from aidsr.mjcf.compile import load_mjcf
from aidsr.sandbox.isolated import isolated
from aidsr.sim.actuator_force import control_of

JointKind = Literal["free", "ball", "slide", "hinge"]

_KINDS: tuple[JointKind, ...] = ("free", "ball", "slide", "hinge")
"""Kinds of joints in the order of mjtJoint."""
_AXES: dict[JointKind, bool] = {"free": False, "ball": False, "slide": True, "hinge": True}
"""Whether a joint of this kind has a single axis, and therefore a scalar position and a range."""
_OF_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
"""Transmission types of actuators that act on a joint."""
_PLACES = 73
"""Positions of one joint that are tried, one every 5 deg of a full turn. Our choice: the extent of a circular path is
then accurate to 0.1 %."""
_MOST_PLACES = 20_000
"""Combinations of joint positions that are tried for one body. Our choice: this takes about a second."""


class JointFacts(Artifact):
    """A joint of an environment at the start of an episode."""

    name: str
    kind: JointKind
    body: str
    """Name of the body that it moves."""
    low: float | None
    """Lower end of its range [rad or m]; None if it has no range."""
    high: float | None
    """Upper end of its range [rad or m]; None if it has no range."""
    now: float
    """Initial position [rad or m]; 0 for free and ball joints."""
    axis: Vec3
    """Unit vector along its axis in world coordinates at the start."""
    anchor_m: Vec3
    """Point on its axis in world coordinates at the start [m]."""


class ActuatorFacts(Artifact):
    """An actuator of an environment."""

    name: str
    joint: str
    """Name of the joint that it drives; empty if it does not act on a joint."""
    low: float | None
    """Lower end of its control range; None if it has no control range."""
    high: float | None
    """Upper end of its control range; None if it has no control range."""


class Mechanism(Artifact):
    """All joints and actuators of an environment."""

    joints: tuple[JointFacts, ...]
    actuators: tuple[ActuatorFacts, ...]
    centers_m: dict[str, Vec3]
    """Centre of mass of each named body, in world coordinates at the start [m]."""
    parents: dict[str, str]
    """Name of the parent body of each named body; empty if the parent has no name."""

    def carrying(self, body: str) -> tuple[JointFacts, ...]:
        """Return the joints that move a body, those of the body itself first, then those of its ancestors."""
        found: list[JointFacts] = []
        while body and body != "world":
            found += [joint for joint in self.joints if joint.body == body]
            body = self.parents.get(body, "")
        return tuple(found)


@isolated
def read_mechanism(mjcf: str) -> Mechanism:
    """Return the joints and actuators of an environment or a scene, read in an isolated process.

    Raises:
        MjcfError: The MJCF cannot be loaded.
        IsolationError: Reading it exceeded its limits of time or memory.
    """
    model = load_mjcf(mjcf).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    names = [model.body(body).name for body in range(model.nbody)]
    return Mechanism(
        joints=tuple(_joint(model, data, joint) for joint in range(model.njnt)),
        actuators=tuple(_actuator(model, actuator) for actuator in range(model.nactuator)),
        centers_m={name: _vector(data.xipos[body]) for body, name in enumerate(names) if name},
        parents={name: names[int(model.body_parentid[body])] for body, name in enumerate(names) if name and body},
    )


@isolated
def farthest_m(mjcf: str, body: str, direction: tuple[float, ...]) -> float:
    """Return how far the joints of an environment let a body's centre of mass move in a direction [m].

    Only joint ranges are considered, not obstacles. The joint positions are sampled on a grid that always has the ends
    of all ranges, so the result is the largest sampled value, not an upper bound.

    Args:
        mjcf: MJCF of an environment or a scene.
        body: Name of the body.
        direction: Direction in world axes, of any length, (3,).

    Returns:
        The distance [m]; infinite if the body is moved by a free or ball joint, or by a slide without a range that is
        not perpendicular to the direction, or by more joints than can be sampled (14).

    Raises:
        MjcfError: The MJCF cannot be loaded.
        IsolationError: The calculation exceeded its limits of time or memory.
    """
    model = load_mjcf(mjcf).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    along = np.array(direction) / np.linalg.norm(direction)
    index = model.body(body).id
    joints = _carriers(model, index)
    if any(_boundless(model, data, joint, along) for joint in joints):
        return math.inf
    addresses = [int(model.jnt_qposadr[joint]) for joint in joints if _AXES[_kind(model, joint)]]
    each = min(_PLACES + 1, int(_MOST_PLACES ** (1 / max(1, len(addresses))) + 1e-9))
    if each < 2:
        return math.inf
    grids = [_places(model, joint, each) for joint in joints if _AXES[_kind(model, joint)]]
    start, most = data.xipos[index].copy(), 0.0
    for places in itertools.product(*grids):
        data.qpos[addresses] = places
        mujoco.mj_kinematics(model, data)
        most = max(most, float((data.xipos[index] - start) @ along))
    return most


def _carriers(model: mujoco.MjModel, body: int) -> list[int]:
    found: list[int] = []
    while body:
        first = int(model.body_jntadr[body])
        found += range(first, first + int(model.body_jntnum[body])) if first >= 0 else ()
        body = int(model.body_parentid[body])
    return found


def _boundless(model: mujoco.MjModel, data: mujoco.MjData, joint: int, along: np.ndarray) -> bool:
    kind = _kind(model, joint)
    if kind == "slide":
        return not model.jnt_limited[joint] and abs(float(data.xaxis[joint] @ along)) > 1e-6
    return kind in ("free", "ball")


def _places(model: mujoco.MjModel, joint: int, count: int) -> np.ndarray:
    """Return positions of a joint: the ends of its range, and the present one where there are more than two."""
    now = float(model.qpos0[model.jnt_qposadr[joint]])
    low, high = model.jnt_range[joint] if model.jnt_limited[joint] else (now - math.pi, now + math.pi)
    return np.linspace(low, high, 2) if count == 2 else np.append(np.linspace(low, high, count - 1), now)


def _kind(model: mujoco.MjModel, joint: int) -> JointKind:
    return _KINDS[int(model.jnt_type[joint])]


def _joint(model: mujoco.MjModel, data: mujoco.MjData, joint: int) -> JointFacts:
    kind = _kind(model, joint)
    low, high = (float(end) for end in model.jnt_range[joint])
    limited = bool(model.jnt_limited[joint]) and _AXES[kind]
    return JointFacts(
        name=model.joint(joint).name,
        kind=kind,
        body=model.body(model.jnt_bodyid[joint]).name,
        low=low if limited else None,
        high=high if limited else None,
        now=float(model.qpos0[model.jnt_qposadr[joint]]) if _AXES[kind] else 0.0,
        axis=_vector(data.xaxis[joint]),
        anchor_m=_vector(data.xanchor[joint]),
    )


def _actuator(model: mujoco.MjModel, actuator: int) -> ActuatorFacts:
    of_joint = int(model.actuator_trntype[actuator]) in _OF_JOINT
    control = control_of(model, actuator)
    low, high = (float(end) for end in model.actuator_ctrlrange[control])
    limited = bool(model.actuator_ctrllimited[control])
    return ActuatorFacts(
        name=model.actuator(actuator).name,
        joint=model.joint(int(model.actuator_trnid[actuator, 0])).name if of_joint else "",
        low=low if limited else None,
        high=high if limited else None,
    )


def _vector(values: np.ndarray) -> Vec3:
    x, y, z = (float(value) for value in values)
    return x, y, z
