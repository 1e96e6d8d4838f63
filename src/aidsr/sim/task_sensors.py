"""What a task measures about a robot it has never seen: named sensors that scene assembly adds.

What concerns the environment alone is a sensor written in the environment's own MJCF. What involves the robot cannot be
written there, because its parts are unknown; a task asks for it with a `TaskSensor` and reads it by that name.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self

import mujoco
from pydantic import Field, model_validator

from aidsr.core.artifacts import Artifact, Fault
from aidsr.core.errors import MjcfError
from aidsr.sim.functional_part import FUNCTIONAL_SITE
from aidsr.sim.structure import read_structure

Quantity = Literal[
    "position",
    "quaternion",
    "linear_velocity",
    "angular_velocity",
    "center_of_mass",
    "center_of_mass_velocity",
    "contact_force",
    "contacts",
    "distance",
    "target_position",
    "target_center_of_mass",
    "target_velocity",
    "joint_position",
]
Part = Literal["functional_part", "robot"]

CONTACT_SLOT_WIDTH = 10
"""Numbers in one slot of a "contacts" sensor: found 1, force 3 [N], position 3 [m], normal 3."""

_SENS = mujoco.mjtSensor
_OF_THE_ROBOT = {
    "center_of_mass": _SENS.mjSENS_SUBTREECOM,
    "center_of_mass_velocity": _SENS.mjSENS_SUBTREELINVEL,
}
_OF_THE_SITE = {
    "position": _SENS.mjSENS_FRAMEPOS,
    "quaternion": _SENS.mjSENS_FRAMEQUAT,
    "linear_velocity": _SENS.mjSENS_FRAMELINVEL,
    "angular_velocity": _SENS.mjSENS_FRAMEANGVEL,
}
_BODY, _SITE = mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_SITE
_FRAME = mujoco.mjtObj.mjOBJ_XBODY
"""The frame of a body rather than of its inertia; as the object of a contact sensor, a body with all it carries."""
_FOUND, _FORCE, _POSITION, _NORMAL = (
    1 << int(field)
    for field in (
        mujoco.mjtConDataField.mjCONDATA_FOUND,
        mujoco.mjtConDataField.mjCONDATA_FORCE,
        mujoco.mjtConDataField.mjCONDATA_POS,
        mujoco.mjtConDataField.mjCONDATA_NORMAL,
    )
)
_MAX_FORCE, _NET_FORCE = 2, 3
_CONTACT_DATA = {
    "contact_force": (_FORCE, _NET_FORCE),
    "contacts": (_FOUND | _FORCE | _POSITION | _NORMAL, _MAX_FORCE),
}
"""Fields and reduction as mjsSensor.intprm has them. Source: MuJoCo, sensor/contact: reduce none, mindist, maxforce,
netforce are 0 to 3."""
_UNSET = {"reftype": mujoco.mjtObj.mjOBJ_UNKNOWN, "refname": "", "cutoff": 0.0, "intprm": (0, 0, 0)}
"""Attributes of a sensor of which only type and object are given."""
_OF_THE_ENVIRONMENT = frozenset({"target_position", "target_center_of_mass", "target_velocity", "joint_position"})
_NEEDS_TARGET = _OF_THE_ENVIRONMENT | {"contact_force", "contacts", "distance"}


class TaskSensor(Artifact):
    """One sensor of the scene that involves the robot.

    The point measured is the functional part's site; where the functional part is a body, that is its distal tip.

    | quantity                | size       | unit  | measured                                                         |
    |-------------------------|------------|-------|------------------------------------------------------------------|
    | position                | 3          | m     | functional part, in world axes or in the frame of `target`       |
    | quaternion              | 4          |       | its orientation (w x y z), likewise                              |
    | linear_velocity         | 3          | m/s   | its velocity, likewise; relative to `target` when one is named   |
    | angular_velocity        | 3          | rad/s | likewise                                                         |
    | center_of_mass          | 3          | m     | whole robot, world axes                                          |
    | center_of_mass_velocity | 3          | m/s   | whole robot, world axes                                          |
    | contact_force           | 3          | N     | net force on the body `target` by `part`, world axes             |
    | contacts                | slots x 10 |       | the strongest contacts of `part` with the body `target`          |
    | distance                | 1          | m     | smallest gap between the functional part's body and `target`     |
    | target_position         | 3          | m     | body or site `target` itself, world axes                         |
    | target_center_of_mass   | 3          | m     | body `target` itself, without what it carries, world axes        |
    | target_velocity         | 3          | m/s   | its velocity, world axes                                         |
    | joint_position          | 1          | rad, m| the hinge or slide `target` of the environment                   |

    A squeeze from two sides cancels in "contact_force"; "contacts" keeps the sides apart. Each of its slots is found
    (how many contacts match, 0 for an empty slot), force in the contact's own axes (normal first, never negative),
    position and normal (from the robot into the target) in world axes; the strongest comes first.

    Source: MuJoCo XML reference, sensors framepos, framequat, framelinvel, frameangvel, subtreecom, subtreelinvel,
    jointpos, contact (netforce, maxforce) and distance.
    """

    name: Annotated[str, Field(min_length=1, pattern=r"^[^/]*$")]
    """Name of the sensor in the scene, as given here; it must differ from the environment's own sensors."""
    quantity: Quantity
    target: str = ""
    """Body of the environment (of "world": its own geoms), or for positions and velocities also a site; or a joint."""
    of_body: bool = False
    """Whether `target` is a body even where a site has that name; otherwise a site of that name is preferred."""
    part: Part = "robot"
    """For contacts: any part of the robot, or the functional part's body with everything it carries."""
    slots: Annotated[int, Field(ge=1, le=64)] = 1
    """For "contacts": how many are reported."""
    max_distance_m: Annotated[float, Field(gt=0)] = 1.0
    """For "distance": a larger gap reads as this one [m]. MuJoCo looks no further than it."""

    @model_validator(mode="after")
    def _check_target(self) -> Self:
        if self.quantity in _NEEDS_TARGET and not self.target:
            raise ValueError(f'sensor "{self.name}": {self.quantity} needs a target of the environment')
        if self.quantity in _OF_THE_ROBOT and self.target:
            raise ValueError(f'sensor "{self.name}": {self.quantity} is measured in world axes and takes no target')
        return self

    @property
    def needs_functional_part(self) -> bool:
        """Whether it cannot be read off a robot without a functional part."""
        return self.quantity in _OF_THE_SITE or self.quantity == "distance" or self.part == "functional_part"

    @property
    def may_target_site(self) -> bool:
        """Whether its target may be a site as well as a body."""
        return (self.quantity in _OF_THE_SITE or self.quantity == "target_position") and not self.of_body

    @property
    def size(self) -> int:
        """How many numbers the sensor gives."""
        if self.quantity == "contacts":
            return self.slots * CONTACT_SLOT_WIDTH
        return {"quaternion": 4, "distance": 1, "joint_position": 1}.get(self.quantity, 3)


def add_task_sensors(
    scene: mujoco.MjSpec, sensors: Sequence[TaskSensor], *, site: str, part_body: str, root: str
) -> None:
    """Add a task's sensors to a scene, in place, after those it has.

    Args:
        scene: Environment and robot.
        sensors: What the task asks for.
        site: Site at the functional part's working point.
        part_body: Body the functional part belongs to.
        root: Body that carries the whole robot.
    """
    for sensor in sensors:
        at_site = sensor.may_target_site and bool(scene.site(sensor.target))
        scene.add_sensor(name=sensor.name, **_attributes(sensor, at_site, site, part_body, root))


def measured_parts(model: mujoco.MjModel) -> dict[str, str]:
    """Return what `add_task_sensors` takes of an assembled scene's robot, by argument; "" where there is none."""
    roots, site = read_structure(model).roots, mujoco.mj_name2id(model, _SITE, FUNCTIONAL_SITE)
    return {
        "site": FUNCTIONAL_SITE,
        "part_body": "" if site < 0 else model.body(int(model.site_bodyid[site])).name,
        "root": model.body(roots[0]).name if roots else "",
    }


def check_task_sensors(model: mujoco.MjModel, sensors: Sequence[TaskSensor]) -> None:
    """Refuse a scene in which a sensor has the name of one of a task's and measures something else.

    Args:
        model: The scene, with a sensor of each name.
        sensors: What the task asks for.

    Raises:
        MjcfError: One does.
    """
    parts, sites = measured_parts(model), {model.site(i).name for i in range(model.nsite)}
    faults = []
    for sensor in sensors:
        wanted = _UNSET | _attributes(sensor, sensor.may_target_site and sensor.target in sites, **parts)
        there = _compiled_attributes(model, model.sensor(sensor.name).id)
        # a scene's text has six digits
        if not math.isclose(wanted.pop("cutoff"), there.pop("cutoff"), rel_tol=1e-5) or wanted != there:
            faults.append(_foreign(sensor))
    if faults:
        raise MjcfError(faults)


def _foreign(sensor: TaskSensor) -> Fault:
    target = f" of {sensor.target}" if sensor.target else ""
    return Fault(
        code="duplicate_name",
        layer="load",
        severity="error",
        names=(sensor.name,),
        message=f'the task reads {sensor.quantity}{target} by the name "{sensor.name}", and the scene has a sensor of '
        "this name that measures something else; rename or delete it in the scene's MJCF",
        cure="rename or delete it",
    )


def _attributes(sensor: TaskSensor, at_site: bool, site: str, part_body: str, root: str) -> dict[str, Any]:
    """Return a sensor as attributes of mjsSensor."""
    if sensor.quantity in _OF_THE_ROBOT:
        return {"type": _OF_THE_ROBOT[sensor.quantity], "objtype": _BODY, "objname": root}
    if sensor.quantity in _OF_THE_SITE:
        measured = {"type": _OF_THE_SITE[sensor.quantity], "objtype": _SITE, "objname": site}
        if sensor.target in ("", "world"):
            return measured
        return measured | {"reftype": _SITE if at_site else _FRAME, "refname": sensor.target}
    if sensor.quantity == "target_position":
        return {"type": _SENS.mjSENS_FRAMEPOS, "objtype": _SITE if at_site else _FRAME, "objname": sensor.target}
    if sensor.quantity == "target_center_of_mass":
        return {"type": _SENS.mjSENS_FRAMEPOS, "objtype": _BODY, "objname": sensor.target}
    if sensor.quantity == "target_velocity":
        return {"type": _SENS.mjSENS_FRAMELINVEL, "objtype": _BODY, "objname": sensor.target}
    if sensor.quantity == "joint_position":
        return {"type": _SENS.mjSENS_JOINTPOS, "objtype": mujoco.mjtObj.mjOBJ_JOINT, "objname": sensor.target}
    against = {"reftype": _BODY, "refname": sensor.target}
    if sensor.quantity == "distance":
        gap = {"type": _SENS.mjSENS_GEOMDIST, "objtype": _BODY, "objname": part_body}
        return against | gap | {"cutoff": sensor.max_distance_m}
    touching = {"objtype": _FRAME, "objname": root if sensor.part == "robot" else part_body}
    how = (*_CONTACT_DATA[sensor.quantity], sensor.slots)
    return against | touching | {"type": _SENS.mjSENS_CONTACT, "intprm": how}


def _compiled_attributes(model: mujoco.MjModel, index: int) -> dict[str, Any]:
    """Return a compiled sensor in the form of `_attributes`."""
    read: dict[str, Any] = {
        "type": mujoco.mjtSensor(int(model.sensor_type[index])),
        "cutoff": float(model.sensor_cutoff[index]),
        "intprm": tuple(int(number) for number in model.sensor_intprm[index]),
    }
    for end in ("obj", "ref"):
        kind, number = (int(getattr(model, f"sensor_{end}{what}")[index]) for what in ("type", "id"))
        read |= {f"{end}type": mujoco.mjtObj(kind), f"{end}name": mujoco.mj_id2name(model, kind, number) or ""}
    return read
