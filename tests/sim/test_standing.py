"""A free robot stands on what is below it, whatever height it was placed at."""

from __future__ import annotations

import pytest

from aidsr.core.artifacts import Placement, Robot
from aidsr.core.errors import UserError
from aidsr.sim.standing import stand

ENVIRONMENT = """
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 0.1"/>
    <site name="mount" pos="0 0 0.2" euler="0 0 90"/>
    <geom name="step" type="box" size="0.1 0.1 0.025" pos="1 0 0.025"/>
    <geom name="roof" type="box" size="0.2 0.2 0.005" pos="2 0 0.105"/>
    <geom name="block" type="box" size="0.2 0.2 1" pos="3 0 1"/>
  </worldbody>
</mujoco>"""


def box(half_m: float = 0.03, narrow: float = 1.0) -> Robot:
    """A box with a hinge and a cable, so that it is a robot."""
    return Robot(
        mjcf=f"""
<mujoco><worldbody><body name="box"><freejoint/>
  <geom type="box" size="{half_m * narrow} {half_m * narrow} {half_m}" mass="0.1"/>
  <body name="flap" pos="0 0 {half_m}"><joint name="bend" axis="0 1 0" stiffness="1" damping="0.1"/>
    <geom type="sphere" size="0.002" mass="0.001" contype="0" conaffinity="0"/></body>
</body></worldbody></mujoco>""",
        functional_part="flap",
    )


def placed(*position: float, mount: str = "world", rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Placement:
    return Placement(mount=mount, base="free", position_m=position, rotation_deg=rotation)


@pytest.mark.parametrize("height_m", [-0.065, 0.0, 0.03, 0.4])
def test_a_robot_is_raised_out_of_the_ground_or_lowered_onto_it(height_m: float) -> None:
    found = stand(box(), ENVIRONMENT, placed(0.0, 0.0, height_m))
    assert found.found_ground
    assert found.placement.position_m == pytest.approx((0.0, 0.0, 0.0305), abs=2e-5)
    assert found.raised_m == pytest.approx(0.0305 - height_m, abs=2e-5)
    assert found.tilt_deg < 0.1
    assert found.sinks_m == pytest.approx(0.0005, abs=5e-4), "it falls through the gap and rests"


def test_a_step_is_stood_on() -> None:
    assert stand(box(), ENVIRONMENT, placed(1.0, 0.0, 0.2)).placement.position_m[2] == pytest.approx(0.0805, abs=2e-5)


def test_the_position_is_in_the_axes_of_the_mount() -> None:
    found = stand(box(), ENVIRONMENT, placed(0.1, 0.0, 0.0, mount="mount"))
    assert found.placement.position_m == pytest.approx((0.1, 0.0, 0.0305 - 0.2), abs=2e-5)


def test_a_robot_under_a_roof_stays_under_it() -> None:
    assert stand(box(), ENVIRONMENT, placed(2.0, 0.0, 0.0)).placement.position_m[2] == pytest.approx(0.0305, abs=2e-5)


def test_where_there_is_no_room_the_height_stays_and_it_is_said() -> None:
    found = stand(box(), ENVIRONMENT, placed(3.0, 0.0, 0.5))
    assert not found.found_ground
    assert found.placement.position_m == (3.0, 0.0, 0.5)
    assert "overlaps with block by" in found.note


def test_a_robot_that_tips_over_is_told() -> None:
    found = stand(box(narrow=0.05), ENVIRONMENT, placed(0.0, 0.0, 0.1, rotation=(4.0, 0.0, 0.0)))
    assert found.tilt_deg > 60
    assert "tips over" in found.note


def test_without_gravity_nothing_is_changed() -> None:
    floating = ENVIRONMENT.replace("<worldbody>", '<option gravity="0 0 0"/><worldbody>')
    found = stand(box(), floating, placed(0.0, 0.0, 0.4))
    assert found.placement.position_m == (0.0, 0.0, 0.4)
    assert "no gravity" in found.note


def test_a_robot_that_is_held_does_not_stand() -> None:
    with pytest.raises(UserError, match="only a free robot stands"):
        stand(box(), ENVIRONMENT, Placement(mount="mount", base="fixed"))
