"""Joints that an equality couples are one degree of freedom together."""

import mujoco
import numpy as np

from aidsr.core.artifacts import Fault
from aidsr.sim.couplings import follow, onto_leaders, read_couplings
from aidsr.sim.moment_arms import read_moment_arms
from aidsr.sim.structure import read_structure
from aidsr.validation import validate
from aidsr.validation.registry import require_rule
from aidsr.validation.rules_page import EXAMPLE_ARM

LAW = '<joint joint1="j4" joint2="j3" polycoef="0.1 0.5 0.2 0 0"/>'


def coupled(text: str, *laws: str) -> str:
    assert "</mujoco>" in text
    return text.replace("</mujoco>", f"<equality>{''.join(laws)}</equality></mujoco>")


def faults(code: str, text: str) -> list[Fault]:
    return list(validate(text, select=[code]).faults)


def fails(code: str) -> str:
    rule = require_rule(code)
    assert rule.example is not None
    return rule.example.fails(EXAMPLE_ARM)


def test_a_follower_stands_where_the_equality_wants_it_after_its_leader() -> None:
    model = mujoco.MjModel.from_xml_string(coupled(EXAMPLE_ARM, '<joint joint1="j5" joint2="j4"/>', LAW))
    couplings, qpos = read_couplings(model), np.full(model.nq, 0.3)
    assert [model.joint(each.joint).name for each in couplings] == ["j4", "j5"]
    follow(model, couplings, qpos)
    assert np.allclose(qpos[2:5], [0.3, 0.1 + 0.5 * 0.3 + 0.2 * 0.09, 0.268])
    moved = onto_leaders(model, couplings, qpos, np.ones(model.nv))
    slope = 0.5 + 2 * 0.2 * 0.3
    assert np.allclose(moved, [1, 1, 1 + slope + slope, 0, 0, 1])


def test_a_joint_that_is_held_gives_no_moment_arm() -> None:
    model = mujoco.MjModel.from_xml_string(coupled(EXAMPLE_ARM, '<joint joint1="j2"/>'))
    arms = read_moment_arms(model, read_structure(model))
    assert not arms.led_m[..., 1].any()
    assert arms.arms_m[..., 1].any()
    assert np.array_equal(arms.led_m[..., 2], arms.arms_m[..., 2])


def test_hinges_about_one_line_are_no_fault_where_one_follows_another() -> None:
    text = fails("hinges_parallel")
    assert faults("hinges_parallel", text)
    assert faults("hinges_parallel", coupled(text, '<joint joint1="j3b" joint2="j4"/>')) == []


def test_a_keyframe_of_a_follower_is_only_warned_of() -> None:
    key = '<keyframe><key qpos="0 0 0 20 0 0"/></keyframe></mujoco>'
    text = EXAMPLE_ARM.replace("</mujoco>", key)
    assert [fault.severity for fault in faults("keyframe_out_of_range", text)] == ["error"]
    assert [fault.severity for fault in faults("keyframe_out_of_range", coupled(text, LAW))] == ["warning"]


def test_heads_of_one_muscle_are_only_warned_of() -> None:
    text = fails("same_cables")
    assert [fault.severity for fault in faults("same_cables", text)] == ["error"]
    muscles = text.replace('<motor name="pull', '<muscle name="pull').replace(
        'gear="-1" ctrlrange="0 20"', 'force="20"'
    )
    assert muscles.count("<muscle") == 2
    assert [fault.severity for fault in faults("same_cables", muscles)] == ["warning"]
