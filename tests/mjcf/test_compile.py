"""Compiling: what MuJoCo says becomes a fault with code, line and names, everything at once."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest

from aidsr.core.errors import MjcfError
from aidsr.mjcf.compile import compile_mjcf, load_mjcf, parse_mjcf, warnings_as_notes

ARM = """<mujoco>
<worldbody>
<site name="s0"/>
<body name="a">
<joint name="j"/>
<geom name="g" size="0.1"/>
<site name="s1"/>
</body>
</worldbody>
<tendon><spatial name="t"><site site="s0"/><site site="s1"/></spatial></tendon>
<actuator><motor name="m" tendon="t" ctrlrange="-1 0"/></actuator>
</mujoco>"""


def faults(text: str) -> list[tuple[str, int | None, tuple[str, ...]]]:
    with pytest.raises(MjcfError) as caught:
        compile_mjcf(text)
    return [(fault.code, fault.line, fault.names) for fault in caught.value.faults]


def in_body(inside: str) -> str:
    return ARM.replace('<geom name="g" size="0.1"/>', '<geom name="g" size="0.1"/>' + inside)


def at_end(section: str) -> str:
    return ARM.replace("</mujoco>", f"{section}\n</mujoco>")


def test_a_good_robot_compiles() -> None:
    model = compile_mjcf(ARM)
    assert (model.nbody, model.ntendon, model.nu) == (2, 1, 1)
    assert isinstance(parse_mjcf(ARM), mujoco.MjSpec)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (in_body('<geom type="spere" size="1"/>'), ("bad_value", 6, ("a",))),
        (in_body('<geom size="1 2 3 4"/>'), ("bad_value", 6, ("a",))),
        (in_body('<geom size="1" pos="0 0"/>'), ("bad_value", 6, ("a",))),
        (in_body('<geom size="a"/>'), ("bad_value", 6, ("a",))),
        (in_body('<geom name="h" size="-1"/>'), ("bad_value", 6, ("h",))),
        (in_body('<geom type="box" size="1"/>'), ("bad_value", 6, ("a",))),
        (in_body('<joint type="slide" axis="0 0 0"/>'), ("bad_value", 6, ("a",))),
        (in_body('<inertial mass="1" pos="0 0 0" diaginertia="1 1 9"/>'), ("bad_value", 4, ("a",))),
        (in_body('<geom size="1" euler="0 0 1" quat="1 0 0 0"/>'), ("wrong_for_type", 6, ("a",))),
        (in_body('<geom type="sphere" size="1" fromto="0 0 0 0 0 1"/>'), ("wrong_for_type", 6, ("a",))),
        (at_end('<sensor><ballquat joint="j"/></sensor>'), ("wrong_for_type", 12, ())),
        (in_body('<geom name="g" size="0.1"/>'), ("duplicate_name", 6, ("g",))),
        (at_end('<default><default class="x"/><default class="x"/></default>'), ("duplicate_name", 12, ())),
        (at_end('<sensor><jointpos joint="k"/></sensor>'), ("undefined_reference", 12, ("k",))),
        (at_end('<equality><weld body1="a" body2="b"/></equality>'), ("undefined_reference", 12, ("b",))),
        (at_end('<actuator><motor name="n"/></actuator>'), ("undefined_reference", 12, ("n",))),
        (in_body('<geom type="mesh" mesh="skull"/>'), ("missing_asset", 6, ("skull",))),
        (in_body('<joint name="k" range="30 -30" limited="true"/>'), ("joint_range_invalid", 6, ("k",))),
        (
            in_body('<body><joint type="ball" range="10 20"/><geom size="1"/></body>'),
            ("joint_range_invalid", 6, ("a",)),
        ),
        (ARM.replace('"-1 0"', '"0 -1" ctrllimited="true"'), ("ctrlrange_invalid", 11, ("m",))),
        (ARM.replace('<site site="s1"/>', ""), ("tendon_path_invalid", 10, ("t",))),
        (ARM.replace('<site site="s1"/>', '<geom geom="g"/>'), ("tendon_path_invalid", 10, ("t",))),
        (ARM.replace("</spatial>", '<pulley divisor="2"/></spatial>'), ("tendon_path_invalid", 10, ("t",))),
        (ARM.replace('<geom name="g" size="0.1"/>', ""), ("zero_mass", 4, ("a",))),
        (in_body("<freejoint/>"), ("invalid_joint_placement", 4, ("a",))),
        (ARM.replace("<body", '<joint name="w"/><body', 1), ("invalid_joint_placement", 4, ("w",))),
        (in_body("<body><freejoint/><geom size='1'/></body>"), ("invalid_joint_placement", 6, ("a",))),
        (at_end('<keyframe><key name="k" qpos="1 2 3"/></keyframe>'), ("keyframe_size", 12, ("k",))),
    ],
)
def test_each_mistake_has_its_code_line_and_name(text: str, fault: tuple[str, int | None, tuple[str, ...]]) -> None:
    assert faults(text) == [fault]


def test_everything_mujoco_would_say_one_by_one_is_said_at_once() -> None:
    segments = "".join(
        f'<body name="b{number}">\n<joint name="k{number}" range="1 0" limited="true"/>\n'
        f'<geom name="h{number}" size="0.1" pos="0 x 0"/>\n</body>\n'
        for number in range(20)
    )
    found = faults(in_body(segments))
    assert [code for code, _, _ in found].count("joint_range_invalid") == 20
    assert [code for code, _, _ in found].count("bad_value") == 20
    assert len(found) == 40


def test_what_follows_from_a_fault_is_not_said() -> None:
    text = at_end('<sensor><tendonpos tendon="t"/></sensor>').replace('<site site="s1"/>', '<site site="s9"/>')
    assert faults(text) == [("undefined_reference", 10, ("s9",))]
    assert faults(ARM.replace('<geom name="g" size="0.1"/>', '<geom name="g" size="big"/>')) == [
        ("bad_value", 6, ("g",))
    ]


def test_a_forbidden_document_is_never_given_to_mujoco_and_all_is_said() -> None:
    text = in_body('<include file="/etc/passwd"/><geom sizze="1"/>')
    assert {code for code, _, _ in faults(text)} == {"forbidden", "unknown_attribute"}


def test_the_fault_speaks_of_the_document_and_not_of_numbers_inside_mujoco() -> None:
    with pytest.raises(MjcfError, match=r"^<spatial> 't': tendon 't': spatial path must contain at least two objects$"):
        compile_mjcf(ARM.replace('<site site="s1"/>', ""))


def test_replicated_elements_compile_and_keep_their_lines() -> None:
    good = '<replicate count="3" offset="1 0 0"><body><geom size="0.1"/></body></replicate>'
    assert compile_mjcf(in_body(good)).nbody == 5
    assert faults(in_body(good.replace("0.1", "-1"))) == [("bad_value", 6, ("a",))]


CAPSULE = '<default><geom type="capsule" size="0.01"/></default>'
RED = '<default class="x"><geom rgba="1 0 0 1"/></default>'


def drawn_with(defaults: str, named: str) -> str:
    geom = f'<geom name="g" {named} fromto="0 0 0 0 0 0.1"/>'
    return f'<mujoco>{defaults}<worldbody><body name="a"><joint/>{geom}</body></worldbody></mujoco>'


@pytest.mark.parametrize(
    ("defaults", "named"),
    [
        (f'{CAPSULE}<default><joint damping="1"/></default>', ""),
        (f'{CAPSULE}<default><geom size="0.02"/>{RED}</default>', 'class="x"'),
        (f'<default><geom type="sphere"/></default>{CAPSULE}', ""),
    ],
)
def test_repeated_default_sections_are_one(defaults: str, named: str) -> None:
    assert compile_mjcf(drawn_with(defaults, named)).geom_type[0] == mujoco.mjtGeom.mjGEOM_CAPSULE


def test_warnings_of_the_compiler_are_notes_and_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    loaded = load_mjcf("```xml\n" + in_body('<joint name="k" solreflimit="-1 1" axis="0 0 1"/>') + "\n```")
    assert loaded.notes[0].startswith("Put aside")
    with warnings_as_notes() as warnings:
        data = mujoco.MjData(loaded.model)
        data.qpos[0] = float("nan")
        mujoco.mj_step(loaded.model, data)
    assert "Nan" in warnings[0]
    assert list(tmp_path.iterdir()) == []


def test_mujocos_own_reader_is_where_it_was_after_collecting_warnings() -> None:
    before = mujoco.get_mju_user_warning()
    with warnings_as_notes():
        assert mujoco.get_mju_user_warning() is not before
    assert mujoco.get_mju_user_warning() is before
