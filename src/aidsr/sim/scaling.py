"""Scaling of a robot to another size with the same material.

Scaling by s is a change of units: every length is multiplied by s, every mass by s^3 (same density), every time by s.
The factor on time follows from the material: Young's modulus has the unit kg m^-1 s^-2 and stays constant only if
s^3 s^-1 t^-2 = 1, so t = s. A robot twice as large swings half as fast. Each attribute is multiplied by the factor for
its unit: inertias by s^5, bending stiffness E I / l by s^3, tendon stiffness E A / l by s, tendon forces (strength of a
cross-section) by s^2, torques by s^3, bending damping by s^4, which keeps damping ratios constant. Gravity belongs to
the environment and is not scaled: the larger robot sags more under its own weight, as in nature.

Source: dimensional analysis; units of the attributes from the MuJoCo XML reference. `docs/physics.md` has the table.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.core.errors import MjcfError
from aidsr.mjcf.compile import parse_mjcf
from aidsr.sandbox.isolated import isolated
from aidsr.sim.actuation_scaling import actuator_coordinate, has_scaling_rule, scale_actuator
from aidsr.sim.unit_scaling import Coordinate, Units

_LENGTH_JOINTS = (mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_FREE)
_SITE_LENGTHS = ("pos", "size", "fromto")
_CAMERA_LENGTHS = ("pos", "ipd", "focal_length", "principal_length", "sensor_size")
_SHELL = mujoco.mjtGeomInertia.mjINERTIA_SHELL
_EQ = mujoco.mjtEq
_SENS = mujoco.mjtSensor

_SENSOR_UNITS: dict[Any, tuple[int, int, int]] = {
    _SENS.mjSENS_TOUCH: (1, 1, -2),
    _SENS.mjSENS_FORCE: (1, 1, -2),
    _SENS.mjSENS_TORQUE: (1, 2, -2),
    _SENS.mjSENS_ACCELEROMETER: (0, 1, -2),
    _SENS.mjSENS_VELOCIMETER: (0, 1, -1),
    _SENS.mjSENS_GYRO: (0, 0, -1),
    _SENS.mjSENS_RANGEFINDER: (0, 1, 0),
    _SENS.mjSENS_BALLANGVEL: (0, 0, -1),
    _SENS.mjSENS_FRAMEPOS: (0, 1, 0),
    _SENS.mjSENS_FRAMELINVEL: (0, 1, -1),
    _SENS.mjSENS_FRAMEANGVEL: (0, 0, -1),
    _SENS.mjSENS_FRAMELINACC: (0, 1, -2),
    _SENS.mjSENS_FRAMEANGACC: (0, 0, -2),
    _SENS.mjSENS_SUBTREECOM: (0, 1, 0),
    _SENS.mjSENS_SUBTREELINVEL: (0, 1, -1),
    _SENS.mjSENS_SUBTREEANGMOM: (1, 2, -1),
    _SENS.mjSENS_GEOMDIST: (0, 1, 0),
    _SENS.mjSENS_GEOMFROMTO: (0, 1, 0),
    _SENS.mjSENS_E_POTENTIAL: (1, 2, -2),
    _SENS.mjSENS_E_KINETIC: (1, 2, -2),
    _SENS.mjSENS_CLOCK: (0, 0, 1),
}
"""Powers of mass, length and time in the unit of a sensor; all other sensors measure a generalized coordinate, its rate
or force, or a dimensionless number."""

_POSITION_SENSORS = (
    _SENS.mjSENS_JOINTPOS,
    _SENS.mjSENS_TENDONPOS,
    _SENS.mjSENS_ACTUATORPOS,
    _SENS.mjSENS_JOINTLIMITPOS,
    _SENS.mjSENS_TENDONLIMITPOS,
)
_VELOCITY_SENSORS = (
    _SENS.mjSENS_JOINTVEL,
    _SENS.mjSENS_TENDONVEL,
    _SENS.mjSENS_ACTUATORVEL,
    _SENS.mjSENS_JOINTLIMITVEL,
    _SENS.mjSENS_TENDONLIMITVEL,
)
_FORCE_SENSORS = (
    _SENS.mjSENS_ACTUATORFRC,
    _SENS.mjSENS_JOINTACTFRC,
    _SENS.mjSENS_TENDONACTFRC,
    _SENS.mjSENS_JOINTLIMITFRC,
    _SENS.mjSENS_TENDONLIMITFRC,
)

_Coordinates = Mapping[tuple[str, str], Coordinate]
"""Coordinates by kind ("joint", "tendon", "actuator") and name."""


@isolated
def resize_robot(mjcf: str, factor: float) -> str:
    """Return the MJCF of a robot scaled by `factor` with the same material.

    Raises:
        MjcfError: The robot cannot be loaded, or a part of it has no scaling rule.
        IsolationError: Loading exceeded its limits of time or memory.
    """
    spec = parse_mjcf(mjcf)
    scale_robot(spec, factor)
    spec.compile()
    return str(spec.to_xml())


def scale_robot(spec: mujoco.MjSpec, factor: float, classes: Iterable[Any] = ()) -> None:
    """Scale a robot by `factor` with the same material, in place.

    Args:
        spec: Parsed robot, not attached to a scene.
        factor: New lengths divided by old lengths.
        classes: Default classes of the robot; see `change_units`.

    Raises:
        MjcfError: A part of the robot has no scaling rule.
    """
    change_units(spec, Units.same_material(factor), classes)


def change_units(spec: mujoco.MjSpec, units: Units, classes: Iterable[Any] = ()) -> None:
    """Multiply every physical attribute of a model by the factor for its unit, in place.

    A parsed element holds its own copy of the values of its default class, so each value is multiplied once, whether
    the classes are scaled or not. Gravity, the medium, keyframes and user data are not changed.

    Args:
        spec: Parsed model, not attached to a scene.
        units: Factors on mass, length and time.
        classes: Default classes to scale as well, so that they agree with the elements and the MJCF stays short.

    Raises:
        MjcfError: A part of the model has no scaling rule.
    """
    _check_scalable(spec)
    spec.option.timestep *= units.time
    _scale_bodies(spec, units)
    for geom in spec.geoms:
        _scale_geom(geom, units)
    coordinates: dict[tuple[str, str], Coordinate] = {}
    for joint in spec.joints:
        coordinate = Coordinate(units, is_length=joint.type in _LENGTH_JOINTS)
        coordinates["joint", joint.name] = coordinate
        _scale_joint(joint, coordinate)
    for tendon in spec.tendons:
        coordinate = Coordinate(units, is_length=_tendon_is_length(tendon, coordinates))
        coordinates["tendon", tendon.name] = coordinate
        _scale_tendon(tendon, coordinate)
    for actuator in spec.actuators:
        coordinate = actuator_coordinate(actuator, coordinates, units)
        coordinates["actuator", actuator.name] = coordinate
        scale_actuator(actuator, coordinate)
    for equality in spec.equalities:
        _scale_equality(equality, coordinates, units)
    for pair in spec.pairs:
        _scale_pair(pair, units)
    for sensor in spec.sensors:
        _scale_sensor(sensor, coordinates, units)
    for default in classes:
        _scale_class(default, units)


def _scale_class(default: Any, units: Units) -> None:
    _scale_geom(default.geom, units)
    _scale_pair(default.pair, units)
    _scale_joint(default.joint, Coordinate(units, is_length=default.joint.type in _LENGTH_JOINTS))
    _scale_tendon(default.tendon, Coordinate(units, is_length=True))
    _multiply(default.site, units.length, *_SITE_LENGTHS)
    _multiply(default.camera, units.length, *_CAMERA_LENGTHS)


def _check_scalable(spec: mujoco.MjSpec) -> None:
    found = [f'actuator "{a.name}"' for a in spec.actuators if not has_scaling_rule(a)]
    found += [f'fixed tendon "{t.name}" (it mixes hinge and slide joints)' for t in spec.tendons if _mixes(t, spec)]
    found += [f'flex "{flex.name}"' for flex in spec.flexes] + [f'skin "{skin.name}"' for skin in spec.skins]
    if found:
        fault = Fault(
            code="load_error",
            layer="load",
            severity="error",
            message=f"cannot scale {', '.join(found)}",
            cure="write the robot at the size it should have and place it with scale 1",
        )
        raise MjcfError([fault])


def _multiply(element: Any, factor: float, *attributes: str) -> None:
    for attribute in attributes:
        setattr(element, attribute, getattr(element, attribute) * factor)


def _scale_bodies(spec: mujoco.MjSpec, units: Units) -> None:
    compiler = spec.compiler
    compiler.boundmass *= units.mass
    compiler.boundinertia *= units.of(mass=1, length=2)
    if compiler.settotalmass > 0:
        compiler.settotalmass *= units.mass
    for frame in spec.frames:
        _multiply(frame, units.length, "pos")
    for body in spec.bodies:
        _multiply(body, units.length, "pos", "ipos")
        _multiply(body, units.mass, "mass")
        _multiply(body, units.of(mass=1, length=2), "inertia", "fullinertia")
    for site in spec.sites:
        _multiply(site, units.length, *_SITE_LENGTHS)
    for camera in spec.cameras:
        _multiply(camera, units.length, *_CAMERA_LENGTHS)
    for mesh in spec.meshes:
        _multiply(mesh, units.length, "scale")
    for hfield in spec.hfields:
        _multiply(hfield, units.length, "size")


def _scale_geom(geom: Any, units: Units) -> None:
    _multiply(geom, units.length, "pos", "size", "fromto", "margin", "gap")
    _multiply(geom, units.mass, "mass")
    _multiply(geom, units.of(mass=1, length=-2 if geom.typeinertia == _SHELL else -3), "density")
    _multiply(geom, units.force, "adhesion")
    geom.friction = geom.friction * np.array([1.0, units.length, units.length])
    geom.surfacevel = geom.surfacevel * np.repeat([units.of(length=1, time=-1), units.of(time=-1)], 3)
    _scale_solver(geom, "solref", "solimp", units.length, units)


def _scale_solver(element: Any, solref: str, solimp: str, width: float, units: Units) -> None:
    """Scale `solref` and the width in `solimp` of a constraint.

    A positive `solref` is a time constant and a damping ratio; a negative one is a stiffness and a damping per mass.
    """
    reference = getattr(element, solref)
    direct = reference[0] <= 0
    factors = [units.of(time=-2), units.of(time=-1)] if direct else [units.time, 1.0]
    setattr(element, solref, reference * np.array(factors))
    impedance = getattr(element, solimp)
    impedance[2] *= width
    setattr(element, solimp, impedance)


def _scale_joint(joint: Any, coordinate: Coordinate) -> None:
    units = coordinate.units
    _multiply(joint, units.length, "pos")
    _multiply(joint, coordinate.value(), "range", "ref", "springref", "margin")
    joint.springdamper = joint.springdamper * np.array([units.time, 1.0])
    _scale_dynamics(joint, coordinate)


def _scale_tendon(tendon: Any, coordinate: Coordinate) -> None:
    _multiply(tendon, coordinate.units.length, "width")
    _multiply(tendon, coordinate.value(), "range", "margin")
    # -1 makes the compiler use the length in the reference pose.
    tendon.springlength = np.where(tendon.springlength == -1, -1, tendon.springlength * coordinate.value())
    _scale_dynamics(tendon, coordinate)


def _scale_dynamics(element: Any, coordinate: Coordinate) -> None:
    """Scale the attributes that joints and tendons have in common."""
    element.stiffness = element.stiffness * np.array(coordinate.stiffness)
    element.damping = element.damping * np.array(coordinate.damping)
    _multiply(element, coordinate.inertia, "armature")
    _multiply(element, coordinate.force, "frictionloss", "actfrcrange")
    for kind in ("limit", "friction"):
        _scale_solver(element, f"solref_{kind}", f"solimp_{kind}", coordinate.value(), coordinate.units)


def _tendon_is_length(tendon: Any, coordinates: _Coordinates) -> bool:
    """Return whether a tendon's coordinate is a length; that of a fixed tendon over hinges is a sum of angles."""
    first = tendon.path[0]
    if first.type != mujoco.mjtWrap.mjWRAP_JOINT:
        return True
    return coordinates["joint", first.target.name].is_length


def _mixes(tendon: Any, spec: mujoco.MjSpec) -> bool:
    joints = [wrap.target.name for wrap in tendon.path if wrap.type == mujoco.mjtWrap.mjWRAP_JOINT]
    return len({spec.joint(name).type in _LENGTH_JOINTS for name in joints}) > 1


def _scale_equality(equality: Any, coordinates: _Coordinates, units: Units) -> None:
    data = equality.data
    width = units.length
    if equality.type == _EQ.mjEQ_CONNECT:
        data[:3] *= units.length
    elif equality.type == _EQ.mjEQ_WELD:
        data[:6] *= units.length
        data[10] *= units.length
    elif equality.type in (_EQ.mjEQ_JOINT, _EQ.mjEQ_TENDON):
        kind = "joint" if equality.type == _EQ.mjEQ_JOINT else "tendon"
        first = coordinates[kind, equality.name1]
        second = coordinates.get((kind, equality.name2), Coordinate(units, is_length=False))
        data[:5] *= [first.value() * second.value(-power) for power in range(5)]
        width = first.value()
    equality.data = data
    _scale_solver(equality, "solref", "solimp", width, units)


def _scale_pair(pair: Any, units: Units) -> None:
    _multiply(pair, units.length, "margin", "gap")
    _multiply(pair, units.force, "adhesion")
    pair.friction = pair.friction * np.array([1.0, 1.0, units.length, units.length, units.length])
    _scale_solver(pair, "solref", "solimp", units.length, units)
    if pair.solreffriction[0] > 0:
        pair.solreffriction = pair.solreffriction * np.array([units.time, 1.0])
    else:
        pair.solreffriction = pair.solreffriction * np.array([units.of(time=-2), units.of(time=-1)])


def _scale_sensor(sensor: Any, coordinates: _Coordinates, units: Units) -> None:
    _multiply(sensor, units.time, "delay", "interval")
    if sensor.type in _SENSOR_UNITS:
        mass, length, time = _SENSOR_UNITS[sensor.type]
        _multiply(sensor, units.of(mass=mass, length=length, time=time), "cutoff", "noise")
        return
    kinds = {mujoco.mjtObj.mjOBJ_JOINT: "joint", mujoco.mjtObj.mjOBJ_TENDON: "tendon"}
    coordinate = coordinates.get((kinds.get(sensor.objtype, "actuator"), sensor.objname))
    if coordinate is None:
        return
    if sensor.type in _POSITION_SENSORS:
        _multiply(sensor, coordinate.value(), "cutoff", "noise")
    elif sensor.type in _VELOCITY_SENSORS:
        _multiply(sensor, coordinate.value(time=-1), "cutoff", "noise")
    elif sensor.type in _FORCE_SENSORS:
        _multiply(sensor, coordinate.force, "cutoff", "noise")
