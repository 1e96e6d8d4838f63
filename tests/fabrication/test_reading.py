"""What is read off a robot: how hard a cable is pulled."""

import math

import pytest
from fingers import finger

from aidsr.fabrication.anatomy import read_anatomy

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
