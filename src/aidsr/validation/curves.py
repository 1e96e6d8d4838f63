"""Helpers with which rules make their signals: curves over time that show a fault."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Fault
from aidsr.sim.rollout import Recording
from aidsr.validation.points import displacements
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.signals import Line, Signal

Array = NDArray[np.float64]

MAX_CURVES = 6
OF_LENGTH = "of the robot's length"
SETTLING = "settling, when nothing is driven"
_MAX_POINTS = 240
"""Most points of a curve: two for each millimetre of a plot 120 mm wide."""
_DIGITS = 5


def make_signal(
    quantity: str,
    unit: str,
    test: str,
    frame_s: float,
    curves: dict[str, Array],
    limits: tuple[float, ...] = (),
    first_bad_s: float | None = None,
    logarithmic: bool = False,
) -> Signal | None:
    """Return a signal made of curves of equal length, or None without any curve.

    Args:
        quantity: What the curves show, in words.
        unit: Unit of the curves.
        test: Description of the test.
        frame_s: Time between frames [s].
        curves: Values of each curve, (n_frames,), by label.
        limits: Limits to draw, in `unit`.
        first_bad_s: Time at which the fault first showed [s].
        logarithmic: Whether the axis of values is logarithmic.
    """
    if not curves:
        return None
    frames = len(next(iter(curves.values())))
    return Signal(
        quantity=quantity,
        unit=unit,
        test=test,
        time_s=downsample(np.arange(1.0, frames + 1) * frame_s),
        lines=tuple(Line(label=label, values=downsample(values)) for label, values in curves.items()),
        limits=limits,
        first_bad_s=first_bad_s,
        logarithmic=logarithmic,
    )


def downsample(values: Array) -> tuple[float, ...]:
    """Return at most `_MAX_POINTS` values of a curve, rounded to `_DIGITS` digits; infinity is 1e300, NaN is 0."""
    shown = np.nan_to_num(values[_shown_frames(len(values))], nan=0.0, posinf=1e300, neginf=-1e300)
    return tuple(float(f"{value:.{_DIGITS}g}") for value in shown)


def _shown_frames(frames: int) -> NDArray[np.int64]:
    """Return the indices of the frames that are shown, evenly spaced, with the first and the last frame."""
    return np.unique(np.linspace(0, frames - 1, min(frames, _MAX_POINTS)).round().astype(int))


def limits_of(fault: Fault) -> tuple[float, ...]:
    """Return the limit of a fault, or nothing if it has none."""
    return () if fault.limit is None else (fault.limit,)


def battery_of(robot: RobotUnderTest) -> Recording:
    """Return the recording of the driven phase.

    Raises:
        RuntimeError: The simulation of settling failed, so that there is no driven phase.
    """
    battery = robot.driven.battery
    if battery is None:
        raise RuntimeError("this signal needs the driven phase")
    return battery


def moved_over_length(robot: RobotUnderTest) -> Array:
    """Return the largest displacement of any point from the reference test / L, (n_tests, n_frames)."""
    displacements_m = displacements(battery_of(robot), robot.structure, robot.model, reference=0)
    moved = np.linalg.norm(displacements_m, axis=-1).max(axis=2, initial=0.0)
    return np.asarray(moved / robot.length_m)


def find_drives(robot: RobotUnderTest, names: Sequence[str]) -> list[int]:
    """Return the indices in `Evidence.drives` of the actuators with some names."""
    drives = robot.driven.drives
    return [index for index, drive in enumerate(drives) if robot.actuator(drive.actuator) in names]


def find_body(robot: RobotUnderTest, name: str) -> int:
    """Return the id of the robot's body with a name; the name may be one that was generated for a nameless body."""
    return next(body for body in robot.structure.bodies if robot.body(body) == name)


def settling_signal(robot: RobotUnderTest, fault: Fault, limits: tuple[float, ...]) -> Signal | None:
    """Return the displacement of the fault's first body from the reference pose during settling.

    One curve with the model's gravity and one without gravity.
    """
    evidence, point = robot.driven, robot.structure.bodies.index(find_body(robot, fault.names[0]))
    moved = np.linalg.norm(evidence.settling_m[:, :, point] - evidence.drawn_m[point], axis=-1) / robot.length_m
    curves = {"as it is": moved[0], "without gravity": moved[1]}
    quantity = f"way of {fault.names[0]} from where it is drawn"
    return make_signal(quantity, OF_LENGTH, SETTLING, evidence.settle.frame_s, curves, limits)


def actuator_signal(
    robot: RobotUnderTest, fault: Fault, quantity: str, unit: str, values: Callable[[int, int], Array]
) -> Signal | None:
    """Return a quantity of the fault's actuators over time, in the test in which it is largest.

    Args:
        robot: The tested robot.
        fault: The fault; its names are those of the actuators.
        quantity: What `values` are, in words.
        unit: Unit of the values.
        values: Function that returns the values of one actuator, (n_tests, n_frames), given its index in
            `Evidence.drives` and the id of its tendon.
    """
    drives = find_drives(robot, fault.names)
    tendons = {drive: int(robot.model.actuator_trnid[robot.driven.drives[drive].actuator, 0]) for drive in drives}
    found = {drive: values(drive, tendons[drive]) for drive in drives}
    worst = max(found, key=lambda drive: float(found[drive].max()))
    row = int(np.argmax(found[worst].max(axis=1)))
    shown = [worst, *(drive for drive in drives if drive != worst)][:MAX_CURVES]
    curves = {robot.actuator(robot.driven.drives[drive].actuator): found[drive][row] for drive in shown}
    frame_s = battery_of(robot).frame_s
    return make_signal(quantity, unit, robot.describe_test(row), frame_s, curves, limits_of(fault))
