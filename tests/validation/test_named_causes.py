"""Causes that the validator names because it has tried: without them the symptom is gone."""

import pytest
from tests.validation.robots import arm

from aidsr.core.artifacts import Fault
from aidsr.validation import validate
from aidsr.validation.registry import require_rule
from aidsr.validation.rules_page import EXAMPLE_ARM


def the_fault(code: str, mjcf: str) -> Fault:
    (found,) = (fault for fault in validate(mjcf).faults if fault.code == code)
    return found


def changed(*changes: tuple[str, str]) -> str:
    text = EXAMPLE_ARM
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return text


@pytest.mark.parametrize(
    ("mistake", "cause", "cure"),
    [
        (('stiffness="1" damping="0.05"', 'stiffness="400" damping="0"'), "joint damping", "damping of 0.02 s"),
        (('ctrlrange="0 20"', 'ctrlrange="0 400000"'), "weaker actuators", "weaker"),
    ],
    ids=["damping", "force"],
)
def test_what_makes_a_robot_diverge_is_found_by_trial(mistake: tuple[str, str], cause: str, cure: str) -> None:
    fault = the_fault("numerical_instability", changed(mistake))
    assert "no longer fails" in fault.likely_cause
    assert cause in fault.likely_cause
    assert cure in fault.cure


def test_the_cure_of_a_divergence_cures_it() -> None:
    text = changed(('integrator="implicitfast"', 'integrator="RK4"'), ('damping="0.05"', 'damping="2"'))
    fault = the_fault("numerical_instability", text)
    assert fault.cure == 'Set <option integrator="implicitfast"/>.'
    cured = validate(text.replace('integrator="RK4"', 'integrator="implicitfast"'))
    assert "numerical_instability" not in {fault.code for fault in cured.faults}


def test_springs_that_bend_a_robot_are_named_with_their_angle() -> None:
    fault = the_fault("passive_collapse", changed(('stiffness="1"', 'stiffness="1" springref="25"')))
    assert "springref" in fault.likely_cause
    assert "25 deg" in fault.likely_cause
    assert "springref" in fault.cure


def test_a_robot_wedged_by_its_environment_is_not_told_to_soften_its_joints() -> None:
    walls = (
        '<worldbody><geom name="wall" type="box" size="0.05 0.05 0.2" pos="0.065 0 0.2"/>'
        '<geom name="cupboard" type="box" size="0.05 0.05 0.2" pos="-0.065 0 0.2"/>'
        '<geom name="door" type="box" size="0.05 0.05 0.2" pos="0 0.065 0.2"/>'
        '<geom name="shelf" type="box" size="0.05 0.05 0.2" pos="0 -0.065 0.2"/>'
    )
    codes = {fault.code for fault in validate(arm().replace("<worldbody>", walls, 1)).faults}
    assert "too_stiff" not in codes
    assert codes & {"wedged", "initial_penetration"}


def test_a_slow_filter_is_not_called_damping() -> None:
    lazy = changed(
        ('<motor name="pull_front"', '<general name="pull_front" dyntype="filter" dynprm="60"'),
        ('<motor name="pull_back"', '<general name="pull_back" dyntype="filter" dynprm="60"'),
        ('stiffness="1" damping="0.05"', 'stiffness="1" damping="0.2"'),
    )
    codes = {fault.code for fault in validate(lazy).faults}
    assert "filter_slow" in codes
    assert "overdamped" not in codes


def test_a_slow_robot_with_an_idle_actuator_beside_is_slow_and_not_without_effect() -> None:
    rule = require_rule("filter_slow")
    assert rule.example is not None
    idle = '<motor name="idle" tendon="front" gear="-1" ctrlrange="0 0.001"/>'
    text = rule.example.fails(EXAMPLE_ARM).replace("  </actuator>", f"    {idle}\n  </actuator>")
    assert "filter_slow" in {fault.code for fault in validate(text, ignore=["same_cables"]).errors}
