"""Who has to change what."""

import pytest

from aidsr.core.artifacts import Critique, CritiqueIssue, ValidationReport
from aidsr.loop.routing import Change, after_critique, after_scene_faults
from scripted import fault


def report(*faults) -> ValidationReport:
    return ValidationReport(stable=False, faults=faults)


def critique(*roles: str) -> Critique:
    issues = tuple(CritiqueIssue(blame=role, component=f"part {i}", problem="wrong") for i, role in enumerate(roles))
    return Critique(passed=False, issues=issues)


@pytest.mark.parametrize(
    ("found", "role"),
    [
        (fault("chatter", "robot/s1"), "robot"),
        (fault("chatter"), "robot"),
        (fault("initial_penetration", "robot/tip", "table"), "placement"),
        (fault("initial_penetration", "robot/tip", "robot/s1"), "robot"),
        (fault("free_fall", "robot/base"), "placement"),
        (fault("undefined_reference", "mount_7"), "placement"),
    ],
)
def test_faults_of_a_scene_go_to_the_role_that_can_cure_them(found, role: str) -> None:
    change = after_scene_faults(report(fault("underdamped", "robot/s2"), found), Change())
    assert getattr(change, role) == report(fault("underdamped", "robot/s2"), found)
    assert [change.robot, change.placement].count(None) == 1


def test_a_warning_decides_nothing() -> None:
    warning = fault("free_fall", "robot/base").model_copy(update={"severity": "warning"})
    assert after_scene_faults(report(warning, fault("chatter", "robot/s1")), Change()).placement is None


def test_what_the_integrator_could_not_cure_goes_to_the_coder() -> None:
    before, now = report(fault("free_fall", "robot/base")), report(fault("free_fall", "robot/base"))
    assert after_scene_faults(now, Change(placement=before)) == Change(robot=now)
    assert after_scene_faults(now, Change(placement=critique("integrator"))) == Change(placement=now)
    assert after_scene_faults(now, Change(robot=before)) == Change(placement=now)


def test_each_role_hears_its_own_issues_and_the_designer_all() -> None:
    both = after_critique(critique("coder", "integrator", "coder"))
    assert [issue.component for issue in both.robot.issues] == ["part 0", "part 2"]
    assert [issue.component for issue in both.placement.issues] == ["part 1"]
    designer = after_critique(critique("coder", "designer"))
    assert (designer.robot, designer.placement) == (None, None)
    assert designer.concept.splitlines() == ["part 0: wrong.", "part 1: wrong."]


def test_reasons_tell_the_worst_and_count_the_rest() -> None:
    assert Change(robot=report(fault("chatter"))).reason == "chatter: chatter was seen."
    many = report(*(fault(f"fault_{number}") for number in range(5)))
    assert many.faults[3].code not in Change(placement=many).reason
    assert Change(placement=many).reason.endswith("And 2 more.")
    assert Change(concept="part 0: wrong.").reason == "part 0: wrong."


def test_problems_told_to_a_person_are_sentences_of_their_own() -> None:
    issues = (
        CritiqueIssue(
            blame="coder", component="no_sensors", problem="it has none", suggestion="add sensors of its own"
        ),
        CritiqueIssue(blame="coder", component="reach", problem="it is too short.", suggestion="make it longer."),
    )
    told = after_critique(Critique(passed=False, issues=issues)).reason
    assert told == "no_sensors: it has none. add sensors of its own. reach: it is too short. make it longer."
