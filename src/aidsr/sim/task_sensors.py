"""What a task measures about a robot it has never seen: named sensors that scene assembly adds.

What concerns the environment alone is a sensor written in the environment's own MJCF. What involves the robot cannot be
written there, because its parts are unknown; a task asks for it with a `TaskSensor` and reads it by that name.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self

import mujoco
from pydantic import Field, model_validator

from aidsr.artifacts import Artifact

__all__ = ["CONTACT_SLOT_WIDTH", "Part", "Quantity", "TaskSensor", "add_task_sensors"]

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
_BODY = mujoco.mjtObj.mjOBJ_BODY
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
_NEEDS_TARGET = frozenset({"contact_force", "contacts", "distance", "target_position"})


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

    A squeeze from two sides cancels in "contact_force"; "contacts" keeps the sides apart. Each of its slots is found
    (how many contacts match, 0 for an empty slot), force in the contact's own axes (normal first, never negative),
    position and normal (from the robot into the target) in world axes; the strongest comes first.

    Source: MuJoCo XML reference, sensors framepos, framequat, framelinvel, frameangvel, subtreecom, subtreelinvel,
    contact (netforce, maxforce) and distance.
    """

    name: Annotated[str, Field(min_length=1, pattern=r"^[^/]*$")]
    """Name of the sensor in the scene, as given here; it must differ from the environment's own sensors."""
    quantity: Quantity
    target: str = ""
    """Body of the environment (of "world": its own geoms), or for positions and velocities also a site."""
    part: Part = "robot"
    """For contacts: any part of the robot, or the functional part's body with everything it carries."""
    slots: Annotated[int, Field(ge=1, le=64)] = 1
    """For "contacts": how many are reported."""
    max_distance_m: Annotated[float, Field(gt=0)] = 1.0
    """For "distance": a larger gap reads as this one [m]. MuJoCo looks no further than it."""

    @model_validator(mode="after")
    def _target_where_it_means_something(self) -> Self:
        if self.quantity in _NEEDS_TARGET and not self.target:
            raise ValueError(f'sensor "{self.name}": {self.quantity} needs a target body of the environment')
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
        return self.quantity in _OF_THE_SITE or self.quantity == "target_position"

    @property
    def size(self) -> int:
        """How many numbers the sensor gives."""
        if self.quantity == "contacts":
            return self.slots * CONTACT_SLOT_WIDTH
        return {"quaternion": 4, "distance": 1}.get(self.quantity, 3)


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
        added = scene.add_sensor(name=sensor.name)
        if sensor.quantity in _OF_THE_ROBOT:
            added.type, added.objtype, added.objname = _OF_THE_ROBOT[sensor.quantity], _BODY, root
        elif sensor.quantity in _OF_THE_SITE:
            added.type, added.objtype, added.objname = _OF_THE_SITE[sensor.quantity], mujoco.mjtObj.mjOBJ_SITE, site
            if sensor.target and sensor.target != "world":
                added.reftype = mujoco.mjtObj.mjOBJ_SITE if scene.site(sensor.target) else _FRAME
                added.refname = sensor.target
        elif sensor.quantity == "target_position":
            added.type, added.objname = _SENS.mjSENS_FRAMEPOS, sensor.target
            added.objtype = mujoco.mjtObj.mjOBJ_SITE if scene.site(sensor.target) else _FRAME
        else:
            added.reftype, added.refname = _BODY, sensor.target
            if sensor.quantity == "distance":
                added.type, added.objtype, added.objname = mujoco.mjtSensor.mjSENS_GEOMDIST, _BODY, part_body
                added.cutoff = sensor.max_distance_m
            else:
                added.type, added.objtype = mujoco.mjtSensor.mjSENS_CONTACT, _FRAME
                added.objname = root if sensor.part == "robot" else part_body
                added.intprm = (*_CONTACT_DATA[sensor.quantity], sensor.slots)
