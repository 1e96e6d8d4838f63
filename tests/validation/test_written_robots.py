"""Robots as language models typically write them: joints at segment starts, capsules by fromto, servos on tendons."""

from __future__ import annotations

import math

import pytest

from aidsr.core.artifacts import ValidationReport
from aidsr.validation import validate

SERVO = '<position name="act{k}" tendon="tendon{k}" kp="500" ctrlrange="0.2 0.4" forcerange="-50 0"/>'
MUSCLE = '<muscle name="act{k}" tendon="tendon{k}" force="60" ctrlrange="0 1" lengthrange="0.2 0.45"/>'
PUSHER = '<motor name="act{k}" tendon="tendon{k}" ctrlrange="0 30"/>'
BOTH_WAYS = '<motor name="act{k}" tendon="tendon{k}" gear="20" ctrlrange="-1 1"/>'


def arm(actuator: str = SERVO, joint: str = 'damping="0.1" stiffness="2"', tendon: str = 'damping="1"') -> str:
    """Eight segments of hinge pairs, everything else MuJoCo's default: Euler, 2 ms, a floor and a light."""
    text = ""
    for index in range(8, 0, -1):
        radius = 0.021 - 0.001 * index
        sites = "".join(
            f'<site name="s{index}_{k}" pos="{x * radius:.4f} {y * radius:.4f} 0.02"/>'
            for k, (x, y) in enumerate(((1, 0), (0, 1), (-1, 0), (0, -1)), 1)
        )
        tip = '<site name="tip" pos="0 0 0.04"/>' if index == 8 else ""
        text = (
            f'<body name="seg{index}" pos="0 0 {0.05 if index == 1 else 0.04}">'
            f'<joint name="seg{index}_x" type="hinge" axis="1 0 0" range="-30 30"/>'
            f'<joint name="seg{index}_y" type="hinge" axis="0 1 0" range="-30 30"/>'
            f'<geom type="capsule" fromto="0 0 0 0 0 0.04" size="{radius:.3f}"/>{sites}{tip}{text}</body>'
        )
    tendons = "".join(
        f'<spatial name="tendon{k}" {tendon} width="0.002"><site site="b{k}"/>'
        + "".join(f'<site site="s{index}_{k}"/>' for index in range(1, 9))
        + "</spatial>"
        for k in range(1, 5)
    )
    actuators = "".join(actuator.format(k=k) for k in range(1, 5))
    sensors = "".join(f'<tendonpos tendon="tendon{k}"/>' for k in range(1, 5))
    return f"""<mujoco model="tendon_arm"><compiler angle="degree"/><option timestep="0.002" gravity="0 0 -9.81"/>
<default><joint {joint}/><geom density="500" friction="1 0.005 0.0001"/><site size="0.003"/></default>
<worldbody><light pos="0 0 3"/><geom name="floor" type="plane" size="2 2 0.1"/>
<body name="base" pos="0 0 0.1"><geom type="cylinder" size="0.05 0.05"/>
<site name="b1" pos="0.03 0 0.05"/><site name="b2" pos="0 0.03 0.05"/><site name="b3" pos="-0.03 0 0.05"/>
<site name="b4" pos="0 -0.03 0.05"/>{text}</body></worldbody>
<tendon>{tendons}</tendon><actuator>{actuators}</actuator>
<sensor><framepos objtype="site" objname="tip"/>{sensors}</sensor></mujoco>"""


def gripper(option: str, force_n: float = 6) -> str:
    """Three fingers of five hinges, each with one tendon and nothing that opens it but its springs."""
    fingers = tendons = motors = sensors = ""
    for finger in range(3):
        text, angle = "", 120 * finger
        for index in reversed(range(5)):
            tip = f'<site name="f{finger}_tip" pos="0 0 0.025"/>' if index == 4 else ""
            text = (
                f'<body name="f{finger}_{index}" pos="0 0 {0.025 if index else 0.02}">'
                f'<joint name="f{finger}_j{index}" axis="0 1 0" range="-10 60" stiffness="0.3" damping="0.02"/>'
                f'<geom type="capsule" fromto="0 0 0.003 0 0 0.022" size="0.008" mass="0.01"/>'
                f'<site name="f{finger}_s{index}" pos="-0.008 0 0.0125"/>{tip}{text}</body>'
            )
        x, y = 0.05 * math.cos(math.radians(angle)), 0.05 * math.sin(math.radians(angle))
        fingers += (
            f'<body name="finger{finger}" pos="{x:.4f} {y:.4f} 0" euler="0 0 {angle}">'
            f'<geom type="box" size="0.01 0.01 0.01" pos="0 0 0.005" mass="0.02"/>'
            f'<site name="f{finger}_b" pos="-0.01 0 0.015"/>{text}</body>'
        )
        sites = "".join(f'<site site="f{finger}_s{index}"/>' for index in range(5))
        tendons += f'<spatial name="t{finger}"><site site="f{finger}_b"/>{sites}</spatial>'
        motors += f'<motor name="m{finger}" tendon="t{finger}" gear="-1" ctrllimited="true" ctrlrange="0 {force_n}"/>'
        sensors += f'<framepos objtype="site" objname="f{finger}_tip"/><touch site="f{finger}_tip"/>'
    palm = '<geom type="cylinder" size="0.06 0.01" pos="0 0 -0.01" mass="0.3"/>'
    return (
        f'<mujoco><option {option}/><worldbody><body name="palm">{palm}{fingers}</body></worldbody>'
        f"<tendon>{tendons}</tendon><actuator>{motors}</actuator><sensor>{sensors}</sensor></mujoco>"
    )


def errors(report: ValidationReport) -> list[str]:
    return [fault.code for fault in report.errors]


@pytest.mark.parametrize("actuator", [SERVO, MUSCLE, PUSHER, BOTH_WAYS], ids=["servo", "muscle", "pusher", "both ways"])
def test_an_arm_that_works_is_sound_whatever_pulls_it(actuator: str) -> None:
    """Its round foot is drawn into its base, which turns nothing and is only mentioned."""
    report = validate(arm(actuator))
    assert report.sound
    assert report.in_scope == (actuator in (SERVO, MUSCLE))
    assert "initial_penetration" in [fault.code for fault in report.warnings]


@pytest.mark.parametrize("actuator", [PUSHER, BOTH_WAYS], ids=["pusher", "both ways"])
def test_pushing_a_cable_is_out_of_scope(actuator: str) -> None:
    assert errors(validate(arm(actuator))) == ["tendon_pushes"]


def test_a_free_joint_on_an_arm_lets_it_fall_over_its_floor() -> None:
    report = validate(arm().replace('<body name="base" pos="0 0 0.1">', '<body name="base" pos="0 0 1"><freejoint/>'))
    assert errors(report) == ["base_not_attached"]


def test_an_arm_without_damping_fails_and_is_told_why() -> None:
    first, *others = validate(arm(joint='stiffness="2"', tendon="")).errors
    assert first.code in ("numerical_instability", "underdamped")
    assert "damping" in first.likely_cause
    assert {fault.code for fault in others} <= {"underdamped", "chatter"}


def test_damping_that_the_integrator_treats_explicitly() -> None:
    """The same fingers are fine with an implicit integrator."""
    (fault,) = validate(gripper('timestep="0.001" integrator="RK4"')).errors
    assert fault.code == "numerical_instability"
    assert "RK4" in fault.likely_cause
    assert validate(gripper('timestep="0.001" integrator="implicitfast"')).stable


def test_light_fingers_are_pulled_through_the_soft_limits_of_mujoco() -> None:
    assert errors(validate(gripper('integrator="implicitfast"', force_n=20))) == ["limit_overrun"]
