"""Placement of a robot in a scene: pose on a mount, fixed or free base, and contact exclusions at the mount."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Literal, NoReturn

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault, Placement
from aidsr.core.errors import MjcfError
from aidsr.mjcf.compile import Loaded
from aidsr.mjcf.elements import elements, join
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sim.contact_forces import contact_bodies
from aidsr.sim.strip_scenery import delete_dangling_references, is_free

Vector = NDArray[np.float64]

_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True)
class Pose:
    """Pose of a frame relative to a body.

    Attributes:
        body: Name of the body, "world" for the world.
        position_m: Position in the body's frame, (3,) [m].
        quaternion: Orientation in the body's frame, (4,), w first.
    """

    body: str
    position_m: Vector
    quaternion: Vector

    def moved(self, position_m: Vector, quaternion: Vector) -> Pose:
        """Return the pose of a frame that has this position and orientation relative to this pose."""
        turned, orientation = np.zeros(3), np.zeros(4)
        mujoco.mju_rotVecQuat(turned, position_m, self.quaternion)
        mujoco.mju_mulQuat(orientation, self.quaternion, quaternion)
        return Pose(self.body, self.position_m + turned, orientation)


def check_environment(environment: Loaded) -> None:
    """Check that a robot can be placed in an environment.

    Raises:
        MjcfError: Names of the environment begin with the robot's prefix, its time step is not positive, or it is a
            robot: it has driven cables and no mount.
    """
    faults = []
    named = (element.get("name", element.get("class", "")) for element in elements(environment.document.root))
    taken = tuple(dict.fromkeys(name for name in named if name.startswith(ROBOT_PREFIX)))
    if taken:
        found = f'names that begin with "{ROBOT_PREFIX}" are those of the robot placed here, found {join(taken)}'
        cure = "give the environment without a robot, not an assembled scene"
        faults.append(_fault("duplicate_name", taken, found, cure))
    timestep_s = environment.model.opt.timestep
    if timestep_s <= 0:
        found = f"the environment's timestep must be above 0 s, found {timestep_s:g} s"
        faults.append(_fault("bad_value", (), found, 'write <option timestep="0.002"/>'))
    cables = () if mount_names(environment.model) else _driven_cables(environment.model)
    if cables:
        cure = "give the surroundings without it (a robot to start from: --robot)"
        found = f'this is a robot, not an environment: it has cables with actuators and no site named "mount"; {cure}'
        faults.append(_fault("load_error", cables, found, cure))
    if faults:
        raise MjcfError(faults)


def _driven_cables(model: mujoco.MjModel) -> tuple[str, ...]:
    """Return the names of the spatial tendons on which actuators act."""
    driven = {
        int(model.actuator_trnid[actuator, 0])
        for actuator in range(model.nu)
        if model.actuator_trntype[actuator] == mujoco.mjtTrn.mjTRN_TENDON
    }
    spatial = (at for at in sorted(driven) if model.wrap_type[model.tendon_adr[at]] != mujoco.mjtWrap.mjWRAP_JOINT)
    return tuple(model.tendon(at).name or "a tendon without a name" for at in spatial)


def mount_names(environment: mujoco.MjModel) -> tuple[str, ...]:
    """Return the names of the sites to which a robot may be attached: "mount" and names that begin with "mount_"."""
    sites = [environment.site(i).name for i in range(environment.nsite)]
    return tuple(name for name in sites if name == "mount" or name.startswith("mount_"))


def mount_pose(environment: mujoco.MjModel, placement: Placement) -> Pose:
    """Return the pose of the mount that a placement names.

    The pose is relative to the mount's body for a fixed base, and the initial pose in the world for a free base.

    Args:
        environment: The environment without a robot.
        placement: A placement whose mount exists in the environment.
    """
    if placement.mount == "world":
        return Pose("world", np.zeros(3), _UPRIGHT)
    site = environment.site(placement.mount)
    if placement.base == "fixed":
        body = environment.body(environment.site_bodyid[site.id]).name
        return Pose(body, site.pos.copy(), site.quat.copy())
    data = mujoco.MjData(environment)
    mujoco.mj_kinematics(environment, data)
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, data.site_xmat[site.id])
    return Pose("world", data.site_xpos[site.id].copy(), quaternion)


def attach_robot(
    scene: mujoco.MjSpec, robot: mujoco.MjSpec, alone: mujoco.MjModel, placement: Placement, mount: Pose
) -> tuple[str, list[str]]:
    """Attach a robot to a mount, in place, and add or remove its free joint.

    A robot with one root is attached by this root: the placement gives the position of the root's origin, and the
    root's position in the robot's file is dropped. For a robot with several roots, or with geoms and sites directly in
    its worldbody, a body is added that carries all of them; its origin is the origin of the robot's file.

    Args:
        scene: The environment, which becomes the scene.
        robot: The robot without scenery; it is part of the scene afterwards.
        alone: The same robot, compiled.
        placement: Placement of the robot.
        mount: Pose of the mount, from `mount_pose`.

    Returns:
        Name of the body that carries the whole robot, and one sentence for each change.

    Raises:
        MjcfError: The robot has no body, consists of separate parts of which one is free, or should be free although
            its root has joints other than a free joint.
    """
    roots = list(robot.worldbody.bodies)
    beside = [*robot.worldbody.geoms, *robot.worldbody.sites]
    free = [root for root in roots if is_free(root)]
    if not roots or (free and len(roots) > 1):
        found = f"has {len(roots)} separate parts, {len(free)} of them free" if roots else "has no body"
        cure = "make every part of the robot a descendant of one body"
        _refuse("disconnected", tuple(root.name for root in roots), f"the robot {found}", cure, layer="structure")
    for root in roots:
        root.mocap = False  # in a scene only the mount may move the root
    turn = np.zeros(4)
    mujoco.mju_euler2Quat(turn, np.deg2rad(placement.rotation_deg), "xyz")
    pose = mount.moved(np.array(placement.position_m), turn)
    if len(roots) > 1 or beside:
        name, frame = _carry(scene, robot, pose, placement.base)
        notes = [f'Added the body "{name}" to carry all that the robot fixes to its world.']
    else:
        notes = _set_base(robot, roots[0], placement.base)
        name = ROBOT_PREFIX + roots[0].name
        own = alone.body_pos[1]
        if np.any(own):
            notes.append(f"The placement takes the place of the root's own position {_text(own)} m.")
        pose = pose.moved(-own, _UPRIGHT)
        frame = scene.body(pose.body).add_frame(pos=pose.position_m, quat=pose.quaternion)
    scene.attach(robot, prefix=ROBOT_PREFIX, frame=frame)
    return name, notes


def _carry(scene: mujoco.MjSpec, robot: mujoco.MjSpec, pose: Pose, base: str) -> tuple[str, Any]:
    """Add a body to the scene that carries the whole robot; return its name and the frame for attaching the robot."""
    name = ROBOT_PREFIX + unused_name("root", robot.bodies)
    body = scene.body(pose.body).add_body(name=name, pos=pose.position_m, quat=pose.quaternion)
    if base == "free":
        body.add_freejoint(name=ROBOT_PREFIX + unused_name("root", robot.joints))
    return name, body.add_frame()


def _set_base(robot: mujoco.MjSpec, root: Any, base: str) -> list[str]:
    """Add or remove the free joint of a robot's only root; return one sentence for each change."""
    free = [joint for joint in root.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
    if base == "fixed":
        for joint in free:
            robot.delete(joint)
        fixed = [f'Fixed the root "{root.name}" to the mount: removed its free joint.'] if free else []
        return fixed + delete_dangling_references(robot)
    if free:
        return []
    if root.joints:
        names = (root.name, *(joint.name for joint in root.joints))
        found = f'the root "{root.name}" cannot be free, because it has joints of its own'
        cure = "give the robot a root with a shape and without joints, or place it with a fixed base"
        _refuse("invalid_joint_placement", names, found, cure)
    root.add_freejoint(name=unused_name("root", robot.joints))
    return [f'Freed the root "{root.name}": added a free joint.']


def exclude_mount_contacts(scene: mujoco.MjSpec, model: mujoco.MjModel, root: str, mount_body: str) -> None:
    """Exclude contact between the first moving bodies of a fixed robot and the bodies they are mounted on, in place.

    MuJoCo ignores contact between a body and its parent, but not if the parent is fixed to the world, nor across a
    body without geoms such as a gimbal. Contact is excluded with the robot's own base, with the mount's body, and with
    bodies that are fixed to the mount and touch the robot at the start. Contact with the world is only excluded if it
    is touched at the start, because its floor and walls are also obstacles.

    Args:
        scene: Environment and robot.
        model: The same scene, compiled.
        root: Name of the body that carries the whole robot and is fixed to the mount.
        mount_body: Name of the body that the mount belongs to.

    Source: MuJoCo manual, Computation, collision detection, filterparent; our choice: which bodies are excluded.
    """
    held = int(model.body_weldid[model.body(root).id])
    robot = [body for body in range(model.nbody) if _descends(model, body, model.body(root).id)]
    first = [body for body in robot if body in first_shapes(model, robot, held)]
    base = [body for body in robot if model.body_weldid[body] == held and model.body_geomnum[body]]
    mount = [] if mount_body == "world" else [model.body(mount_body).id]
    pairs = {(other, body) for body in first for other in (*base, *mount)}
    pairs |= {(other, body) for other, body in _touching(model, first) if model.body_weldid[other] == held}
    present = {frozenset((exclude.bodyname1, exclude.bodyname2)) for exclude in scene.excludes}
    for other, body in sorted(pairs):
        names = (model.body(other).name, model.body(body).name)
        if frozenset(names) not in present:
            scene.add_exclude(bodyname1=names[0], bodyname2=names[1])


def _descends(model: mujoco.MjModel, body: int, ancestor: int) -> bool:
    while body > ancestor:
        body = int(model.body_parentid[body])
    return body == ancestor


def first_shapes(model: mujoco.MjModel, robot: list[int], held: int) -> Iterator[int]:
    """Yield the first moving bodies with geoms: those without another such body between them and the base.

    Args:
        model: Compiled scene.
        robot: Ids of the robot's bodies.
        held: Id of the body that the base is fixed to, as in `body_weldid`.
    """
    for body in robot:
        if model.body_weldid[body] == held or not model.body_geomnum[body]:
            continue
        parent = int(model.body_parentid[body])
        while model.body_weldid[parent] != held and not model.body_geomnum[parent]:
            parent = int(model.body_parentid[parent])
        if model.body_weldid[parent] == held:
            yield body


def _touching(model: mujoco.MjModel, bodies: list[int]) -> Iterator[tuple[int, int]]:
    """Yield (other body, body) for each contact in the initial state that involves one of these bodies."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for contact in data.contact[: data.ncon]:
        first, second = contact_bodies(model, contact)
        if first in bodies:
            yield second, first
        if second in bodies:
            yield first, second


def unused_name(name: str, elements: Iterable[Any]) -> str:
    """Return the name, with underscores appended until none of the elements has it."""
    taken = {element.name for element in elements}
    while name in taken:
        name += "_"
    return name


def _text(vector: Vector) -> str:
    return " ".join(f"{value:g}" for value in vector)


def _refuse(
    code: str, names: tuple[str, ...], message: str, cure: str, layer: Literal["load", "structure"] = "load"
) -> NoReturn:
    raise MjcfError([_fault(code, names, message, cure, layer)])


def _fault(
    code: str, names: tuple[str, ...], message: str, cure: str, layer: Literal["load", "structure"] = "load"
) -> Fault:
    return Fault(code=code, layer=layer, severity="error", names=names, message=message, cure=cure)
