"""The verdict says what the validator says: of what nobody can build, of what does not work, of a change."""

from functools import cache

import pytest
from fingers import finger

from aidsr.core.artifacts import Fault, ValidationReport
from aidsr.fabrication.build import RobotBuild, build_robot
from aidsr.fabrication.printers import printer_named
from aidsr.fabrication.schema import Verdict
from aidsr.fabrication.verdict import judge, retest_of
from aidsr.loop.export import export
from aidsr.validation import validate

MOTOR = '<motor name="{name}" tendon="{name}" gear="10" ctrllimited="true" ctrlrange="-1 1"/>'
BOTH_WAYS = "".join(MOTOR.format(name=name) for name in ("flex", "extend"))


@cache
def made() -> RobotBuild:
    return build_robot(finger(), [validate(finger())], printer_named("fdm"))


def judged(designed: ValidationReport, built: ValidationReport) -> Verdict:
    return judge(made(), (), retest_of(designed, built))


def fault(code: str, layer: str = "simulate", severity: str = "error") -> Fault:
    return Fault(code=code, layer=layer, severity=severity, names=("link_1",), message=f"says {code}")


@pytest.mark.parametrize(
    ("mjcf", "code", "words"),
    [
        (finger(actuators=BOTH_WAYS), "tendon_pushes", "pushes on its tendon"),
        (finger(sensors=""), "no_sensors", "the robot has no sensors"),
    ],
)
def test_faults_of_the_design_are_not_blamed_on_building(mjcf: str, code: str, words: str) -> None:
    report = validate(mjcf, realizable=True)
    verdict = judged(report, report)
    errors = {fault.code: fault.message for fault in verdict.reasons if fault.severity == "error"}
    assert verdict.verdict == "not buildable"
    assert list(errors) == [code]
    assert words in errors[code]
    assert verdict.reasons[0].code == code


@pytest.mark.parametrize(
    ("designed", "built", "codes"),
    [
        ((), (fault("chatter"),), {"unstable_as_built"}),
        ((fault("chatter", severity="warning"),), (fault("chatter"),), {"unstable_as_built"}),
        ((fault("chatter"),), (fault("chatter"),), {"unstable_as_designed"}),
        ((fault("chatter"),), (fault("chatter"), fault("drop")), {"unstable_as_designed", "unstable_as_built"}),
        ((), (fault("tendon_pushes", "scope"),), {"tendon_pushes"}),
        ((), (fault("actuator_power", "realizability"),), set()),
        ((fault("actuator_overforce", "realizability"),), (fault("actuator_overforce", "realizability"),), set()),
        ((fault("thin_wall", "realizability", "warning"),), (), set()),
    ],
)
def test_only_what_building_adds_is_told_as_built(
    designed: tuple[Fault, ...], built: tuple[Fault, ...], codes: set[str]
) -> None:
    reports = [
        ValidationReport(stable=not any(fault.severity == "error" for fault in faults), faults=faults)
        for faults in (designed, built)
    ]
    verdict = judged(*reports)
    assert {fault.code for fault in verdict.reasons if fault.severity == "error"} == codes
    messages = [fault.message for fault in verdict.reasons]
    told = {fault.message for fault in designed if fault.layer in ("scope", "realizability")}
    added = {fault.message for fault in built if fault.layer in ("scope", "realizability")} - told
    assert {*told, *(f"as built, {message}" for message in added)} <= {*messages}


def test_a_finger_whose_motors_push_is_not_sold_as_buildable(tmp_path) -> None:
    robot = tmp_path / "finger.xml"
    robot.write_text(finger(actuators=BOTH_WAYS))
    exported = export(robot)
    assert exported.verdict.verdict == "not buildable"
    assert "tendon_pushes" in {fault.code for fault in exported.verdict.reasons}
