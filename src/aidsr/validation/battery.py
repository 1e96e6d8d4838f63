"""The tests of the battery: the command of each actuator and the slack tendons in each test."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from aidsr.sim.drive import Drive

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BatteryTest:
    """One row of the battery.

    Attributes:
        kind: "reference": all tendons slack, other actuators at their neutral command. "rest": every actuator at its
            neutral command. "single": one actuator at one end of its control range, the other tendons slack.
            "released": one tendon actuator at its pulling end, the other tendons commanded to release. "all": every
            actuator at its pulling end. "sweep": random ends of the control ranges.
        drive: Index in `Evidence.drives` of the actuator of a "single" or "released" test; -1 in other tests.
        command: Command of that actuator at the end of the ramp.
    """

    kind: Literal["reference", "rest", "single", "released", "all", "sweep"]
    drive: int = -1
    command: float = 0.0


def list_tests(drives: Sequence[Drive]) -> tuple[BatteryTest, ...]:
    """Return the tests of some actuators, the reference first."""
    tests = [BatteryTest("reference"), BatteryTest("rest")]
    for index, drive in enumerate(drives):
        ends = [end for end in (drive.low, drive.high) if not math.isclose(end, drive.neutral, abs_tol=1e-12)]
        tests += [BatteryTest("single", index, end) for end in ends]
        others = [other for other in drives if other is not drive and other.on_tendon and other.ranged]
        # if all others go slack when released, the test is the same as "single", in which they are disabled
        if drive.on_tendon and drive.ranged and not all(other.goes_slack for other in others):
            tests.append(BatteryTest("released", index, drive.pull))
    if drives:
        tests += [BatteryTest("all"), BatteryTest("sweep")]
    return tuple(tests)


def slack_in(test: BatteryTest, drives: Sequence[Drive]) -> tuple[int, ...]:
    """Return the ids of the tendon actuators that are disabled during a test.

    A tendon actuator without a control range is enabled only in its own tests.
    """
    alone = test.kind in ("reference", "single")
    return tuple(
        drive.actuator
        for index, drive in enumerate(drives)
        if drive.on_tendon and index != test.drive and (alone or not drive.ranged)
    )


def commands_at_end(test: BatteryTest, neutral: Array, drives: Sequence[Drive]) -> Array:
    """Return the commands of a test at the end of the ramp, (nu,)."""
    target = neutral.copy()
    for index, drive in enumerate(drives):
        if index == test.drive:
            target[drive.ctrl] = test.command
        elif not drive.ranged:
            continue
        elif test.kind == "released" and drive.on_tendon:
            target[drive.ctrl] = drive.release
        elif test.kind == "all":
            target[drive.ctrl] = drive.pull
    return target


def random_commands(neutral: Array, drives: Sequence[Drive], frames: int, hold: int, seed: int) -> Array:
    """Return commands that are random ends of the control ranges, (n_frames, nu).

    All change together every `hold` frames. An actuator without a control range stays at its neutral command.
    """
    rng = np.random.default_rng(seed)
    ctrl = np.tile(neutral, (frames, 1))
    for begin in range(0, frames, hold):
        for drive in (drive for drive in drives if drive.ranged):
            ctrl[begin : begin + hold, drive.ctrl] = rng.choice((drive.low, drive.high))
    return ctrl
