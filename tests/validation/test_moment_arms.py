"""Rules on moment arms: what they leave alone, and moment arms against hand calculation."""

from __future__ import annotations

import faulty
import mujoco
import numpy as np
import pytest
import robots
from faulty import arm, swapped
from robots import Limb

from aidsr.sim.moment_arms import read_moment_arms
from aidsr.sim.structure import read_structure
from aidsr.validation import validate

CODES = ("same_cables", "cables_end_early", "cable_cancels", "site_misplaced", "cable_shared", "pulley_left")


def found(mjcf: str) -> list[tuple[str, str]]:
    return [(fault.code, fault.severity) for fault in validate(mjcf, select=[*CODES, "hinges_parallel"]).faults]


def test_the_moment_arm_of_a_straight_limb_is_the_distance_of_its_cables() -> None:
    limb = Limb(segments=8, length_m=0.2)
    model = mujoco.MjModel.from_xml_string(robots.arm(limb))
    structure = read_structure(model)
    arms = read_moment_arms(model, structure)
    (chain,) = structure.chains
    moments = np.array([arms.along(model, chain, tendon) for tendon in range(4)])
    assert moments.shape == (4, 8, 3)
    # a pull at +x turns about +y by r, one at +y about -x
    np.testing.assert_allclose(moments[0], np.tile([0, limb.offset_m, 0], (8, 1)), atol=0.02 * limb.offset_m)
    np.testing.assert_allclose(moments[1], np.tile([-limb.offset_m, 0, 0], (8, 1)), atol=0.02 * limb.offset_m)
    np.testing.assert_allclose(moments[2], -moments[0], atol=0.03 * limb.offset_m)


def helical(turns: float) -> str:
    """An arm whose first cable winds around it."""
    text = arm(segments=12)
    names = ["basea", *(f"{segment}{half}" for segment in range(12) for half in "ab")]
    for index, name in enumerate(names):
        angle = 2 * np.pi * turns * index / len(names)
        place = f"{0.0088 * np.cos(angle):.6g} {0.0088 * np.sin(angle):.6g}"
        text = swapped(rf'(<site name="t0_{name}" pos=")[^ ]+ [^ ]+', rf"\g<1>{place}", text)
    return text


def s_shaped() -> str:
    """An arm whose first and third cables change sides half way up."""
    return swapped(r'(<site name="t([02])_[4567][ab]" pos=")(-?)0', r"\g<1>\3-0", arm()).replace('"--', '"')


@pytest.mark.parametrize(
    "mjcf",
    [
        pytest.param(lambda: arm(tendons=2), id="two antagonists"),
        pytest.param(lambda: arm(tendons=8), id="eight cables around the limb"),
        pytest.param(lambda: helical(0.25), id="a quarter of a helix"),
        pytest.param(
            lambda: swapped(r"<actuator>", '<actuator><damper name="d" tendon="t0" kv="1" ctrlrange="0 1"/>', arm()),
            id="a damper beside a motor",
        ),
        pytest.param(lambda: swapped(r'<site site="t0_[67][ab]"/>', "", arm()), id="one cable of four ends early"),
        pytest.param(lambda: robots.worm(), id="worm"),
    ],
)
def test_sound_routing_has_no_fault(mjcf: object) -> None:
    assert callable(mjcf)
    assert found(mjcf()) == []


def test_a_damper_is_no_motor_of_a_shared_cable() -> None:
    text = faulty.example("cable_shared").replace(
        "<actuator>", '<actuator><damper name="d" tendon="front" kv="1" ctrlrange="0 1"/>'
    )
    (fault,) = validate(text, select=["cable_shared"]).faults
    assert set(fault.names) == {"pull_front", "pull_back"}
    assert fault.measured == 2


def test_a_cable_that_makes_an_s_is_a_warning() -> None:
    assert found(s_shaped()) == [("cable_cancels", "warning")]


def test_a_passive_tip_is_a_warning_and_half_a_limb_an_error() -> None:
    tip, half = (swapped(rf'<site site="t\d_[{kept}-7][ab]"/>', "", arm()) for kept in (5, 4))
    assert found(tip) == [("cables_end_early", "warning")]
    assert found(half) == [("cables_end_early", "error")]


def test_a_cable_nearer_to_the_backbone_is_another_cable() -> None:
    beside = swapped(r'(<site name="t2_\w+" pos=")-0\.0088', r"\g<1>0.0070", arm())
    assert found(beside) == []


def test_hinges_in_different_segments_may_be_parallel() -> None:
    planar = swapped(r'<joint name="j\d+x"[^>]*>', "", arm(tendons=2))
    assert found(planar) == []
