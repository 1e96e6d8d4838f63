"""What is read off a robot: how hard a cable is pulled, and what of it nobody builds."""

import math

import pytest
from fingers import WINCH, finger

from aidsr.fabrication.anatomy import read_anatomy
from aidsr.fabrication.making import make
from aidsr.fabrication.printers import printer_named

MOTOR = '<motor tendon="flex" gear="{}" {}/>'


@pytest.mark.parametrize(
    ("gear", "limits", "pull_n"),
    [
        (-10, 'forcerange="0 1"', 10.0),
        (10, 'forcerange="-1 0.5"', 10.0),
        (10, 'forcerange="0 1"', 0.0),
        (-10, "", math.inf),
    ],
)
def test_a_cable_feels_the_force_times_the_gear(gear: int, limits: str, pull_n: float) -> None:
    cable, _ = read_anatomy(finger(actuators=MOTOR.format(gear, limits))).cables
    assert cable.largest_pull_n == pytest.approx(pull_n)


TWICE = "".join(WINCH.format(name=name, tendon="flex") for name in ("strong", "weak"))
COUPLED = '<equality><joint name="same" joint1="bend_1" joint2="bend_2" active="{}"/></equality>'


@pytest.mark.parametrize(
    ("mjcf", "told"),
    [
        (finger(), set()),
        (finger(actuators=TWICE), {("cable_shared", "flex")}),
        (finger(extra=COUPLED.format("true")), {("joints_coupled", "same")}),
        (finger(extra=COUPLED.format("false")), set()),
        (finger().replace('name="link_1"', 'name="link_1" gravcomp="1"'), {("weight_lifted", "link_1")}),
        (finger().replace('name="base"', 'name="base" gravcomp="1"'), set()),
    ],
)
def test_what_nobody_builds_is_told(mjcf: str, told: set[tuple[str, str]]) -> None:
    faults = make(mjcf, [], printer_named("fdm")).faults
    codes = ("cable_shared", "joints_coupled", "weight_lifted")
    assert {(fault.code, name) for fault in faults if fault.code in codes for name in fault.names} == told
