"""Scene assembly: place a robot in an environment according to the Scene Integrator's decision.

The Scene Integrator returns a `Placement`; this module carries it out. `docs/environments.md` describes the changes
that assembly makes to a robot and the reasons for them.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Sequence
from typing import Any

import mujoco
import numpy as np
from lxml import etree

from aidsr.core.artifacts import Fault, Placement, Robot, Scene
from aidsr.core.errors import MjcfError
from aidsr.core.suggestions import closest_name
from aidsr.mjcf.compile import compile_mjcf, load_mjcf, warnings_as_notes
from aidsr.mjcf.elements import Element
from aidsr.mjcf.names import ROBOT_PREFIX
from aidsr.sandbox.isolated import isolated
from aidsr.sim.beam import solref
from aidsr.sim.functional_part import FUNCTIONAL_SITE, FunctionalPart, find_functional_part, part_names
from aidsr.sim.placement import (
    attach_robot,
    check_environment,
    exclude_mount_contacts,
    mount_names,
    mount_pose,
    unused_name,
)
from aidsr.sim.scaling import scale_robot
from aidsr.sim.strip_scenery import strip_scenery, write_out_inertias
from aidsr.sim.task_sensors import TaskSensor, add_task_sensors, measured_parts

_SITE_RADIUS_M = 0.003
_SITE_GROUP = 4  # by default MuJoCo draws only groups 0 to 2

_LITTLE_SMALLER = 0.75
"""Smallest scale below 1 at which the time step is not reduced. Our choice: soft limbs that are stable at a time step
are also stable at 1.3 times that step."""

_NAMES_LISTED = 30  # names in a message; our choice: a person or a language model reads the message as a whole

_OF_THE_ENVIRONMENT = ("option", "visual", "statistic", "size", "keyframe")
"""Sections of a robot's MJCF that a scene takes from the environment only."""


@isolated
def assemble(robot: Robot, environment: str, placement: Placement, sensors: Sequence[TaskSensor] = ()) -> Scene:
    """Place a robot in an environment, in an isolated process.

    Args:
        robot: The robot alone.
        environment: MJCF of the environment.
        placement: Mount, pose, base and scale of the robot in the environment.
        sensors: Sensors with which the task measures the robot.

    Raises:
        MjcfError: The robot or the environment cannot be loaded, the environment already holds a robot or has a time
            step of zero, the placement names something that does not exist, or the robot cannot have the requested
            base (fixed or free).
        IsolationError: Assembly exceeded its limits of time or memory.
    """
    mjcf, notes = _assemble(robot, environment, placement, sensors)
    return Scene(mjcf=mjcf, placement=placement, notes=tuple(notes))


@isolated
def add_sensors(scene: str, sensors: Sequence[TaskSensor]) -> str:
    """Return the MJCF of an assembled scene with those of the sensors added whose names it does not have yet.

    Runs in an isolated process.

    Raises:
        MjcfError: The scene cannot be loaded, or a sensor needs a functional part and the scene has no site for one.
    """
    spec = load_mjcf(scene).spec
    model = _compile(spec.copy(), "the scene")
    taken = {model.sensor(i).name for i in range(model.nsensor)}
    new = [sensor for sensor in sensors if sensor.name not in taken]
    parts = measured_parts(model)
    if not parts["root"] or (not parts["part_body"] and any(sensor.needs_functional_part for sensor in new)):
        raise MjcfError([_missing("functional part", FUNCTIONAL_SITE, "of the scene", part_names(model))])
    add_task_sensors(spec, new, **parts)
    return _write(spec)


def _assemble(
    robot: Robot, environment: str, placement: Placement, sensors: Sequence[TaskSensor]
) -> tuple[str, list[str]]:
    """Return the scene's MJCF and one sentence for each change that was made to the robot or the time step."""
    loaded = load_mjcf(environment)
    check_environment(loaded)
    scene = loaded.spec
    _prepare(scene, loaded.document.root)
    stage = _compile(scene, "the environment")
    spec, classes, timestep_s, notes = _read_robot(robot.mjcf, placement.scale)
    alone = _compile(spec.copy(), "the robot without its surroundings")
    part = _check_names(robot, placement, sensors, stage, alone)
    mount = mount_pose(stage, placement)
    scene.option.timestep, slower = _common_timestep(scene.option.timestep, timestep_s, placement.scale)
    _yield_contact_settings(spec, classes, scene)
    root, changes = attach_robot(scene, spec, alone, placement, mount)
    if placement.base == "fixed":
        exclude_mount_contacts(scene, _compile(scene, "the scene"), root, mount.body)
    part_body = root
    if part:
        part_body = root if part.body == "world" else ROBOT_PREFIX + part.body
        site = scene.body(part_body).add_site(name=FUNCTIONAL_SITE, pos=part.position_m, quat=part.quaternion)
        site.size, site.group = [_SITE_RADIUS_M] * 3, _SITE_GROUP
    add_task_sensors(scene, sensors, site=FUNCTIONAL_SITE, part_body=part_body, root=root)
    return _write(scene), [*notes, *slower, *changes]


def _prepare(spec: mujoco.MjSpec, document: Element) -> list[Any]:
    """Prepare a model for attachment to another one, in place, and return its default classes."""
    names = sorted({default.get("class", "main") for default in document.iter("default")} - {"main"})
    classes = [spec.default, *(spec.find_default(name) for name in names)]
    if spec.compiler.degree:
        # Elements hold copies of these values that the compiler converts to radians. The classes are written to the
        # scene without conversion, so they are converted here.
        for joint in (default.joint for default in classes if default.joint.type != mujoco.mjtJoint.mjJNT_SLIDE):
            joint.range, joint.ref, joint.springref = np.deg2rad(joint.range), *np.deg2rad([joint.ref, joint.springref])
    for index, body in enumerate(spec.bodies):
        body.name = body.name or unused_name(f"body_{index}", spec.bodies)  # the code below refers to bodies by name
    # With autolimits off, MuJoCo requires a flag beside every range, so switching it on changes no limit.
    spec.compiler.autolimits = True
    spec.compiler.discardvisual = spec.compiler.fusestatic = False
    write_out_inertias(spec)
    return classes


def _read_robot(text: str, scale: float) -> tuple[mujoco.MjSpec, list[Any], float | None, list[str]]:
    """Return the scaled robot without scenery, its default classes, its own time step [s], and notes on the changes.

    The time step is None if the robot's MJCF has none.
    """
    document = copy.deepcopy(load_mjcf(text).document.root)
    timesteps = [option.get("timestep", "") for option in document.findall("option")]
    put_aside = [element for name in _OF_THE_ENVIRONMENT for element in document.findall(name)]
    for element in put_aside:
        document.remove(element)
    spec = mujoco.MjSpec.from_string(etree.tostring(document, encoding="unicode"))
    classes = _prepare(spec, document)
    for default in classes:
        # Attaching prefixes the names of assets, but not the references to them in default classes. Elements have
        # their own references.
        default.geom.material = default.site.material = default.tendon.material = default.mesh.material = ""
        default.material.textures = [""] * len(default.material.textures)
    notes = strip_scenery(spec)
    if put_aside:
        what = _listed(element.tag for element in put_aside)
        notes.insert(0, f"The environment's settings hold; put aside the robot's own {what}.")
    if scale != 1:
        scale_robot(spec, scale, classes)
        notes.append(f"Scaled the robot by {scale:g} as the same material.")
    return spec, classes, next((float(value) for value in reversed(timesteps) if value), None), notes


def _check_names(
    robot: Robot, placement: Placement, sensors: Sequence[TaskSensor], stage: mujoco.MjModel, alone: mujoco.MjModel
) -> FunctionalPart | None:
    """Look up every name that the placement or the task uses; return the functional part, None if none is named.

    Raises:
        MjcfError: A name does not exist, a sensor's name is already in use, or a sensor needs a functional part and
            none is named.
    """
    faults = []
    mounts = ("world", *mount_names(stage))
    if placement.mount not in mounts:
        faults.append(_missing("mount", placement.mount, "of the environment", mounts))
    bodies = tuple(stage.body(i).name for i in range(stage.nbody))
    sites = tuple(stage.site(i).name for i in range(stage.nsite))
    joints = tuple(stage.joint(i).name for i in range(stage.njnt))
    for name in placement.intended_contacts:
        if name not in bodies:
            faults.append(_missing("intended contact", name, "of the environment", bodies))
    taken = [stage.sensor(i).name for i in range(stage.nsensor)]
    for sensor in sensors:
        if sensor.name in taken:
            faults.append(_duplicate(sensor.name))
        taken.append(sensor.name)
        there = joints if sensor.quantity == "joint_position" else bodies + (sites if sensor.may_target_site else ())
        if sensor.target and sensor.target not in there:
            faults.append(_missing(f'target of sensor "{sensor.name}"', sensor.target, "of the environment", there))
    name = (placement.functional_part or robot.functional_part).removeprefix(ROBOT_PREFIX)
    part = find_functional_part(alone, name) if name else None
    if part is None and name:
        faults.append(_missing("functional part", name, "of the robot", part_names(alone)))
    elif part is None and any(sensor.needs_functional_part for sensor in sensors):
        faults.append(_no_functional_part(part_names(alone)))
    if faults:
        raise MjcfError(faults)
    return part


def _missing(what: str, name: str, owner: str, existing: Sequence[str]) -> Fault:
    near = closest_name(name, filter(None, existing))
    return Fault(
        code="undefined_reference",
        layer="load",
        severity="error",
        names=(name,),
        message=f'the {what} "{name}" is not a name {owner}' + (f"; did you mean {near}?" if near else ""),
        cure=f"use one of: {_listed(existing)}",
    )


def _no_functional_part(existing: Sequence[str]) -> Fault:
    cure = f"name a body, site or geom of the robot: {_listed(existing)}"
    return Fault(
        code="undefined_reference",
        layer="load",
        severity="error",
        message=f"no functional_part given; {cure}",
        cure=cure,
    )


def _duplicate(name: str) -> Fault:
    return Fault(
        code="duplicate_name",
        layer="load",
        severity="error",
        names=(name,),
        message=f'the scene would have two sensors named "{name}", one of them asked for by the task',
        cure="rename one of them",
    )


def _listed(names: Iterable[str]) -> str:
    """Return names as a comma-separated list; names beyond the first `_NAMES_LISTED` are only counted."""
    found = list(dict.fromkeys(name for name in names if name))
    rest = len(found) - _NAMES_LISTED
    return ", ".join(found[:_NAMES_LISTED]) + (f" and {rest} more" if rest > 0 else "")


def _yield_contact_settings(robot: mujoco.MjSpec, classes: Sequence[Any], environment: mujoco.MjSpec) -> None:
    """Give the environment priority in its contacts with the robot, and stiffen contacts within the robot, in place.

    The geom with the higher priority decides about a contact's friction and stiffness. Contacts between parts of the
    robot become as stiff as the time step allows.
    """
    lowest = min((geom.priority for geom in environment.geoms), default=0)
    for geom in (*robot.geoms, *(default.geom for default in classes)):
        geom.priority = min(geom.priority, lowest - 1)
        geom.solref = solref(environment.option.timestep)


def _common_timestep(environment_s: float, robot_s: float | None, scale: float) -> tuple[float, list[str]]:
    """Return the scene's time step [s] and a note if it differs from the environment's.

    The time step is the environment's, divided by a whole number if the robot needs a smaller one. A scaled robot moves
    in scaled time (`aidsr.sim.scaling`), so a smaller robot needs a smaller step for the same stability. For a scale
    from `_LITTLE_SMALLER` to 1 the step is not reduced for the scale, since half the step means twice the computing
    time; the validation of the scene then tests the stability. Because the divisor is a whole number, control periods
    that are multiples of the environment's step remain multiples of the scene's.
    """
    asked_s = min(environment_s, robot_s or environment_s) * (1.0 if _LITTLE_SMALLER <= scale < 1.0 else scale)
    parts = max(1, math.ceil(environment_s / asked_s - 1e-9))
    if parts == 1:
        return environment_s, []
    why = "is smaller now" if robot_s is None or robot_s >= environment_s else f"asks for {robot_s:g} s"
    return environment_s / parts, [f"Divided the timestep of {environment_s:g} s by {parts}: the robot {why}."]


def _write(scene: mujoco.MjSpec) -> str:
    """Return the scene as MJCF, after checking that this text compiles."""
    _compile(scene, "the scene")
    mjcf = str(scene.to_xml())
    compile_mjcf(mjcf)
    return mjcf


def _compile(spec: mujoco.MjSpec, what: str) -> mujoco.MjModel:
    try:
        with warnings_as_notes():
            return spec.compile()
    except ValueError as error:
        message = f"{what} does not compile: {' '.join(str(error).split())}"
        fault = Fault(code="load_error", layer="load", severity="error", message=message)
        raise MjcfError([fault]) from error
