"""Sensors with which a task measures a robot whose parts it does not know; scene assembly adds them.

A sensor of the environment alone is part of the environment's own MJCF. A sensor that involves the robot cannot be
written there, because the parts of the robot are unknown. A task requests it with a `TaskSensor` and reads it by its
name.
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
"""Numbers in one slot of a "contacts" sensor: found (1), force (3) [N], position (3) [m], normal (3)."""

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
"""Object type of a body's own frame, not of its inertial frame; in a contact sensor, a body with its whole subtree."""
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
"""Data fields and reduction mode in the form of mjsSensor.intprm. Source: MuJoCo, sensor/contact: the modes none,
mindist, maxforce and netforce are 0 to 3."""
_UNSET = {"reftype": mujoco.mjtObj.mjOBJ_UNKNOWN, "refname": "", "cutoff": 0.0, "intprm": (0, 0, 0)}
"""Values of the other attributes of a sensor for which only type and object are given."""
_OF_THE_ENVIRONMENT = frozenset({"target_position", "target_center_of_mass", "target_velocity", "joint_position"})
_NEEDS_TARGET = _OF_THE_ENVIRONMENT | {"contact_force", "contacts", "distance"}


class TaskSensor(Artifact):
    """One sensor in a scene that involves the robot.

    The measured point is the site of the functional part; if the functional part is a body, this is its distal tip.

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

    In "contact_force", forces from two opposite sides cancel; "contacts" reports the sides separately. Each of its
    slots holds: found (number of matching contacts, 0 for an empty slot), force in the contact's frame (normal force
    first, never negative), position and normal in world axes (the normal points from the robot into the target). The
    strongest contact comes first.

    Source: MuJoCo XML reference, sensors framepos, framequat, framelinvel, frameangvel, subtreecom, subtreelinvel,
    jointpos, contact (netforce, maxforce) and distance.
    """

    name: Annotated[str, Field(min_length=1, pattern=r"^[^/]*$")]
    """Name of the sensor in the scene; it must differ from the names of the environment's own sensors."""
    quantity: Quantity
    """Measured quantity, see the table above."""
    target: str = ""
    """Name of a body of the environment, or of a site if `may_target_site`, or of a joint for "joint_position". For
    contacts and distances, "world" stands for the world's own geoms."""
    of_body: bool = False
    """Whether `target` is a body even if there is also a site of that name; otherwise the site is preferred."""
    part: Part = "robot"
    """For contacts: the whole robot, or the functional part's body with its subtree."""
    slots: Annotated[int, Field(ge=1, le=64)] = 1
    """For "contacts": number of reported contacts, the strongest; `Readings.all_contacts_n` sums more."""
    max_distance_m: Annotated[float, Field(gt=0)] = 1.0
    """For "distance": largest measured gap [m]; a larger gap is reported as this value."""

    @model_validator(mode="after")
    def _check_target(self) -> Self:
        if self.quantity in _NEEDS_TARGET and not self.target:
            raise ValueError(f'sensor "{self.name}": {self.quantity} needs a target of the environment')
        if self.quantity in _OF_THE_ROBOT and self.target:
            raise ValueError(f'sensor "{self.name}": {self.quantity} is measured in world axes and takes no target')
        return self

    @property
    def needs_functional_part(self) -> bool:
        """Whether the robot must have a functional part for this sensor."""
        return self.quantity in _OF_THE_SITE or self.quantity == "distance" or self.part == "functional_part"

    @property
    def may_target_site(self) -> bool:
        """Whether its target may be a site."""
        return (self.quantity in _OF_THE_SITE or self.quantity == "target_position") and not self.of_body

    @property
    def size(self) -> int:
        """Number of values that the sensor returns."""
        if self.quantity == "contacts":
            return self.slots * CONTACT_SLOT_WIDTH
        return {"quaternion": 4, "distance": 1, "joint_position": 1}.get(self.quantity, 3)


def add_task_sensors(
    scene: mujoco.MjSpec, sensors: Sequence[TaskSensor], *, site: str, part_body: str, root: str
) -> None:
    """Add a task's sensors to a scene, in place, after its existing sensors.

    Args:
        scene: Environment and robot.
        sensors: Sensors that the task requests.
        site: Name of the site at the functional part's working point.
        part_body: Name of the body that the functional part belongs to.
        root: Name of the body that carries the whole robot.
    """
    for sensor in sensors:
        at_site = sensor.may_target_site and bool(scene.site(sensor.target))
        scene.add_sensor(name=sensor.name, **_attributes(sensor, at_site, site, part_body, root))


def measured_parts(model: mujoco.MjModel) -> dict[str, str]:
    """Return the names of the robot's parts in an assembled scene, as keyword arguments of `add_task_sensors`.

    A name is "" if the scene has no such part.
    """
    roots, site = read_structure(model).roots, mujoco.mj_name2id(model, _SITE, FUNCTIONAL_SITE)
    return {
        "site": FUNCTIONAL_SITE,
        "part_body": "" if site < 0 else model.body(int(model.site_bodyid[site])).name,
        "root": model.body(roots[0]).name if roots else "",
    }


def check_task_sensors(model: mujoco.MjModel, sensors: Sequence[TaskSensor]) -> None:
    """Check that the sensors of a scene with the names of a task's sensors measure what the task requests.

    Args:
        model: Compiled scene, with a sensor of each name.
        sensors: Sensors that the task requests.

    Raises:
        MjcfError: A sensor with one of these names measures something else.
    """
    parts, sites = measured_parts(model), {model.site(i).name for i in range(model.nsite)}
    faults = []
    for sensor in sensors:
        wanted = _UNSET | _attributes(sensor, sensor.may_target_site and sensor.target in sites, **parts)
        there = _compiled_attributes(model, model.sensor(sensor.name).id)
        # MJCF is written with six digits
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
    """Return the attributes of mjsSensor for a task's sensor; `at_site` says whether its target is a site."""
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
    """Return the attributes of a compiled sensor in the form of `_attributes`."""
    read: dict[str, Any] = {
        "type": mujoco.mjtSensor(int(model.sensor_type[index])),
        "cutoff": float(model.sensor_cutoff[index]),
        "intprm": tuple(int(number) for number in model.sensor_intprm[index]),
    }
    for end in ("obj", "ref"):
        kind, number = (int(getattr(model, f"sensor_{end}{what}")[index]) for what in ("type", "id"))
        read |= {f"{end}type": mujoco.mjtObj(kind), f"{end}name": mujoco.mj_id2name(model, kind, number) or ""}
    return read
