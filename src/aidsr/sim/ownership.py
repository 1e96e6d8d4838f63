"""Assignment of the elements of a scene to the robot or to the environment."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco

from aidsr.mjcf.names import ROBOT_PREFIX

WRAP_JOINT = int(mujoco.mjtWrap.mjWRAP_JOINT)
WRAP_SITE = int(mujoco.mjtWrap.mjWRAP_SITE)
WRAP_SURFACES = (int(mujoco.mjtWrap.mjWRAP_SPHERE), int(mujoco.mjtWrap.mjWRAP_CYLINDER))

_TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)
_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_BODY = int(mujoco.mjtTrn.mjTRN_BODY)
_JOINING = (int(mujoco.mjtEq.mjEQ_CONNECT), int(mujoco.mjtEq.mjEQ_WELD))


@dataclass(frozen=True)
class Ownership:
    """The elements of a model that belong to the robot.

    In a scene, named elements are assigned by their name, and unnamed ones by the bodies they concern. In a model of a
    robot alone, elements are assigned by the bodies they concern.

    Attributes:
        model: Compiled model.
        bodies: All bodies of the robot, parents first, without loose rigid objects beside it.
        is_scene: Whether the model contains an environment.
    """

    model: mujoco.MjModel
    bodies: tuple[int, ...]
    is_scene: bool

    def tendon(self, index: int) -> bool:
        """Return whether a tendon belongs to the robot."""
        return self._decide(mujoco.mjtObj.mjOBJ_TENDON, index, tendon_bodies(self.model, index))

    def actuator(self, index: int) -> bool:
        """Return whether an actuator belongs to the robot."""
        return self._decide(mujoco.mjtObj.mjOBJ_ACTUATOR, index, _actuated_bodies(self.model, index))

    def sensor(self, index: int) -> bool:
        """Return whether a sensor belongs to the robot; a task's sensors in a scene have names without the prefix."""
        return self._decide(mujoco.mjtObj.mjOBJ_SENSOR, index, self._measured_bodies(index))

    def _measured_bodies(self, sensor: int) -> list[int]:
        """Return the bodies whose quantities a sensor measures."""
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
            return not bodies or any(body in self.bodies for body in bodies) or not any(bodies)
        name = mujoco.mj_id2name(self.model, kind, index)
        return name.startswith(ROBOT_PREFIX) if name else any(body in self.bodies for body in bodies)


def read_ownership(model: mujoco.MjModel) -> Ownership:
    """Return the assignment of a compiled model's elements to the robot."""
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body) or "" for body in range(model.nbody)]
    named = [name.startswith(ROBOT_PREFIX) for name in names]
    if not any(named):
        loose = set(_loose_objects(model))
        ours = tuple(body for body in range(1, model.nbody) if int(model.body_rootid[body]) not in loose)
        return Ownership(model, ours, is_scene=False)
    owned: list[int] = []
    for body in range(1, model.nbody):
        # an unnamed body inside the robot carries no prefix
        if named[body] or int(model.body_parentid[body]) in owned:
            owned.append(body)
    return Ownership(model, tuple(owned), is_scene=True)


def _loose_objects(model: mujoco.MjModel) -> list[int]:
    """Return the root bodies of rigid objects that move independently of the robot.

    They have no joints below their root, and no tendon, actuator or equality constraint concerns them. Empty if this
    holds for every body of the model: all of them then count as the robot.
    """
    joined = {
        body for joint in range(model.njnt) for body in (int(model.jnt_bodyid[joint]),) if not _is_root(model, joint)
    }
    joined |= {body for tendon in range(model.ntendon) for body in tendon_bodies(model, tendon)}
    joined |= {body for actuator in range(model.nactuator) for body in _actuated_bodies(model, actuator)}
    joined |= {body for equality in range(model.neq) for body in equality_bodies(model, equality)}
    alive = {int(model.body_rootid[body]) for body in joined if body}
    free = [int(model.jnt_bodyid[joint]) for joint in range(model.njnt) if _is_root(model, joint)]
    return [body for body in dict.fromkeys(free) if body not in alive] if alive else []


def _is_root(model: mujoco.MjModel, joint: int) -> bool:
    """Return whether a joint connects a body to the world."""
    return int(model.body_parentid[model.jnt_bodyid[joint]]) == 0


def equality_bodies(model: mujoco.MjModel, equality: int) -> tuple[int, ...]:
    """Return the bodies that an equality constraint concerns, in order; empty for constraints of flexes.

    These are the two bodies that a connect or weld constraint joins, also if it is given by sites, or the bodies of the
    joints or tendons that the constraint couples. A joint or tendon that is held alone has no second one.
    """
    kind = int(model.eq_type[equality])
    ends = [int(end) for end in (model.eq_obj1id[equality], model.eq_obj2id[equality]) if end >= 0]
    if kind == int(mujoco.mjtEq.mjEQ_JOINT):
        return tuple(int(model.jnt_bodyid[end]) for end in ends)
    if kind == int(mujoco.mjtEq.mjEQ_TENDON):
        return tuple(body for end in ends for body in tendon_bodies(model, end))
    if kind not in _JOINING:
        return ()
    by_sites = int(model.eq_objtype[equality]) == int(mujoco.mjtObj.mjOBJ_SITE)
    return tuple(int(model.site_bodyid[end]) if by_sites else end for end in ends)


def joins_bodies(model: mujoco.MjModel, equality: int) -> bool:
    """Return whether an equality constraint is a connect or weld constraint."""
    return int(model.eq_type[equality]) in _JOINING


def _actuated_bodies(model: mujoco.MjModel, actuator: int) -> list[int]:
    """Return the bodies that an actuator acts on."""
    kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
    if kind == _TENDON:
        return tendon_bodies(model, target)
    if kind in _JOINT:
        return [int(model.jnt_bodyid[target])]
    return [target] if kind == _BODY else [int(model.site_bodyid[target])]


def tendon_wraps(model: mujoco.MjModel, tendon: int) -> list[tuple[int, int]]:
    """Return (mjtWrap, object id) of each element of a tendon's path, in order."""
    first = int(model.tendon_adr[tendon])
    return [(int(model.wrap_type[k]), int(model.wrap_objid[k])) for k in range(first, first + model.tendon_num[tendon])]


def tendon_bodies(model: mujoco.MjModel, tendon: int) -> list[int]:
    """Return the bodies along a tendon in order, without immediate repetitions."""
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
