"""Negative damping is found wherever MuJoCo has a damping: joints, tendons and actuators, linear or polynomial."""

from __future__ import annotations

import pytest

from aidsr.validation import validate
from aidsr.validation.rules_page import EXAMPLE_ARM

TENDON, MOTOR = '<spatial name="front"', '<motor name="pull_front"'


@pytest.mark.parametrize(
    ("old", "new", "name"),
    [
        ('damping="0.05"', 'damping="0.05 -1e-4 0"', "j1"),
        ('damping="0.05"', 'damping="0.05 0 -1e-4"', "j1"),
        (TENDON, f'{TENDON} damping="-0.01"', "front"),
        (TENDON, f'{TENDON} damping="0.1 0 -0.01"', "front"),
        (MOTOR, f'{MOTOR} damping="-0.01"', "pull_front"),
        (MOTOR, f'{MOTOR} damping="0.1 -0.01 0"', "pull_front"),
    ],
)
def test_negative_damping_of_any_kind_is_found(old: str, new: str, name: str) -> None:
    assert old in EXAMPLE_ARM
    faults = [
        fault
        for fault in validate(EXAMPLE_ARM.replace(old, new), select=["energy_growth"]).errors
        if "negative damping" in fault.message
    ]
    assert len(faults) == 1
    assert name in faults[0].names
    assert faults[0].measured < 0


def test_positive_damping_of_any_kind_is_not() -> None:
    text = EXAMPLE_ARM.replace('damping="0.05"', 'damping="0.05 0.01 0.01"').replace(
        TENDON, f'{TENDON} damping="0.1 1 1"'
    )
    assert validate(text.replace(MOTOR, f'{MOTOR} damping="0.1"'), select=["energy_growth"]).errors == ()
