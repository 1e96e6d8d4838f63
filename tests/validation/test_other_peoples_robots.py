"""What robots of other people do without a fault: spin, swing against a stop, topple, hang on a string."""

import pytest
from tests.validation.robots import arm

from aidsr.core.artifacts import ValidationReport
from aidsr.validation import validate

SPINNER = """
<mujoco>
  <option integrator="implicitfast"/>
  <worldbody>
    <body name="hub">
      <joint name="spin" axis="0 0 1" damping="0.001"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.01"/>
      <body name="tip" pos="0.3 0 0"><geom type="sphere" size="0.02"/></body>
    </body>
  </worldbody>
  <actuator><motor joint="spin" ctrlrange="-1 1" gear="0.05"/></actuator>
</mujoco>"""

FLAIL = """
<mujoco>
  <option integrator="implicitfast" gravity="0 0 0"/>
  <worldbody>
    <body name="arm">
      <joint name="turn" axis="0 1 0" range="-90 90" damping="0.05"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.01"/>
      <body name="finger" pos="0.3 0 0">
        <joint name="flap" axis="0 1 0" range="-20 20" damping="0.00002" solreflimit="0.05 1"/>
        <geom type="capsule" fromto="0 0 0 0.1 0 0" size="0.005"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="turn" ctrlrange="-1 1" gear="0.35"/></actuator>
</mujoco>"""

CAR = """
<mujoco>
  <option integrator="implicitfast"/>
  <worldbody>
    <geom type="plane" size="0 0 1"/>
    <body name="car" pos="0 0 0.05">
      <freejoint/>
      <geom type="box" size="0.1 0.05 0.02" mass="1"/>
      <body name="left" pos="0.05 0.07 -0.02" zaxis="0 1 0">
        <joint name="left" axis="0 0 1" damping="0.01"/><geom type="cylinder" size="0.03 0.01" mass="0.05"/></body>
      <body name="right" pos="0.05 -0.07 -0.02" zaxis="0 1 0">
        <joint name="right" axis="0 0 1" damping="0.01"/><geom type="cylinder" size="0.03 0.01" mass="0.05"/></body>
      <geom type="sphere" size="0.025" pos="-0.08 0 -0.025" condim="1" friction="0 0 0"/>
    </body>
  </worldbody>
  <actuator>
    <motor joint="left" ctrlrange="-1 1" gear="0.05"/><motor joint="right" ctrlrange="-1 1" gear="0.05"/>
  </actuator>
</mujoco>"""

YO_YO = """
<mujoco>
  <option integrator="implicitfast"/>
  <worldbody>
    <body name="cup" pos="0 0 0.6">
      <joint name="x" type="slide" axis="1 0 0" range="-0.3 0.3" stiffness="20" damping="3"/>
      <geom type="capsule" fromto="-0.05 0 0 0.05 0 0" size="0.01"/>
      <site name="hook"/>
    </body>
    <body name="ball" pos="0 0 0.4">
      <joint name="ball_x" type="slide" axis="1 0 0" damping="0.02"/>
      <joint name="ball_z" type="slide" axis="0 0 1" damping="0.02"/>
      <geom type="sphere" size="0.025"/>
      <site name="eye"/>
    </body>
  </worldbody>
  <tendon><spatial name="string" range="0 0.3"><site site="hook"/><site site="eye"/></spatial></tendon>
  <actuator><motor joint="x" ctrlrange="-1 1" gear="5"/></actuator>
</mujoco>"""


def codes(report: ValidationReport) -> set[str]:
    return {fault.code for fault in report.errors if fault.layer != "scope"}


@pytest.mark.parametrize("robot", [SPINNER, FLAIL, CAR, YO_YO], ids=["spinner", "flail", "car", "yo-yo"])
def test_what_others_build_is_sound(robot: str) -> None:
    assert codes(validate(robot)) == set()


def test_a_spinning_joint_that_is_also_shaken_still_chatters() -> None:
    shaken = SPINNER.replace(
        "</actuator>", '<position joint="spin" kp="0" kv="100" ctrlrange="-1 1"/></actuator>'
    ).replace('integrator="implicitfast"', 'integrator="Euler"')
    assert codes(validate(shaken)) & {"chatter", "numerical_instability"}


def test_a_joint_held_beyond_its_range_is_still_found() -> None:
    held = FLAIL.replace('joint="turn"', 'joint="flap"').replace('gear="0.35"', 'gear="0.5"')
    assert "limit_overrun" in codes(validate(held, select=["limit_overrun"]))


@pytest.mark.parametrize(
    "beside",
    [
        '<body name="table" pos="0.5 0 0"><geom type="box" size="0.1 0.1 0.1"/></body>',
        '<body name="goal" mocap="true" pos="0.3 0 0.2"><geom type="sphere" size="0.02"/></body>',
        '<body name="ball" pos="0.3 0 0.2"><freejoint/><geom type="sphere" size="0.02"/></body>',
    ],
    ids=["static body", "mocap body", "loose object"],
)
def test_furniture_of_a_scene_is_no_fault(beside: str) -> None:
    assert codes(validate(arm().replace("<worldbody>", f"<worldbody>{beside}", 1))) == set()


@pytest.mark.parametrize(
    "setting",
    [
        '<size njmax="500" nconmax="100"/>',
        '<asset><texture type="skybox" builtin="gradient" width="800" height="4800"/></asset>',
    ],
    ids=["njmax", "skybox of 4,800 rows"],
)
def test_settings_of_older_documents_are_no_fault(setting: str) -> None:
    assert codes(validate(arm().replace("<worldbody>", f"{setting}<worldbody>", 1))) == set()


def test_a_missing_control_range_is_a_matter_of_scope() -> None:
    report = validate(SPINNER.replace('ctrlrange="-1 1" ', ""))
    assert report.sound
    assert "ctrlrange_missing" in {fault.code for fault in report.errors}
