"""A broken robot comes back as the good one it was meant to be; a good one comes back untouched."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest
import robots

from aidsr.core.errors import UserError
from aidsr.fixes import FIXES, FixResult, fix
from aidsr.validation import validate

GOOD: dict[str, Callable[[], str]] = {
    "arm": robots.arm,
    "gripper": robots.gripper,
    "crawler": robots.crawler,
    "worm": robots.worm,
    "ring": robots.ring,
}

LIMB = """<mujoco>
  <compiler angle="radian" autolimits="true"/>
  <default>
    <joint axis="0 1 0" stiffness="0.2" damping="0.01"/>
    <default class="skin"><geom type="capsule" size="0.01" solref="0.004 1"/></default>
  </default>
  <worldbody>
    <body name="base">
      <geom name="plate" type="cylinder" size="0.02 0.005" pos="0 0 -0.02"/>
      <site name="a" pos="0.01 0 0"/>
      <body name="one" childclass="skin">
        <joint name="j1" range="-0.5 0.5"/>
        <geom name="g1" fromto="0 0 0.01 0 0 0.04"/>
        <site name="b" pos="0.01 0 0.02"/>
        <body name="two" pos="0 0 0.05">
          <joint name="j2" range="-0.5 0.5"/>
          <geom name="g2" fromto="0 0 0.01 0 0 0.04"/>
          <site name="c" pos="0.01 0 0.02"/>
          <body name="three" pos="0 0 0.05">
            <joint name="j3" type="ball" range="0 0.5"/>
            <geom name="ball" type="sphere" size="0.012"/>
            <site name="d" pos="0.01 0 0.01"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <tendon>
    <spatial name="t"><site site="a"/><site site="b"/><site site="c"/><site site="d"/></spatial>
  </tendon>
  <actuator><motor name="m" tendon="t" gear="-1" ctrlrange="0 5"/></actuator>
  <sensor><tendonpos name="length" tendon="t"/></sensor>
</mujoco>
"""


def swapped(pattern: str, new: str, text: str = LIMB, count: int = 0) -> str:
    changed, hits = re.subn(pattern, new, text, count=count)
    assert hits, f"nothing to change for {pattern}"
    return changed


ALL = [each.name for each in FIXES]

BROKEN: dict[str, tuple[str, str]] = {
    "dashes_in_comments": (swapped("<tendon>", "<!-- the tendon -- one -->\n  <tendon>"), ""),
    "dashes at both ends": (swapped("<tendon>", "<!---- tendon ---->\n  <tendon>"), "dashes_in_comments"),
    "bare_ampersands": (swapped('"skin"', '"skin & bone"'), ""),
    "stray_brackets": (swapped("<geom ", "<geom < ", count=1), ""),
    "bare_values": (swapped('size="0.02 0.005"', "size=0.02 0.005"), ""),
    "a bare word": (swapped('type="cylinder"', "type=cylinder"), "bare_values"),
    "repeated_attributes": (swapped('name="one"', 'name="one" name="one"'), ""),
    "unclosed_elements": (swapped('name="b" pos="0.01 0 0.02"/>', 'name="b" pos="0.01 0 0.02">'), ""),
    "misspelt_attributes": (swapped("stiffness=", "stifness="), ""),
    "letter case and underscore": (swapped("ctrlrange=", "ctrl_Range="), "misspelt_attributes"),
    "swapped letters": (swapped("fromto=", "formto=", count=1), "misspelt_attributes"),
    "missing_classes": (swapped('name="plate"', 'name="plate" class="metal"'), ""),
    "misspelt class": (swapped('childclass="skin"', 'childclass="skins"'), "missing_classes"),
    "fromto_without_shape": (
        swapped('name="g1"', 'name="g1" class="main" size="0.01" solref="0.004 1"'),
        "",
    ),
    "type of a class": (
        swapped('type="capsule" size="0.01"', 'type="sphere" size="0.01"'),
        "fromto_without_shape",
    ),
    "inherited_fromto": (
        swapped(
            ' fromto="0 0 0.01 0 0 0.04"/>',
            "/>",
            swapped('type="capsule" size="0.01"', 'type="capsule" size="0.01" fromto="0 0 0.01 0 0 0.04"'),
        ),
        "",
    ),
    "fromto_and_pos": (swapped('name="g1"', 'name="g1" pos="0 0 0.025"'), ""),
    "inherited pos": (
        swapped(
            'name="ball"',
            'name="ball" pos="0 0 0"',
            swapped('type="capsule" size="0.01"', 'type="capsule" size="0.01" pos="0 0 0.3"'),
        ),
        "fromto_and_pos",
    ),
    "repeated_guides": (swapped('<site site="b"/>', '<site site="b"/><site site="b"/>'), ""),
    "missing_limit_flags": (swapped('autolimits="true"', 'autolimits="false"'), ""),
    "inverted_ranges": (swapped("-0.5 0.5", "0.5 -0.5"), ""),
    "inverted control": (swapped('ctrlrange="0 5"', 'ctrlrange="5 0"'), "inverted_ranges"),
    "ball_ranges": (swapped('"0 0.5"', '"-0.5 0.5"'), ""),
    "degrees_in_radians": (swapped("-0.5 0.5", "-28.647889756541 28.647889756541"), ""),
}


def fixed(name: str) -> tuple[FixResult, str]:
    text, kind = BROKEN[name]
    return fix(text), kind or name


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_robot_becomes_the_good_one(name: str) -> None:
    answer, kind = fixed(name)
    assert set(answer.counts) == {kind}
    assert len(answer.notes) == sum(answer.counts.values())
    assert all(note.endswith(".") and "line" in note for note in answer.notes)
    assert_same_model(answer.mjcf, LIMB)
    assert_unchanged(fix(answer.mjcf), answer.mjcf)


@pytest.mark.parametrize("name", BROKEN)
def test_without_its_fix_it_stays_broken(name: str) -> None:
    text, kind = BROKEN[name]
    assert_unchanged(fix(text, only=[other for other in ALL if other != (kind or name)]), text)


def assert_unchanged(answer: FixResult, text: str) -> None:
    assert (answer.mjcf, answer.notes, answer.counts) == (text, (), {})


def assert_same_model(one: str, other: str) -> None:
    models = [mujoco.MjModel.from_xml_string(text) for text in (one, other)]
    for name in ("jnt_range", "jnt_limited", "jnt_stiffness", "geom_type", "geom_size", "geom_pos", "geom_quat"):
        np.testing.assert_allclose(*(getattr(model, name) for model in models), atol=1e-9, err_msg=name)
    sizes = [mujoco.mj_sizeModel(model) for model in models]
    buffers = [np.zeros(size, np.uint8) for size in sizes]
    assert sizes[0] == sizes[1]
    for model, buffer in zip(models, buffers, strict=True):
        model.jnt_range[:] = models[1].jnt_range
        mujoco.mj_saveModel(model, None, buffer)
    assert (buffers[0] == buffers[1]).all()


def sectioned(*sections: str) -> str:
    defaults = "".join(f"<default>{section}</default>" for section in sections)
    body = '<body childclass="x"><joint/><geom size="0.01" fromto="0 0 0 0 0 0.1"/></body>'
    return f"<mujoco>{defaults}<worldbody>{body}</worldbody></mujoco>"


def test_a_class_gets_what_the_sections_of_defaults_before_it_say_and_nothing_of_later_ones() -> None:
    named, cylinder = '<default class="x"/>', '<geom type="cylinder"/>'
    assert_unchanged(fix(sectioned(cylinder, named)), sectioned(cylinder, named))
    assert fix(sectioned(named, cylinder)).counts == {"fromto_without_shape": 1}


@pytest.mark.parametrize("name", GOOD)
def test_a_good_robot_is_left_as_it_is(name: str) -> None:
    text = GOOD[name]()
    assert_unchanged(fix(text), text)


def test_a_link_that_stands_in_its_base_is_let_through() -> None:
    text = swapped(r'pos="0 0 -0.0105"', 'pos="0 0 0.012"', robots.arm())
    answer = fix(text)
    assert answer.counts == {"attached_overlaps": 1}
    assert "'s0'" in answer.notes[0]
    assert "'base'" in answer.notes[0]
    assert not validate(text).stable
    assert validate(answer.mjcf).stable


def test_a_link_across_a_joint_without_shape_is_let_through() -> None:
    inertial = '<inertial pos="0 0 0" mass="0.01" diaginertia="1e-6 1e-6 1e-6"/>'
    gimbal = f'<body name="hub"><joint name="twist" axis="0 0 1"/>{inertial}'
    text = swapped(r'<body name="two" pos="0 0 0.05">', gimbal + r'<body name="two" pos="0 0 0.03">')
    text = swapped(r"(</body>\s*</body>\s*</body>\s*</worldbody>)", r"</body>\1", text)
    answer = fix(text)
    assert answer.counts == {"attached_overlaps": 1}
    assert 'body1="one" body2="two"' in answer.mjcf


def test_overlaps_of_strangers_are_left_alone() -> None:
    stranger = '<body name="post" pos="0 0 0.07"><geom size="0.02"/></body>'
    text = swapped("</worldbody>", stranger + "</worldbody>")
    assert_unchanged(fix(text), text)


def test_a_name_used_twice_is_changed_where_nothing_refers_to_it() -> None:
    answer = fix(swapped('name="g2"', 'name="g1"'))
    assert answer.counts == {"duplicate_names": 1}
    assert 'name="g1_2"' in answer.mjcf
    assert_same_model(swapped("g1_2", "g2", answer.mjcf), LIMB)


def test_a_name_that_others_refer_to_is_left_alone() -> None:
    text = swapped('name="g2"', 'name="g1"')
    assert_unchanged(fix(text, kept_names=["g1"]), text)


def test_a_name_used_twice_and_referred_to_is_left_alone() -> None:
    text = swapped('name="c"', 'name="b"')
    assert_unchanged(fix(text), text)


@pytest.mark.parametrize(
    "text",
    [
        swapped('name="g1"', 'name="g1" pos="0 0 0.1"'),
        swapped('name="ball" type="sphere"', 'name="ball" type="sphere" fromto="0 0 0 0 0 1"'),
        swapped('range="-0.5 0.5"', 'limited="true"'),
        swapped("stiffness=", "stffnes="),
        swapped('gear="-1"', 'gear="-1" joint1="j1"'),
        swapped('"0 0.5"', '"-0.3 0.5"'),
        swapped('"0 0.5"', '"0 -0.5"'),
        swapped('tendon="t" gear="-1"', 'joint="j1"', swapped('name="j1" range="-0.5 0.5"', 'name="j1" range="-9 9"')),
        swapped('class="skin">', 'class="skin"/>', LIMB),
        swapped('name="g1"', 'name="g1" pos="0 0 0"'),
        swapped('range="-0.5 0.5"', 'range="-6.2832 6.2832"'),
        swapped('range="-0.5 0.5"', 'range="-9.42 12.57"'),
        swapped('name="two"', 'name="two" euler="0 0 6.28319"'),
        swapped('name="two"', 'name="two" axisangle="0 0 1 -6.3"'),
        swapped('class="skin">', 'class="skin"><joint limited="false"/>', swapped("-0.5 0.5", "0.5 -0.5")),
        "no model at all",
        swapped('name="one"', 'name="one" name="two"'),
        swapped("</body>", "", count=1),
        swapped('<body name="two" pos="0 0 0.05">', '<body name="two" pos="0 0 0.05"/>'),
        swapped('name="b" pos="0.01 0 0.02"/>', 'name="b" pos="0.01 0 0.02"><!-- c --></site>', "< " + LIMB),
        LIMB[:-12],
        '<mujoco><include file="other.xml"/></mujoco>',
    ],
)
def test_what_could_mean_two_things_is_left_alone(text: str) -> None:
    assert_unchanged(fix(text), text)


def test_few_degrees_are_no_turns_of_a_wrist() -> None:
    answer = fix(swapped("-0.5 0.5", "-10 10"))
    assert answer.counts == {"degrees_in_radians": 2}
    assert answer.mjcf.count('range="-0.174532925 0.174532925"') == 2


TOLD = """<mujoco>
  <compiler autolimits="false"/>
  <default>{}<default class="x"/></default>
  <worldbody><body name="b"><joint name="j"/><geom size="0.1"/></body></worldbody>
  <tendon><fixed name="t" class="x" range="0 1"><joint joint="j" coef="1"/></fixed></tendon>
  <actuator><motor name="m" class="x" joint="j" ctrlrange="0 1"/></actuator>
</mujoco>"""


@pytest.mark.parametrize("told", ["true", "false"])
@pytest.mark.parametrize("kind", ["motor", "general", "position"])
def test_a_flag_that_a_class_gives_to_all_actuators_or_tendons_holds(kind: str, told: str) -> None:
    text = TOLD.format(f'<{kind} ctrllimited="{told}"/><tendon limited="{told}"/>')
    assert_unchanged(fix(text), text)
    assert mujoco.MjModel.from_xml_string(text).actuator_ctrllimited[0] == (told == "true")


def test_a_flag_that_no_class_gives_is_written_once_where_the_range_is() -> None:
    text = TOLD.format('<general ctrlrange="0 2"/><tendon limited="false"/>')
    answer = fix(text)
    assert answer.counts == {"missing_limit_flags": 1}
    assert mujoco.MjModel.from_xml_string(answer.mjcf).actuator_ctrllimited[0]


def test_ranges_of_every_kind_of_actuator_are_put_in_order() -> None:
    text = swapped("<motor .*/>", '<pid name="m" tendon="t" kp="9" ctrlrange="5 0"/>')
    assert fix(text).mjcf == text.replace('ctrlrange="5 0"', 'ctrlrange="0 5"').rstrip("\n")


def test_no_flag_is_written_that_the_element_does_not_know() -> None:
    damper = '<actuator><damper name="m" joint="j1" kv="1" ctrlrange="0 5"/></actuator>'
    text = swapped("<actuator>.*</actuator>", damper, swapped('autolimits="true"', 'autolimits="false"'))
    answer = fix(text).mjcf
    assert "ctrllimited" not in answer
    assert mujoco.MjModel.from_xml_string(answer).actuator_ctrlrange.tolist() == [[0, 5]]


def test_comments_and_layout_survive_a_fix() -> None:
    text = swapped("<sensor>", "<!-- what it feels -->\n  <sensor>", swapped("stiffness=", "stifness="))
    assert fix(text).mjcf == swapped("stifness=", "stiffness=", text).rstrip("\n")


def test_faults_of_the_document_that_no_safe_fix_changes_are_named() -> None:
    assert fix(LIMB).unfixed == ()
    assert fix(swapped("stiffness=", "stffnes=")).unfixed == ("unknown_attribute",)
    assert fix(LIMB[:-12]).unfixed == ("xml_syntax",)
    assert fix('<mujoco><include file="other.xml"/></mujoco>').unfixed == ("forbidden",)


def test_a_file_is_read_and_not_written(tmp_path: Path) -> None:
    file = tmp_path / "limb.xml"
    file.write_text(swapped("stiffness=", "stifness="))
    assert fix(file).counts == {"misspelt_attributes": 1}
    assert "stifness" in file.read_text()


def test_several_faults_are_fixed_at_once_and_counted_apart() -> None:
    text = swapped("-0.5 0.5", "0.5 -0.5", swapped("stiffness=", "stifness="))
    answer = fix(text)
    assert answer.counts == {"misspelt_attributes": 1, "inverted_ranges": 2}
    assert len(answer.notes) == 3
    assert_same_model(answer.mjcf, LIMB)


def test_a_fix_that_does_not_exist_is_refused() -> None:
    with pytest.raises(UserError, match=r"^no such fix: magic; choose from "):
        fix(LIMB, only=["magic"])
