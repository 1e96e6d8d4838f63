"""A wrong sign is named; signs that only look odd are not, and change nothing."""

import pytest

from aidsr.validation import validate
from aidsr.validation.rules_page import EXAMPLE_ARM
from scenes import small_arm

FRONT = '<motor name="pull_front" tendon="front" gear="-1" ctrlrange="0 20"/>'
BACK = FRONT.replace("front", "back")


def arm(front: str, back: str = BACK) -> str:
    assert FRONT in EXAMPLE_ARM
    assert BACK in EXAMPLE_ARM
    return EXAMPLE_ARM.replace(FRONT, front).replace(BACK, back)


def servo(**changed: str) -> str:
    values = {"gainprm": "500", "biasprm": "0 -500 -5", "ctrlrange": "0.1 0.14", "gear": "1"} | changed
    attributes = " ".join(f'{name}="{value}"' for name, value in values.items())
    return f'<general name="pull_front" tendon="front" biastype="affine" {attributes}/>'


@pytest.mark.parametrize(
    "front",
    [
        FRONT.replace("-1", "1"),
        FRONT.replace("0 20", "-20 0"),
        servo(gainprm="-500", biasprm="0 500 -5"),
        servo(gainprm="-20", biasprm="0 0 5", ctrlrange="0 1"),
        servo(gear="-1"),
        servo(ctrlrange="-0.14 -0.1"),
    ],
    ids=["gear", "range", "stiffness", "damping", "gear of a servo", "range of a servo"],
)
def test_an_inverted_sign_is_an_error_of_physics_at_that_actuator(front: str) -> None:
    report = validate(arm(front), select=["actuator_sign"])
    assert [(fault.code, fault.names) for fault in report.errors] == [("actuator_sign", ("pull_front",))]
    assert not report.sound


@pytest.mark.parametrize(
    ("front", "back"),
    [
        (FRONT.replace('gear="-1"', 'gear="1"').replace("0 20", "-20 0"), BACK),
        (servo(), BACK),
        (servo(forcerange="-20 0"), BACK),
        (FRONT.replace("-1", "1"), BACK.replace("-1", "1")),
    ],
    ids=["two signs", "servo", "servo that only pulls", "rods"],
)
def test_signs_that_agree_are_none(front: str, back: str) -> None:
    assert validate(arm(front, back), select=["actuator_sign"]).faults == ()


def test_a_push_among_pulls_is_reported_once() -> None:
    assert {fault.code for fault in validate(arm(FRONT.replace("-1", "1"))).errors} == {"actuator_sign"}


@pytest.mark.parametrize(("highest_n", "found"), [(8, set()), (60, {"actuator_overforce"})])
def test_a_sum_of_joints_asks_its_winch_for_the_same_whichever_sign_it_has(highest_n: float, found: set[str]) -> None:
    joints = "".join(f'<joint joint="bend{i}" coef="{{0}}"/>' for i in range(1, 5))
    head, _, rest = small_arm().replace('stiffness="0.2"', 'stiffness="0.8"').partition("<tendon>")
    flex = f'<tendon><fixed name="flex">{joints}</fixed></tendon>'
    drive = f'<actuator><motor name="flex" tendon="flex" gear="{{1}}" ctrlrange="0 {highest_n}"/></actuator>'
    mjcf = head + flex + drive + rest.partition("</actuator>")[2]
    reports = [validate(mjcf.format(*signs), realizable=True) for signs in ((0.009, -1), (0.009, 1), (-0.009, 1))]
    for report in reports:
        assert {fault.code for fault in report.faults} == found
        assert report.measurements["motors"]["flex"]["tension_n"] == pytest.approx(highest_n, rel=0.01)
