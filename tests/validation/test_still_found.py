"""Bad robots that look like the good ones which rules let pass."""

import pytest

from aidsr.validation import validate
from aidsr.validation.registry import require_rule
from aidsr.validation.rules_page import EXAMPLE_ARM

FLOOR = ("<worldbody>", '<worldbody><geom name="floor" type="plane" size="1 1 0.1" pos="0 0 -0.4"/>')
FREE = ('<body name="base">', '<body name="base"><freejoint/>')
LIFT = (
    '<body name="base">',
    '<body name="base"><joint name="lift" type="slide" axis="0 0 1" stiffness="0" damping="0" limited="false"/>',
)
UNRANGED = (
    '<motor name="pull_back" tendon="back" gear="-1" ctrlrange="0 20"/>',
    '<motor name="pull_back" tendon="back" gear="-1"/>',
)
FRONT = '<motor name="pull_front" tendon="front" gear="-1" ctrlrange="0 20"/>'


def errors(*changes: tuple[str, str]) -> set[str]:
    text = EXAMPLE_ARM
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    return {fault.code for fault in validate(text).errors}


def test_another_actuator_without_a_range_does_not_hide_divergence() -> None:
    strong = (FRONT, FRONT.replace("0 20", "0 400000"))
    assert {"numerical_instability", "ctrlrange_missing"} <= errors(strong, UNRANGED)


def test_another_actuator_without_a_range_does_not_hide_chatter() -> None:
    euler = ('integrator="implicitfast"', 'integrator="Euler"')
    stiff = (
        FRONT,
        '<position name="pull_front" tendon="front" kp="2000" kv="20000" ctrlrange="0.1 0.14" forcerange="-40 0"/>',
    )
    assert {"chatter", "ctrlrange_missing"} <= errors(euler, stiff, UNRANGED)


def test_another_actuator_without_a_range_does_not_hide_overrun_limits() -> None:
    unheld = ('range="-45 45"', 'range="-6 6"'), (' solreflimit="0.004 1"', "")
    strong = (FRONT, FRONT.replace("0 20", "0 80"))
    assert {"limit_overrun", "ctrlrange_missing"} <= errors(*unheld, strong, UNRANGED)


@pytest.mark.parametrize(
    "beside",
    [
        '<geom name="wall" type="box" size="0.01 0.5 0.5" pos="0.07 0 0.2"/>',
        '<geom name="mark" type="box" size="0.01 0.01 0.001" pos="0 0 -0.04" contype="0" conaffinity="0"/>',
    ],
    ids=["wall beside", "mark that nothing touches"],
)
def test_what_carries_nothing_does_not_let_a_robot_drop(beside: str) -> None:
    assert "base_not_attached" in errors(FREE, FLOOR, ("<worldbody>", f"<worldbody>{beside}"))


@pytest.mark.parametrize(
    "ground",
    [
        '<geom type="plane" size="1 1 0.1"/>',
        '<geom type="hfield" hfield="flat"/>',
    ],
    ids=["plane", "height field"],
)
def test_what_starts_just_above_its_ground_may_topple(ground: str) -> None:
    asset = '<asset><hfield name="flat" nrow="8" ncol="8" size="1 1 0.1 0.1"/></asset>'
    world = ("<worldbody>", f"{asset}<worldbody>{ground}")
    on_its_tip = ('<body name="base">', '<body name="base" pos="0 0 0.16" euler="155 0 0"><freejoint/>')
    high = (on_its_tip[0], on_its_tip[1].replace("0.16", "0.26"))
    assert "base_not_attached" not in errors(world, on_its_tip)
    assert "base_not_attached" in errors(world, high)


def test_a_robot_that_holds_itself_does_not_pass_by_toppling() -> None:
    rule = require_rule("self_collision_lock")
    world = ("<worldbody>", '<worldbody><geom type="plane" size="1 1 0.1"/>')
    on_its_tip = ('<body name="base">', '<body name="base" pos="0 0 0.17" euler="155 0 0"><freejoint/>')
    assert "self_collision_lock" in errors(*rule.example.changes, world, on_its_tip)


def test_a_spring_within_the_robot_does_not_hold_it() -> None:
    spring = "<spatial stiffness='1'><site site='front0'/><site site='front1'/></spatial>"
    assert "free_fall" in errors(LIFT, ("</tendon>", f"{spring}</tendon>"))


def test_a_tendon_that_is_only_read_joins_nothing() -> None:
    cradle = (
        '<body pos="0 0 0.3"><joint type="slide" axis="1 0 0" stiffness="50" damping="1" range="-0.01 0.01"/>'
        '<geom size="0.02 0.01" mass="0.05"/><site name="peg"/></body>'
    )
    gauge = '<spatial><site site="peg"/><site site="front0"/></spatial>'
    found = errors(LIFT, ("<worldbody>", f"<worldbody>{cradle}"), ("</tendon>", f"{gauge}</tendon>"))
    assert found & {"free_fall", "disconnected"}


def test_a_motor_that_turns_the_root_does_not_hold_it_up() -> None:
    turn = '<joint name="turn" axis="0 0 1" limited="false"/>'
    motor = '<motor joint="turn" ctrlrange="-0.01 0.01"/>'
    lift = (LIFT[0], LIFT[1] + turn)
    assert "free_fall" in errors(lift, ("</actuator>", f"{motor}</actuator>"))


def cables(good: int, bad: int) -> str:
    """The example arm with some cables that bend it, and some along its axis that turn nothing."""
    arm = EXAMPLE_ARM
    for k in range(7):
        first = f'<site name="front{k}"'
        arm = arm.replace(first, f'<site name="mid{k}" pos="0 0 {0.0125 * (k > 0)}"/>{first}')
    paths = ["back" if k % 2 else "front" for k in range(good)] + ["mid"] * bad
    tendons = "".join(
        f'<spatial name="cable{k}">{"".join(f"""<site site="{path}{at}"/>""" for at in range(7))}</spatial>'
        for k, path in enumerate(paths)
    )
    motors = "".join(f'<motor tendon="cable{k}" gear="-1" ctrlrange="0 2"/>' for k in range(len(paths)))
    end = arm[arm.index("<sensor>") :].replace('"front"', '"cable0"').replace('"back"', '"cable1"')
    return f"{arm[: arm.index('<tendon>')]}<tendon>{tendons}</tendon><actuator>{motors}</actuator>{end}"


@pytest.mark.parametrize(("good", "bad", "severity"), [(18, 1, "error"), (19, 1, "warning"), (19, 2, "error")])
def test_a_cable_without_a_lever_is_a_warning_among_twenty_only(good: int, bad: int, severity: str) -> None:
    (fault,) = validate(cables(good, bad), select="tendon_no_moment").faults
    assert len(fault.names) == bad
    assert fault.severity == severity


@pytest.mark.parametrize(
    ("code", "changes"),
    [
        ("too_stiff", (('stiffness="1" damping="0.05"', 'stiffness="50" damping="2.5"'),)),
        ("no_effect", (('timestep="0.002"', 'timestep="0.002" viscosity="1e5"'),)),
        ("tendon_against_limit", require_rule("tendon_against_limit").example.changes),  # type: ignore[union-attr]
        ("self_collision_lock", require_rule("self_collision_lock").example.changes),  # type: ignore[union-attr]
        ("antagonist_lock", require_rule("antagonist_lock").example.changes),  # type: ignore[union-attr]
    ],
)
def test_another_actuator_without_a_range_does_not_hide_what_holds_the_robot(
    code: str, changes: tuple[tuple[str, str], ...]
) -> None:
    third = '<motor name="pull_too" tendon="back" gear="-1"/>'
    found = errors(*changes, ("  </actuator>", f"    {third}\n  </actuator>"))
    assert {code, "ctrlrange_missing"} <= found
