"""Which elements of a scene are the robot's and which the environment's."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

ROBOT_PREFIX = "robot/"
"""Scene assembly begins every name of the robot with this; a model without such names is all robot."""

WRAP_JOINT = int(mujoco.mjtWrap.mjWRAP_JOINT)
WRAP_SITE = int(mujoco.mjtWrap.mjWRAP_SITE)
WRAP_SURFACES = (int(mujoco.mjtWrap.mjWRAP_SPHERE), int(mujoco.mjtWrap.mjWRAP_CYLINDER))

_TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)
_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_BODY = int(mujoco.mjtTrn.mjTRN_BODY)


@dataclass(frozen=True)
class Ownership:
    """The robot's share of a model: by name where a part has one, else by the bodies it concerns.

    Attributes:
        bodies: All bodies of the robot, parents first.
        is_scene: Whether there is an environment beside the robot.
    """

    model: mujoco.MjModel
    bodies: tuple[int, ...]
    is_scene: bool

    def tendon(self, index: int) -> bool:
        """Whether a tendon is the robot's."""
        return self._decide(mujoco.mjtObj.mjOBJ_TENDON, index, tendon_bodies(self.model, index))

    def actuator(self, index: int) -> bool:
        """Whether an actuator is the robot's."""
        model, kind = self.model, int(self.model.actuator_trntype[index])
        target = int(model.actuator_trnid[index, 0])
        if kind == _TENDON:
            bodies = tendon_bodies(model, target)
        elif kind in _JOINT:
            bodies = [int(model.jnt_bodyid[target])]
        elif kind == _BODY:
            bodies = [target]
        else:
            bodies = [int(model.site_bodyid[target])]
        return self._decide(mujoco.mjtObj.mjOBJ_ACTUATOR, index, bodies)

    def sensor(self, index: int) -> bool:
        """Whether a sensor is the robot's own; the task's sensors in a scene have names without the prefix."""
        return self._decide(mujoco.mjtObj.mjOBJ_SENSOR, index, self._measured_bodies(index))

    def _measured_bodies(self, sensor: int) -> list[int]:
        """Bodies that a sensor measures something of."""
        model, target = self.model, int(self.model.sensor_objid[sensor])
        owners = {
            int(mujoco.mjtObj.mjOBJ_JOINT): model.jnt_bodyid,
            int(mujoco.mjtObj.mjOBJ_SITE): model.site_bodyid,
            int(mujoco.mjtObj.mjOBJ_GEOM): model.geom_bodyid,
        }
        kind = int(model.sensor_objtype[sensor])
        if kind in owners:
            return [int(owners[kind][target])]
        if kind in (int(mujoco.mjtObj.mjOBJ_BODY), int(mujoco.mjtObj.mjOBJ_XBODY)):
            return [target]
        if kind == int(mujoco.mjtObj.mjOBJ_TENDON):
            return tendon_bodies(model, target)
        if kind == int(mujoco.mjtObj.mjOBJ_ACTUATOR):
            return list(self.bodies[:1]) if self.actuator(target) else []
        return []

    def _decide(self, kind: mujoco.mjtObj, index: int, bodies: list[int]) -> bool:
        if not self.is_scene:
            return True
        name = mujoco.mj_id2name(self.model, kind, index)
        return name.startswith(ROBOT_PREFIX) if name else any(body in self.bodies for body in bodies)


def read_ownership(model: mujoco.MjModel) -> Ownership:
    """Return what of a compiled model is the robot."""
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body) or "" for body in range(model.nbody)]
    named = [name.startswith(ROBOT_PREFIX) for name in names]
    if not any(named):
        return Ownership(model, tuple(range(1, model.nbody)), is_scene=False)
    owned: list[int] = []
    for body in range(1, model.nbody):
        # an unnamed body inside the robot carries no prefix
        if named[body] or int(model.body_parentid[body]) in owned:
            owned.append(body)
    return Ownership(model, tuple(owned), is_scene=True)


def tendon_wraps(model: mujoco.MjModel, tendon: int) -> list[tuple[int, int]]:
    """(mjtWrap, object id) of everything a tendon runs along, in order."""
    first = int(model.tendon_adr[tendon])
    return [(int(model.wrap_type[k]), int(model.wrap_objid[k])) for k in range(first, first + model.tendon_num[tendon])]


def tendon_bodies(model: mujoco.MjModel, tendon: int) -> list[int]:
    """Bodies along a tendon in order, neighbours differing."""
    bodies: list[int] = []
    for kind, target in tendon_wraps(model, tendon):
        if kind == WRAP_SITE:
            body = int(model.site_bodyid[target])
        elif kind in WRAP_SURFACES:
            body = int(model.geom_bodyid[target])
        elif kind == WRAP_JOINT:
            body = int(model.jnt_bodyid[target])
        else:
            continue
        if not bodies or bodies[-1] != body:
            bodies.append(body)
    return bodies
