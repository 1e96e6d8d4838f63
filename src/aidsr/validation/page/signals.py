"""What each kind of fault was read off, over time. A fault that is no matter of time has no signal."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.sim.rollout import Recording
from aidsr.validation.page.sampling import Array, signal
from aidsr.validation.page.traces import Signal
from aidsr.validation.points import displacements, last_quarter
from aidsr.validation.protocol import STANDARD_GRAVITY_M_S2
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rules.motion import describe_test

_MOST_CURVES = 6
_OF_LENGTH = "of the robot's length"
_SETTLING = "settling, when nothing is driven"


def signal_of(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    """Return what a fault was read off; None where nothing moved, or it is no matter of time."""
    if robot.evidence is None or fault.code not in _SIGNALS:
        return None
    return _SIGNALS[fault.code](robot, fault)


def moved_over_length(robot: RobotUnderTest) -> Array:
    """Largest displacement of any point against the reference / L, (n_tests, n_frames)."""
    battery = _battery(robot)
    ways = displacements(battery, robot.structure, robot.model, reference=0)
    moved = np.linalg.norm(ways, axis=-1).max(axis=2, initial=0.0)
    return np.asarray(moved / robot.length_m)


def _battery(robot: RobotUnderTest) -> Recording:
    battery = robot.driven.battery
    if battery is None:
        raise RuntimeError("this signal needs the driven phase")
    return battery


def _divergence(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    """Speed of the fastest part of whatever diverged first, up to where numbers end."""
    evidence = robot.driven
    phases = [(_SETTLING, evidence.settle, 0)]
    if evidence.battery is not None:
        phases += [(describe_test(robot, row), evidence.battery, row) for row in range(len(evidence.tests))]
    for test, recording, row in phases:
        if robot.first_divergence(recording, row) is None:
            continue
        count = max(1, int(recording.good_frames[row]))
        dofs = [dof for dof in range(robot.model.nv) if int(robot.model.dof_jntid[dof]) in robot.structure.joints]
        by_joint = fault.unit != "m/s" and dofs
        values = recording.fastest[row][:, dofs] if by_joint else recording.speed_m_s[row]
        unit, limit = ("rad/s", robot.limits.joint_speed_rad_s) if by_joint else ("m/s", robot.limits.body_speed_m_s)
        curve = {"fastest joint" if by_joint else "fastest body": values[:count].max(axis=1)}
        return signal("speed", unit, test, recording.frame_s, curve, (limit,), fault.first_time_s, logarithmic=True)
    return None


def _chatter(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    evidence, body = robot.driven, _named(robot, fault.names[0])
    rows = [(_SETTLING, evidence.settle, 0)]
    if evidence.battery is not None:
        rows += [
            (describe_test(robot, row), evidence.battery, row)
            for row in robot.sound_tests
            if evidence.tests[row].kind != "sweep"
        ]
    test, recording, row = max(
        rows, key=lambda r: float(last_quarter(r[1].acceleration_m_s2[r[2]], axis=0)[:, body].mean())
    )
    curve = recording.acceleration_m_s2[row][:, body] / STANDARD_GRAVITY_M_S2
    limits = (fault.limit,) if fault.limit is not None else ()
    return signal("acceleration", "g", test, recording.frame_s, {fault.names[0]: curve}, limits)


def _deformation(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    evidence, point = robot.driven, robot.structure.bodies.index(_named(robot, fault.names[0]))
    moved = np.linalg.norm(evidence.settling_m[:, :, point] - evidence.drawn_m[point], axis=-1) / robot.length_m
    curves = {"as it is": moved[0], "without gravity": moved[1]}
    if fault.code == "underdamped":
        return signal(f"way of {fault.names[0]} from where it is drawn", _OF_LENGTH, _SETTLING, _frame_s(robot), curves)
    quantity = f"way of {fault.names[0]} from where it is drawn"
    limits = (fault.limit,) if fault.limit is not None else ()
    return signal(quantity, _OF_LENGTH, _SETTLING, _frame_s(robot), curves, limits)


def _frame_s(robot: RobotUnderTest) -> float:
    return robot.driven.settle.frame_s


def _drop(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    down = np.array(robot.model.opt.gravity)
    down /= np.linalg.norm(down)
    evidence = robot.driven
    curves: dict[str, Array] = {}
    for name in fault.names[:_MOST_CURVES]:
        root = _named(robot, name)
        way = (evidence.settle.fields["xpos"][0, :, root] - evidence.start.xpos[root]) @ down
        curves[name] = way / robot.length_m
    return signal("fall", _OF_LENGTH, _SETTLING, _frame_s(robot), curves, (robot.limits.drop,), fault.first_time_s)


def _energy(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    scale = robot.structure.mass_kg * STANDARD_GRAVITY_M_S2 * robot.length_m
    good = int(robot.driven.settle.good_frames[0])
    energy = robot.driven.settle.fields["energy"][0, :good].sum(axis=-1)
    if scale <= 0 or not good:
        return None
    curve = {"potential and kinetic": (energy - energy[0]) / scale}
    limits = (robot.limits.energy_growth,)
    return signal("rise of mechanical energy", "m g L", _SETTLING, _frame_s(robot), curve, limits, fault.first_time_s)


def _overrun(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    model, battery = robot.model, _battery(robot)
    joint = next(index for index in robot.structure.joints if robot.joint(index) == fault.names[0])
    degrees = np.degrees(battery.fields["qpos"][:, :, int(model.jnt_qposadr[joint])])
    low, high = np.degrees(model.jnt_range[joint])
    row = int(np.argmax(np.maximum(low - degrees.min(axis=1), degrees.max(axis=1) - high)))
    curves = {fault.names[0]: degrees[row]}
    return signal("angle", "deg", describe_test(robot, row), battery.frame_s, curves, (float(low), float(high)))


def _effect(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    moved = moved_over_length(robot)
    curves: dict[str, Array] = {}
    for drive in _drives(robot, fault.names) or range(len(robot.driven.drives)):
        rows = robot.single_tests([drive])
        if rows and len(curves) < _MOST_CURVES:
            best = max(rows, key=robot.effect_in)
            curves[robot.actuator(robot.driven.drives[drive].actuator)] = moved[best]
    test = "a test of each actuator alone, the others slack"
    return signal("largest displacement", _OF_LENGTH, test, _battery(robot).frame_s, curves, (robot.limits.effect,))


def _antagonists(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    moved, (drive, *_) = moved_over_length(robot), _drives(robot, fault.names)
    alone = max(robot.single_tests([drive]), key=robot.effect_in)
    told = next(row for row, test in enumerate(robot.driven.tests) if test.kind == "released" and test.drive == drive)
    curves = {"the others slack": moved[alone], "the others told to let go": moved[told]}
    limits = (robot.limits.lock_share * robot.effect_in(alone),)
    quantity, test = "largest displacement", f"tests in which {fault.names[0]} pulls"
    return signal(quantity, _OF_LENGTH, test, _battery(robot).frame_s, curves, limits)


def _sensors(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    model, battery, row = robot.model, _battery(robot), len(robot.driven.tests) - 1
    curves: dict[str, Array] = {}
    for sensor in robot.structure.sensors:
        if robot.sensor(sensor) in fault.names and len(curves) < _MOST_CURVES:
            values = battery.fields["sensordata"][row, :, int(model.sensor_adr[sensor])]
            curves[robot.sensor(sensor)] = values - values[0]
    return signal("change of the sensor", "", describe_test(robot, row), battery.frame_s, curves)


def _tension(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    return _of_actuators(robot, fault, "tension", lambda drive, _tendon: -robot.force_n(robot.driven.drives[drive]))


def _push(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    def forces(drive: int, _tendon: int) -> Array:
        return robot.force_n(robot.driven.drives[drive])

    shown = _of_actuators(robot, fault, "force, pushing up", forces)
    return None if shown is None else shown.model_copy(update={"limits": (0.0,)})


def _power(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    def power(drive: int, tendon: int) -> Array:
        reeling = np.maximum(-_battery(robot).fields["ten_velocity"][:, :, tendon], 0.0)
        return np.maximum(-robot.force_n(robot.driven.drives[drive]), 0.0) * reeling

    return _of_actuators(robot, fault, "mechanical power", power)


def _speed(robot: RobotUnderTest, fault: Fault) -> Signal | None:
    def speed(_drive: int, tendon: int) -> Array:
        sweep = np.array([test.kind == "sweep" for test in robot.driven.tests])[:, None]
        return np.where(sweep, 0.0, np.abs(_battery(robot).fields["ten_velocity"][:, :, tendon]))

    return _of_actuators(robot, fault, "cable speed", speed)


def _of_actuators(
    robot: RobotUnderTest, fault: Fault, quantity: str, values: Callable[[int, int], Array]
) -> Signal | None:
    """A quantity of the named actuators in the test in which it is largest, (n_tests, n_frames) from `values`."""
    drives = _drives(robot, fault.names)
    tendons = {drive: int(robot.model.actuator_trnid[robot.driven.drives[drive].actuator, 0]) for drive in drives}
    found = {drive: values(drive, tendons[drive]) for drive in drives}
    worst = max(found, key=lambda drive: float(found[drive].max()))
    row = int(np.argmax(found[worst].max(axis=1)))
    shown = [worst, *(drive for drive in drives if drive != worst)][:_MOST_CURVES]
    curves = {robot.actuator(robot.driven.drives[drive].actuator): found[drive][row] for drive in shown}
    limits = (fault.limit,) if fault.limit is not None else ()
    unit = "N" if fault.code == "tendon_pushes" else fault.unit
    return signal(quantity, unit, describe_test(robot, row), _battery(robot).frame_s, curves, limits)


def _drives(robot: RobotUnderTest, names: Sequence[str]) -> list[int]:
    drives = robot.driven.drives
    return [index for index, drive in enumerate(drives) if robot.actuator(drive.actuator) in names]


def _named(robot: RobotUnderTest, name: str) -> int:
    return next(body for body in robot.structure.bodies if robot.body(body) == name)


_SIGNALS: dict[str, Callable[[RobotUnderTest, Fault], Signal | None]] = {
    "numerical_instability": _divergence,
    "chatter": _chatter,
    "gravity_collapse": _deformation,
    "passive_collapse": _deformation,
    "underdamped": _deformation,
    "free_fall": _drop,
    "base_not_attached": _drop,
    "energy_growth": _energy,
    "limit_overrun": _overrun,
    "self_collision_lock": _effect,
    "tendon_against_limit": _effect,
    "mass_ratio": _effect,
    "actuator_too_weak": _effect,
    "too_stiff": _effect,
    "no_effect": _effect,
    "antagonist_lock": _antagonists,
    "sensor_constant": _sensors,
    "actuator_overforce": _tension,
    "tendon_pushes": _push,
    "actuator_power": _power,
    "actuator_speed": _speed,
}
