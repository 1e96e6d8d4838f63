"""What can move in an environment: its joints with their ranges, what drives them, and how far they let a body go."""

from __future__ import annotations

import itertools
import math
from typing import Literal

import mujoco
import numpy as np

from aidsr.core.artifacts import Artifact, Vec3
from aidsr.mjcf.compile import load_mjcf
from aidsr.sandbox.isolated import isolated

JointKind = Literal["free", "ball", "slide", "hinge"]

_KINDS: tuple[JointKind, ...] = ("free", "ball", "slide", "hinge")
"""In the order of mjtJoint."""
_AXES: dict[JointKind, bool] = {"free": False, "ball": False, "slide": True, "hinge": True}
"""Which of them have one axis, and so one number and a range."""
_OF_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
"""What actuators act on that act on a joint."""
_PLACES = 73
"""Places of one joint that are tried: of a whole turn one each 5 deg. Our choice: a circle is found to 0.1 %."""
_MOST_PLACES = 20_000
"""Combinations of places that are tried for all joints of a body together. Our choice: a second."""


class JointFacts(Artifact):
    """A joint of an environment at the start of an episode."""

    name: str
    kind: JointKind
    body: str
    """The body that it moves."""
    low: float | None
    """Lower end of its range [rad or m]; None where it has none."""
    high: float | None
    now: float
    """Where it is [rad or m]; 0 for free and ball joints."""
    axis: Vec3
    """In world axes at the start, of length 1."""
    anchor_m: Vec3
    """A point on its axis, in world coordinates at the start [m]."""


class ActuatorFacts(Artifact):
    """An actuator of an environment."""

    name: str
    joint: str
    """What it drives; empty where that is no joint."""
    low: float | None
    """Lower end of its control range; None where it has none."""
    high: float | None


class Mechanism(Artifact):
    """All joints and actuators of an environment."""

    joints: tuple[JointFacts, ...]
    actuators: tuple[ActuatorFacts, ...]
    centers_m: dict[str, Vec3]
    """Centre of mass of each body with a name, in world coordinates at the start [m]."""
    parents: dict[str, str]
    """The body that carries each body with a name; empty where that has none."""

    def carrying(self, body: str) -> tuple[JointFacts, ...]:
        """Return the joints that move a body, the innermost first."""
        found: list[JointFacts] = []
        while body and body != "world":
            found += [joint for joint in self.joints if joint.body == body]
            body = self.parents.get(body, "")
        return tuple(found)


@isolated
def read_mechanism(mjcf: str) -> Mechanism:
    """Return what can move in an environment, or in a scene in it, read in an isolated process.

    Raises:
        MjcfError: It cannot be loaded.
        IsolationError: Reading it ran past its limits.
    """
    model = load_mjcf(mjcf).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    names = [model.body(body).name for body in range(model.nbody)]
    return Mechanism(
        joints=tuple(_joint(model, data, joint) for joint in range(model.njnt)),
        actuators=tuple(_actuator(model, actuator) for actuator in range(model.nu)),
        centers_m={name: _vector(data.xipos[body]) for body, name in enumerate(names) if name},
        parents={name: names[int(model.body_parentid[body])] for body, name in enumerate(names) if name and body},
    )


@isolated
def farthest_m(mjcf: str, body: str, direction: tuple[float, ...]) -> float:
    """Return how far the joints of an environment let a body's centre of mass go in a direction.

    Only ranges of joints bound it, nothing that stands in the way. Places of the joints are tried on a grid, so the
    result is the largest of many, not a bound.

    Args:
        mjcf: The environment, or a scene in it.
        body: Name of a body of it.
        direction: In world axes, of any length, (3,).

    Returns:
        The way [m]; infinite for what a free joint or a slide without a range carries that way.

    Raises:
        MjcfError: It cannot be loaded.
        IsolationError: It ran past its limits.
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
    each = max(2, min(_PLACES, int(_MOST_PLACES ** (1 / max(1, len(addresses))))))
    grids = [_places(model, joint, each) for joint in joints if _AXES[_kind(model, joint)]]
    start, most = data.xipos[index].copy(), 0.0
    for places in itertools.islice(itertools.product(*grids), _MOST_PLACES):
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
    now = float(model.qpos0[model.jnt_qposadr[joint]])
    low, high = model.jnt_range[joint] if model.jnt_limited[joint] else (now - math.pi, now + math.pi)
    return np.append(np.linspace(low, high, count), now)


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
    low, high = (float(end) for end in model.actuator_ctrlrange[actuator])
    limited = bool(model.actuator_ctrllimited[actuator])
    return ActuatorFacts(
        name=model.actuator(actuator).name,
        joint=model.joint(int(model.actuator_trnid[actuator, 0])).name if of_joint else "",
        low=low if limited else None,
        high=high if limited else None,
    )


def _vector(values: np.ndarray) -> Vec3:
    x, y, z = (float(value) for value in values)
    return x, y, z
