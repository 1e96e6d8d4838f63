"""What each kind of fault was read off, over time. A fault that is no matter of time has no signal."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.sim.rollout import Recording
from aidsr.validation.case import Case
from aidsr.validation.divergence import divergence
from aidsr.validation.page.sampling import Array, signal
from aidsr.validation.page.traces import Signal
from aidsr.validation.points import displacements, last_quarter
from aidsr.validation.protocol import STANDARD_GRAVITY_M_S2
from aidsr.validation.rules.motion import describe_test

__all__ = ["moved_over_length", "signal_of"]

_MOST_CURVES = 6
_OF_LENGTH = "of the robot's length"
_SETTLING = "settling, when nothing is driven"


def signal_of(case: Case, fault: Fault) -> Signal | None:
    """Return what a fault was read off; None where nothing moved, or it is no matter of time."""
    if case.evidence is None or fault.code not in _SIGNALS:
        return None
    return _SIGNALS[fault.code](case, fault)


def moved_over_length(case: Case) -> Array:
    """Largest displacement of any point against the reference / L, (n_tests, n_frames)."""
    battery = _battery(case)
    ways = displacements(battery, case.structure, case.model, reference=0)
    moved = np.linalg.norm(ways, axis=-1).max(axis=2, initial=0.0)
    return np.asarray(moved / case.length_m)


def _battery(case: Case) -> Recording:
    battery = case.driven.battery
    if battery is None:
        raise RuntimeError("this signal needs the driven phase")
    return battery


def _divergence(case: Case, fault: Fault) -> Signal | None:
    """Speed of the fastest part of whatever diverged first, up to where numbers end."""
    evidence = case.driven
    phases = [(_SETTLING, evidence.settle, 0)]
    if evidence.battery is not None:
        phases += [(describe_test(case, row), evidence.battery, row) for row in range(len(evidence.tests))]
    for test, recording, row in phases:
        if divergence(case, recording, row) is None:
            continue
        count = max(1, int(recording.good_frames[row]))
        dofs = [dof for dof in range(case.model.nv) if int(case.model.dof_jntid[dof]) in case.structure.joints]
        by_joint = fault.unit != "m/s" and dofs
        values = recording.fastest[row][:, dofs] if by_joint else recording.speed_m_s[row]
        unit, limit = ("rad/s", case.limits.joint_speed_rad_s) if by_joint else ("m/s", case.limits.body_speed_m_s)
        curve = {"fastest joint" if by_joint else "fastest body": values[:count].max(axis=1)}
        return signal("speed", unit, test, recording.frame_s, curve, (limit,), fault.first_time_s, logarithmic=True)
    return None


def _chatter(case: Case, fault: Fault) -> Signal | None:
    evidence, body = case.driven, _named(case, fault.names[0])
    rows = [(_SETTLING, evidence.settle, 0)]
    if evidence.battery is not None:
        rows += [
            (describe_test(case, row), evidence.battery, row)
            for row in case.sound_tests
            if evidence.tests[row].kind != "sweep"
        ]
    test, recording, row = max(
        rows, key=lambda r: float(last_quarter(r[1].acceleration_m_s2[r[2]], axis=0)[:, body].mean())
    )
    curve = recording.acceleration_m_s2[row][:, body] / STANDARD_GRAVITY_M_S2
    limits = (fault.limit,) if fault.limit is not None else ()
    return signal("acceleration", "g", test, recording.frame_s, {fault.names[0]: curve}, limits)


def _deformation(case: Case, fault: Fault) -> Signal | None:
    evidence, point = case.driven, case.structure.bodies.index(_named(case, fault.names[0]))
    moved = np.linalg.norm(evidence.settling_m[:, :, point] - evidence.drawn_m[point], axis=-1) / case.length_m
    curves = {"as it is": moved[0], "without gravity": moved[1]}
    if fault.code == "underdamped":
        return signal(f"way of {fault.names[0]} from where it is drawn", _OF_LENGTH, _SETTLING, _frame_s(case), curves)
    quantity = f"way of {fault.names[0]} from where it is drawn"
    limits = (fault.limit,) if fault.limit is not None else ()
    return signal(quantity, _OF_LENGTH, _SETTLING, _frame_s(case), curves, limits)


def _frame_s(case: Case) -> float:
    return case.driven.settle.frame_s


def _drop(case: Case, fault: Fault) -> Signal | None:
    down = np.array(case.model.opt.gravity)
    down /= np.linalg.norm(down)
    evidence = case.driven
    curves: dict[str, Array] = {}
    for name in fault.names[:_MOST_CURVES]:
        root = _named(case, name)
        way = (evidence.settle.fields["xpos"][0, :, root] - evidence.start.xpos[root]) @ down
        curves[name] = way / case.length_m
    return signal("fall", _OF_LENGTH, _SETTLING, _frame_s(case), curves, (case.limits.drop,), fault.first_time_s)


def _energy(case: Case, fault: Fault) -> Signal | None:
    scale = case.structure.mass_kg * STANDARD_GRAVITY_M_S2 * case.length_m
    good = int(case.driven.settle.good_frames[0])
    energy = case.driven.settle.fields["energy"][0, :good].sum(axis=-1)
    if scale <= 0 or not good:
        return None
    curve = {"potential and kinetic": (energy - energy[0]) / scale}
    limits = (case.limits.energy_growth,)
    return signal("rise of mechanical energy", "m g L", _SETTLING, _frame_s(case), curve, limits, fault.first_time_s)


def _overrun(case: Case, fault: Fault) -> Signal | None:
    model, battery = case.model, _battery(case)
    joint = next(index for index in case.structure.joints if case.joint(index) == fault.names[0])
    degrees = np.degrees(battery.fields["qpos"][:, :, int(model.jnt_qposadr[joint])])
    low, high = np.degrees(model.jnt_range[joint])
    row = int(np.argmax(np.maximum(low - degrees.min(axis=1), degrees.max(axis=1) - high)))
    curves = {fault.names[0]: degrees[row]}
    return signal("angle", "deg", describe_test(case, row), battery.frame_s, curves, (float(low), float(high)))


def _effect(case: Case, fault: Fault) -> Signal | None:
    moved = moved_over_length(case)
    curves: dict[str, Array] = {}
    for drive in _drives(case, fault.names) or range(len(case.driven.drives)):
        rows = case.single_tests([drive])
        if rows and len(curves) < _MOST_CURVES:
            best = max(rows, key=case.effect_in)
            curves[case.actuator(case.driven.drives[drive].actuator)] = moved[best]
    test = "a test of each actuator alone, the others slack"
    return signal("largest displacement", _OF_LENGTH, test, _battery(case).frame_s, curves, (case.limits.effect,))


def _antagonists(case: Case, fault: Fault) -> Signal | None:
    moved, (drive, *_) = moved_over_length(case), _drives(case, fault.names)
    alone = max(case.single_tests([drive]), key=case.effect_in)
    told = next(row for row, test in enumerate(case.driven.tests) if test.kind == "released" and test.drive == drive)
    curves = {"the others slack": moved[alone], "the others told to let go": moved[told]}
    limits = (case.limits.lock_share * case.effect_in(alone),)
    quantity, test = "largest displacement", f"tests in which {fault.names[0]} pulls"
    return signal(quantity, _OF_LENGTH, test, _battery(case).frame_s, curves, limits)


def _sensors(case: Case, fault: Fault) -> Signal | None:
    model, battery, row = case.model, _battery(case), len(case.driven.tests) - 1
    curves: dict[str, Array] = {}
    for sensor in case.structure.sensors:
        if case.sensor(sensor) in fault.names and len(curves) < _MOST_CURVES:
            values = battery.fields["sensordata"][row, :, int(model.sensor_adr[sensor])]
            curves[case.sensor(sensor)] = values - values[0]
    return signal("change of the sensor", "", describe_test(case, row), battery.frame_s, curves)


def _tension(case: Case, fault: Fault) -> Signal | None:
    return _of_actuators(case, fault, "tension", lambda drive, _tendon: -case.force_n(case.driven.drives[drive]))


def _push(case: Case, fault: Fault) -> Signal | None:
    def forces(drive: int, _tendon: int) -> Array:
        return case.force_n(case.driven.drives[drive])

    shown = _of_actuators(case, fault, "force, pushing up", forces)
    return None if shown is None else shown.model_copy(update={"limits": (0.0,)})


def _power(case: Case, fault: Fault) -> Signal | None:
    def power(drive: int, tendon: int) -> Array:
        reeling = np.maximum(-_battery(case).fields["ten_velocity"][:, :, tendon], 0.0)
        return np.maximum(-case.force_n(case.driven.drives[drive]), 0.0) * reeling

    return _of_actuators(case, fault, "mechanical power", power)


def _speed(case: Case, fault: Fault) -> Signal | None:
    def speed(_drive: int, tendon: int) -> Array:
        sweep = np.array([test.kind == "sweep" for test in case.driven.tests])[:, None]
        return np.where(sweep, 0.0, np.abs(_battery(case).fields["ten_velocity"][:, :, tendon]))

    return _of_actuators(case, fault, "cable speed", speed)


def _of_actuators(case: Case, fault: Fault, quantity: str, values: Callable[[int, int], Array]) -> Signal | None:
    """A quantity of the named actuators in the test in which it is largest, (n_tests, n_frames) from `values`."""
    drives = _drives(case, fault.names)
    tendons = {drive: int(case.model.actuator_trnid[case.driven.drives[drive].actuator, 0]) for drive in drives}
    found = {drive: values(drive, tendons[drive]) for drive in drives}
    worst = max(found, key=lambda drive: float(found[drive].max()))
    row = int(np.argmax(found[worst].max(axis=1)))
    shown = [worst, *(drive for drive in drives if drive != worst)][:_MOST_CURVES]
    curves = {case.actuator(case.driven.drives[drive].actuator): found[drive][row] for drive in shown}
    limits = (fault.limit,) if fault.limit is not None else ()
    unit = "N" if fault.code == "tendon_pushes" else fault.unit
    return signal(quantity, unit, describe_test(case, row), _battery(case).frame_s, curves, limits)


def _drives(case: Case, names: Sequence[str]) -> list[int]:
    drives = case.driven.drives
    return [index for index, drive in enumerate(drives) if case.actuator(drive.actuator) in names]


def _named(case: Case, name: str) -> int:
    return next(body for body in case.structure.bodies if case.body(body) == name)


_SIGNALS: dict[str, Callable[[Case, Fault], Signal | None]] = {
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
