"""Bends, sag, stiffness and clearances of a limb of one hinge, against the balance of its moments."""

from __future__ import annotations

import math
import re

import mujoco
import pytest

from aidsr.core.errors import UserError
from aidsr.tools.distances import distance_m, find_pairs
from aidsr.tools.scene import MeasuredScene
from aidsr.tools.statics import bends, clearances, load

STIFFNESS, ARM_M, LENGTH_M, MASS_KG = 0.1, 0.01, 0.1, 0.05


def alone(mjcf: str) -> MeasuredScene:
    return MeasuredScene(mjcf=mjcf)


def limb(gravity: float = 0.0) -> str:
    """A straight limb along x on a hinge about y, and a cable of constant moment arm, 0 to 5 N."""
    return f"""
<mujoco model="limb">
  <option timestep="0.001" gravity="0 0 {-gravity}"/>
  <worldbody>
    <body name="base">
      <geom type="sphere" size="0.01" mass="0.1" pos="-0.03 0 0"/>
      <site name="anchor" pos="0 0 0.1"/>
      <body name="link">
        <joint name="bend" type="hinge" axis="0 1 0" stiffness="{STIFFNESS}" damping="0.01"/>
        <geom type="sphere" size="0.001" pos="{LENGTH_M} 0 0" mass="{MASS_KG}"/>
        <site name="tip" pos="{LENGTH_M} 0 0"/>
      </body>
    </body>
  </worldbody>
  <tendon><fixed name="cable"><joint joint="bend" coef="{ARM_M}"/></fixed></tendon>
  <actuator><general name="pull" tendon="cable" ctrlrange="0 5" gainprm="-1"/></actuator>
</mujoco>"""


def test_a_cable_bends_a_hinge_by_its_moment_over_the_stiffness() -> None:
    angle = 5.0 * ARM_M / STIFFNESS
    found = bends(alone(limb()))
    assert found.figure("largest bend") == pytest.approx(math.degrees(angle), rel=0.01)
    way_m = 2 * (LENGTH_M + 0.001) * math.sin(angle / 2)  # of the far end of the ball at the tip
    assert found.figure("largest way of a tip") == pytest.approx(1000 * way_m, rel=0.01)
    assert "pull: 5 N; link tip moves" in found.text
    half = bends(alone(limb()), pull=0.5)
    assert half.figure("largest bend") == pytest.approx(math.degrees(angle) / 2, rel=0.01)


def balance(moment: float) -> float:
    """Angle at which the spring balances a vertical force at the tip of a limb that was level."""
    angle = 0.0
    for _ in range(200):
        angle += 0.3 * (moment * math.cos(angle) / STIFFNESS - angle)
    return angle


def test_what_a_bent_limb_presses_on_is_named_with_its_force() -> None:
    stop = '<geom name="stop" type="box" size="0.2 0.2 0.01" pos="0.1 0 0.03"/>'
    found = bends(alone(limb().replace("<worldbody>", f"<worldbody>{stop}")))
    angle = math.asin(0.019 / LENGTH_M)
    force_n = (5.0 * ARM_M - STIFFNESS * angle) / (LENGTH_M * math.cos(angle))
    told = re.search(r"deg; touches stop with link \((\S+) N\)$", found.text, re.M)
    assert told is not None
    assert float(told[1]) == pytest.approx(force_n, rel=0.05), "balance of moments"
    assert "touches" not in bends(alone(limb())).text


def test_what_is_touched_at_rest_is_told_once() -> None:
    stop = '<geom name="stop" type="box" size="0.2 0.2 0.01" pos="0.1 0 -0.011"/>'
    told = bends(alone(limb(gravity=9.81).replace("<worldbody>", f"<worldbody>{stop}"))).text
    assert "from where the robot rests. There it touches stop with link (" in told
    assert told.count("touches") == 1


def test_a_limb_sags_until_its_spring_balances_its_weight() -> None:
    angle = balance(MASS_KG * 9.81 * LENGTH_M)
    found = load(alone(limb(9.81)), "tip", force_n=0.1)
    assert found.figure("sag") == pytest.approx(2000 * LENGTH_M * math.sin(angle / 2), rel=0.01)


def test_a_robot_alone_is_measured_under_the_gravity_of_its_mount() -> None:
    hanging = '<mujoco><worldbody><site name="mount" euler="180 0 0"/></worldbody></mujoco>'
    subject = MeasuredScene(mjcf=limb(0.0), environment=hanging)
    up, down = (load(each, "tip", force_n=0.1) for each in (subject, alone(limb(9.81))))
    assert up.figure("sag") == pytest.approx(down.figure("sag"), rel=0.01)
    rise, fall = (each.lines[0].rpartition(": ")[2].split()[2] for each in (up, down))
    assert (rise[0], fall[0]) == ("+", "-"), "what hangs falls along its own z"


def test_a_limb_gives_under_a_force_as_its_spring_says() -> None:
    angle = balance(0.2 * LENGTH_M)
    found = load(alone(limb()), "tip", force_n=0.2)
    given_m = LENGTH_M * math.sin(angle)
    assert found.figure("sag") == pytest.approx(0.0, abs=1e-6)
    assert found.figure("gives") == pytest.approx(1000 * given_m, rel=0.01)
    assert found.figure("stiffness") == pytest.approx(0.2 / given_m, rel=0.01)
    assert found.figure("turns") == pytest.approx(math.degrees(angle), rel=0.01)


def test_a_robot_alone_is_loaded_and_sags_along_the_axes_of_its_root() -> None:
    turned = limb(9.81).replace('<body name="base">', '<body name="base" euler="-90 0 0">')  # its y points down
    level = load(alone(turned), "tip", force_n=0.2, direction=(0, 0, -1))
    assert level.figure("sag") == pytest.approx(0.0, abs=1e-6)
    assert level.figure("gives") == pytest.approx(1000 * LENGTH_M * math.sin(balance(0.2 * LENGTH_M)), rel=0.01)
    hanging = limb(9.81).replace('<body name="base">', '<body name="base" euler="180 0 0">')
    lowered = load(alone(hanging), "tip")
    assert re.search(r"-\d+\.\d [+-]0\.0 \+\d\d\.\d mm in the axes of the root", lowered.text)


@pytest.mark.parametrize(
    ("joint", "told"),
    [
        ('type="hinge" axis="0 1 0"', "turn: 0.1 N m; link"),
        ('type="slide" axis="0 1 0"', "turn: 0.1 N; link"),
        ('type="ball"', "turn: 0.1 N m; link"),
    ],
)
def test_a_motor_exerts_a_force_or_a_torque(joint: str, told: str) -> None:
    gear = "0 2 0" if "ball" in joint else "2"
    motor = f'<motor name="turn" joint="bend" gear="{gear}" ctrlrange="0 0.05"/>'
    mjcf = re.sub(r"<tendon>.*</tendon>", "", limb().replace('type="hinge" axis="0 1 0"', joint))
    assert told in bends(alone(re.sub(r"<general .*/>", motor, mjcf))).text


def test_clearances_are_measured_as_drawn_and_at_rest() -> None:
    found = clearances(alone(limb(9.81)), [("anchor", "tip")])
    angle = balance(MASS_KG * 9.81 * LENGTH_M)
    at_rest = math.hypot(LENGTH_M * math.cos(angle), 0.1 + LENGTH_M * math.sin(angle))
    assert found.figure("anchor to tip") == pytest.approx(1000 * at_rest, rel=0.01)
    assert "141.4 mm as drawn" in found.text


@pytest.mark.parametrize("height_m", [0.3, 0.08, 0.06, 0.03])
def test_a_height_field_is_measured_to_a_surface_and_a_point_above_and_inside(height_m: float) -> None:
    field = f"""
<mujoco>
  <option gravity="0 0 0"/>
  <asset><hfield name="flat" nrow="2" ncol="2" size="1 1 0.1 0.1" elevation="0.5 0.5 0.5 0.5"/></asset>
  <worldbody>
    <geom name="ground" type="hfield" hfield="flat"/><geom name="floor" type="plane" size="1 1 1" pos="0 0 -0.05"/>
    <body name="ball" pos="0.2 0.3 {height_m}"><joint/><site name="middle"/><geom size="0.02" mass="0.1"/></body>
  </worldbody>
</mujoco>"""
    model = mujoco.MjModel.from_xml_string(field)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    top_m = float(model.hfield_size[0, 2] * model.hfield_data[0])
    ball, point = find_pairs(model, [("ball", "ground"), ("middle", "ground")])
    deepest_m = -0.02  # contacts of a ball with a height field are no deeper than its radius
    assert distance_m(model, data, *ball) == pytest.approx(max(height_m - top_m - 0.02, deepest_m), abs=1e-3)
    assert distance_m(model, data, *point) == pytest.approx(height_m - top_m, abs=1e-4)
    with pytest.raises(UserError, match='no distance is measured between "floor" and "ground"'):
        find_pairs(model, [("floor", "ground")])


def test_what_cannot_be_measured_is_said() -> None:
    with pytest.raises(UserError, match='no body, site or geom "fingertip"'):
        load(alone(limb()), "fingertip")
    with pytest.raises(UserError, match="a direction other than zero"):
        load(alone(limb()), "tip", direction=(0.0, 0.0, 0.0))
    with pytest.raises(UserError, match="no pairs of names given"):
        clearances(alone(limb()), [])
