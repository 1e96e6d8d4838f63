"""Scene assembly: a robot placed in an environment, as the Scene Integrator decided.

The Integrator answers with a `Placement`; this file carries it out. `docs/environments.md` says what is
done to a robot on the way and why.
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
from aidsr.sandbox.isolated import isolated
from aidsr.sim.beam import solref
from aidsr.sim.functional_part import FUNCTIONAL_SITE, FunctionalPart, find_functional_part, part_names
from aidsr.sim.ownership import ROBOT_PREFIX
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
_SITE_GROUP = 4  # MuJoCo draws groups 0 to 2 unless asked for more

_LITTLE_SMALLER = 0.75
"""Scale down to which a robot keeps its step. Our choice: soft limbs stable at a step are stable at 1.3 times it."""

_NAMES_LISTED = 30  # our choice: a fault is read by a person or a language model, not searched

_OF_THE_ENVIRONMENT = ("option", "visual", "statistic", "size", "keyframe")
"""Sections of a robot's file that have one owner in a scene: the environment."""


@isolated
def assemble(robot: Robot, environment: str, placement: Placement, sensors: Sequence[TaskSensor] = ()) -> Scene:
    """Place a robot in an environment, in an isolated process.

    Args:
        robot: The robot alone.
        environment: MJCF of the environment.
        placement: Where and how the robot stands in it.
        sensors: What the task measures about the robot.

    Raises:
        MjcfError: The robot or the environment cannot be loaded, the environment holds a robot already or stands still,
            the placement names something that does not exist, or the robot cannot be based as the placement asks.
        IsolationError: Assembling ran past its limits.
    """
    mjcf, notes = _assemble(robot, environment, placement, sensors)
    return Scene(mjcf=mjcf, placement=placement, notes=tuple(notes))


@isolated
def add_sensors(scene: str, sensors: Sequence[TaskSensor]) -> str:
    """Return the MJCF of an assembled scene with those sensors whose names it lacks, in an isolated process.

    Raises:
        MjcfError: The scene cannot be loaded, or a sensor needs a functional part and the scene marks none.
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
    """Return the scene's MJCF and one sentence for each change made on the way."""
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
    """Make a model ready to be joined with another, in place, and return its default classes."""
    names = sorted({default.get("class", "main") for default in document.iter("default")} - {"main"})
    classes = [spec.default, *(spec.find_default(name) for name in names)]
    if spec.compiler.degree:
        # Elements hold copies that are converted when compiled; their classes are written as they are.
        for joint in (default.joint for default in classes if default.joint.type != mujoco.mjtJoint.mjJNT_SLIDE):
            joint.range, joint.ref, joint.springref = np.deg2rad(joint.range), *np.deg2rad([joint.ref, joint.springref])
    for index, body in enumerate(spec.bodies):
        body.name = body.name or unused_name(f"body_{index}", spec.bodies)  # everything below goes by name
    # Where limits must be switched on explicitly they are, so this changes nothing but what may be left out.
    spec.compiler.autolimits = True
    spec.compiler.discardvisual = spec.compiler.fusestatic = False
    write_out_inertias(spec)
    return classes


def _read_robot(text: str, scale: float) -> tuple[mujoco.MjSpec, list[Any], float | None, list[str]]:
    """Return the robot without scenery at its final size, its classes, the timestep it asks for, and what changed."""
    document = copy.deepcopy(load_mjcf(text).document.root)
    timesteps = [option.get("timestep", "") for option in document.findall("option")]
    put_aside = [element for name in _OF_THE_ENVIRONMENT for element in document.findall(name)]
    for element in put_aside:
        document.remove(element)
    spec = mujoco.MjSpec.from_string(etree.tostring(document, encoding="unicode"))
    classes = _prepare(spec, document)
    for default in classes:
        # Attaching gives assets their prefix, but not where a class names one. Elements name their own.
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
    """Return the functional part, having looked up every name that a placement or a task uses.

    Raises:
        MjcfError: Some of them do not exist.
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
    """Return names in a sentence, the first of many."""
    found = list(dict.fromkeys(name for name in names if name))
    rest = len(found) - _NAMES_LISTED
    return ", ".join(found[:_NAMES_LISTED]) + (f" and {rest} more" if rest > 0 else "")


def _yield_contact_settings(robot: mujoco.MjSpec, classes: Sequence[Any], environment: mujoco.MjSpec) -> None:
    """Let the environment decide on contacts with it, and make those among robot parts as stiff as can be."""
    lowest = min((geom.priority for geom in environment.geoms), default=0)
    for geom in (*robot.geoms, *(default.geom for default in classes)):
        geom.priority = min(geom.priority, lowest - 1)
        geom.solref = solref(environment.option.timestep)


def _common_timestep(environment_s: float, robot_s: float | None, scale: float) -> tuple[float, list[str]]:
    """Return the scene's timestep [s]: the environment's, or a whole fraction of it where the robot needs less.

    Scaled matter moves in scaled time (`aidsr.sim.scaling`), so a smaller robot needs a smaller step to be as stable.
    If it is only a little smaller, that is left to the validation of the scene: half the step is twice the work.
    The whole number keeps control periods that are multiples of the environment's step what they are.
    """
    asked_s = min(environment_s, robot_s or environment_s) * (1.0 if _LITTLE_SMALLER <= scale < 1.0 else scale)
    parts = max(1, math.ceil(environment_s / asked_s - 1e-9))
    if parts == 1:
        return environment_s, []
    why = "is smaller now" if robot_s is None or robot_s >= environment_s else f"asks for {robot_s:g} s"
    return environment_s / parts, [f"Divided the timestep of {environment_s:g} s by {parts}: the robot {why}."]


def _write(scene: mujoco.MjSpec) -> str:
    """Return a scene as MJCF that has been loaded once."""
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
