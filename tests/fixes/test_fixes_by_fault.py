"""Each fix removes the fault it claims, from robots broken on purpose."""

import re
from collections.abc import Callable
from functools import cache

import mujoco
import numpy as np
import pytest
from lxml import etree

from aidsr.core.artifacts import Fault
from aidsr.fixes import FIXES, contact, fix, motion, ranges, strength
from aidsr.fixes.record import EditDocument, Request
from aidsr.mjcf.edit import effective_value, parse, to_text
from aidsr.mjcf.elements import Element
from aidsr.tasks import load_task
from aidsr.teams.rules.families.arm import ARM
from aidsr.teams.rules.job import read_job
from aidsr.validation import validate
from aidsr.validation.registry import require_rule
from aidsr.validation.rules_page import EXAMPLE_ARM


@cache
def arm() -> str:
    job = read_job(load_task("button_pushing").brief())
    return ARM.write(ARM.size(job, np.random.default_rng(0), "two sections")).mjcf


def swapped(pattern: str, new: str | Callable[[re.Match[str]], str], text: str, count: int = 0) -> str:
    changed, hits = re.subn(pattern, new, text, count=count)
    assert hits, f"nothing to change for {pattern}"
    return changed


def scaled(attribute: str, factor: float, text: str) -> str:
    return swapped(rf'(?<= ){attribute}="([\d.e-]+)"', lambda m: f'{attribute}="{float(m[1]) * factor:g}"', text)


BROKEN: dict[str, Callable[[], str]] = {
    "unknown_attribute": lambda: swapped("ctrlrange", "ctrl_range", arm(), 1),
    "undefined_reference": lambda: swapped('site="tip_touch"', 'site="tip_tuch"', arm()),
    "duplicate_name": lambda: swapped('name="seg02_skin"', 'name="seg01_skin"', arm()),
    "wrong_for_type": lambda: swapped('(name="tip_pad") size', r'\1 fromto="0 0 0 0 0 0.01" size', arm()),
    "no_actuators": lambda: swapped(r'<general class="winch" [^>]*/>|<actuatorfrc [^>]*/>', "", arm()),
    "no_sensors": lambda: swapped(r"(?s)<sensor>.*</sensor>", "", arm()),
    "ctrlrange_missing": lambda: swapped(r'ctrlrange="0 [\d.]+"', "", arm()),
    "range_inverted_ignored": lambda: swapped('range="-0.6 0.6"', 'range="0.6 -0.6"', arm(), 1),
    "joint_range_too_small": lambda: swapped('range="-0.6 0.6"', 'range="-0.01 0.01"', arm(), 1),
    "numerical_instability": lambda: swapped(r'damping="[\d.]+"', 'damping="0"', scaled("stiffness", 300, arm())),
    "energy_growth": lambda: swapped('damping="', 'damping="-', arm(), 1),
    "tendon_limit_violated": lambda: swapped('(name="tendon_distal_060")', r'\1 range="0 0.1"', arm()),
    "zero_gear": lambda: swapped('gainprm="-1"', 'gainprm="0"', arm()),
    "actuator_too_weak": lambda: swapped(
        r'ctrlrange="[^"]*" forcerange="[^"]*"', 'ctrlrange="0 0.08" forcerange="-0.08 0"', arm()
    ),
    "free_fall": lambda: swapped('(<body name="base">)', r'\1<joint name="slip" type="slide" axis="0 0 1"/>', arm()),
}  # fmt: skip


@pytest.mark.parametrize("code", BROKEN)
def test_a_fault_is_fixed(code: str) -> None:
    text = BROKEN[code]()
    report = validate(text, mount="fixed")
    assert code in {fault.code for fault in report.errors}
    for _ in range(4):
        if report.stable:
            break
        answer = fix(text, report.errors)
        assert answer.notes, answer.unfixed
        text, report = answer.mjcf, validate(answer.mjcf, mount="fixed")
    assert report.stable, report.account()


@pytest.mark.parametrize(
    "code",
    [
        "actuator_too_weak",
        "chatter",
        "energy_growth",
        "initial_penetration",
        "mass_ratio",
        "numerical_instability",
        "self_collision_lock",
        "tendons_not_actuated",
        "wrong_for_type",
    ],
)
def test_the_example_of_a_rule_is_left_without_an_error(code: str) -> None:
    example = require_rule(code).example
    assert example is not None
    text = example.fails(EXAMPLE_ARM)
    for _ in range(2):
        mine = [fault for fault in validate(text).errors if fault.code == code]
        text = fix(text, mine).mjcf if mine else text
    assert not validate(text).errors


def test_a_base_moves_out_of_what_it_overlaps_and_keeps_its_contacts() -> None:
    text = swapped('pos="0 0 -0.011"', 'pos="0 0 0"', EXAMPLE_ARM)
    answer = fix(text, validate(text).errors)
    assert answer.notes == ("initial_penetration: moved base by 9.5 mm, out of g1",)
    assert "<exclude" not in answer.mjcf
    model = mujoco.MjModel.from_xml_string(answer.mjcf)
    assert model.geom("base").pos[2] == pytest.approx(-0.0095)


def test_a_heavy_inertial_is_scaled_as_a_whole() -> None:
    heavy = '<inertial pos="0 0 0.01" mass="20" diaginertia="0.02 0.02 0.02"/>'
    text = swapped('(<geom name="g6"/>)', rf"\1{heavy}", EXAMPLE_ARM)
    found = Fault(code="mass_ratio", layer="simulate", severity="error", names=("s6",), measured=2000.0, message="seen")
    inertial = parse(fix(text, [found]).mjcf).find(".//inertial")
    assert inertial is not None
    assert (inertial.get("mass"), inertial.get("diaginertia")) == ("0.01", "1e-05 1e-05 1e-05")


def fault(code: str, *names: str) -> Fault:
    return Fault(code=code, layer="simulate", severity="error", names=names, message="seen")


def fixed(code: str, *names: str, text: str = "") -> str:
    answer = fix(text or arm(), [fault(code, *names)])
    assert answer.notes, code
    assert answer.notes[0].startswith(f"{code}: ")
    return answer.mjcf


def test_stiffness_and_damping_follow_gravity_and_stiffness_faults() -> None:
    def joint(text: str) -> tuple[float, float]:
        found = re.search(r'<joint range="-0.6 0.6" .*stiffness="([\d.]+)" damping="([\d.]+)"', text)
        return float(found[1]), float(found[2])

    k, c = joint(arm())
    stiffer, softer = joint(fixed("gravity_collapse")), joint(fixed("too_stiff"))
    assert stiffer == (pytest.approx(1.8 * k, rel=1e-4), pytest.approx(1.8 * c, rel=1e-4))
    assert softer == (pytest.approx(0.6 * k, rel=1e-4), pytest.approx(0.6 * c, rel=1e-4))
    assert joint(fixed("underdamped"))[1] == pytest.approx(2 * c, rel=1e-4)


def test_overlapping_bodies_of_a_scene_are_excluded_by_their_own_names() -> None:
    text = fixed("initial_penetration", "robot/seg02", "robot/seg04")
    assert '<exclude body1="seg02" body2="seg04"/>' in text


def test_what_holds_a_limb_is_excluded_but_not_fingers_that_hold_each_other() -> None:
    text = fixed("self_collision_lock", "pull", "robot/seg02", "robot/seg04")
    assert '<exclude body1="seg02" body2="seg04"/>' in text
    fingers = '<mujoco><worldbody><body name="left"/><body name="right"/></worldbody></mujoco>'
    root = parse(fingers)
    assert list(contact.exclude_locking(root, Request(fault("self_collision_lock", "left", "right")))) == []
    assert root.find("contact") is None


def pulled_arm(mass_kg: float) -> str:
    return f"""<mujoco><option gravity="0 0 -10"/><worldbody><site name="s0" pos="0.01 0 0"/>
    <body><joint name="j" axis="0 1 0" stiffness="4" damping="1"/><geom size="0.01" mass="{mass_kg}" pos="0 0 -0.05"/>
    <site name="s1" pos="0.01 0 -0.05"/></body></worldbody>
    <tendon><spatial name="t"><site site="s0"/><site site="s1"/></spatial></tendon>
    <actuator><motor name="p" tendon="t" ctrlrange="-1000 0"/></actuator></mujoco>"""


def test_springs_follow_a_force_that_was_too_much() -> None:
    overforce = fault("actuator_overforce").model_copy(update={"measured": 1000.0, "limit": 100.0})
    root = parse(pulled_arm(1.0))
    notes = list(strength.weaken(root, Request(overforce)))
    assert root.find(".//motor").get("ctrlrange") == "-90 0"
    assert notes == ["multiplied the force of 1 actuator by 0.09", "multiplied joint stiffness and damping by 0.22"]


def test_a_robot_that_no_allowed_pull_could_move_keeps_its_forces() -> None:
    overforce = fault("actuator_overforce").model_copy(update={"measured": 1000.0, "limit": 100.0})
    root = parse(pulled_arm(1000.0))
    assert not list(strength.weaken(root, Request(overforce)))
    assert root.find(".//motor").get("ctrlrange") == "-1000 0"


def test_only_the_named_actuators_get_stronger() -> None:
    before, after = arm(), fixed("actuator_too_weak", "robot/pull_distal_060")
    changed = [line for line in after.splitlines() if line not in before.splitlines()]
    assert len(changed) == 1
    assert "pull_distal_060" in changed[0]


def test_servos_are_damped_and_let_go() -> None:
    servo = swapped(
        r'<general class="winch" (name="\w+" tendon="\w+")[^>]*/>',
        r'<position \1 kp="500" ctrlrange="0.2 0.3"/>',
        arm(),
    )
    assert 'kv="10"' in fixed("chatter", text=servo)
    assert 'ctrlrange="0.2 0.39"' in fixed("antagonist_lock", text=servo)


GENERAL_SERVO = (
    '<general name="{name}" tendon="{tendon}" ctrlrange="0.1 0.14" forcerange="-40 40" biastype="affine" '
    'gainprm="2000" biasprm="0 -2000 -20000"/>'
)


def test_servos_written_as_general_actuators_are_servos() -> None:
    motors = r'<motor name="(\w+)" tendon="(\w+)"[^>]*/>'
    text = swapped(motors, lambda found: GENERAL_SERVO.format(name=found[1], tendon=found[2]), EXAMPLE_ARM)
    pulling = fixed("tendon_pushes", text=text)
    assert pulling.count('ctrlrange="0.1 0.14"') == pulling.count('forcerange="-40 0"') == 2
    assert fixed("chatter", text=text).count('biasprm="0 -2000 -40"') == 2
    softer = mujoco.MjModel.from_xml_string(to_text(edited(motion.soften_servos, text)))
    assert softer.actuator_gainprm[0, 0] == 1000
    assert list(softer.actuator_biasprm[0, :3]) == [0, -1000, -10000]
    assert fixed("antagonist_lock", text=text).count('ctrlrange="0.1 0.182"') == 2
    weaker = mujoco.MjModel.from_xml_string(to_text(edited(strength.weaken, text)))
    assert weaker.actuator_gainprm[0, 0] == 1340
    assert list(weaker.actuator_biasprm[0, :3]) == [0, -1340, -13400]
    assert list(weaker.actuator_ctrlrange[0]) == [0.1, 0.14], "a lower command would be a shorter cable"
    assert list(weaker.actuator_forcerange[0]) == [-26.8, 26.8]


def test_a_general_servo_without_a_gain_has_a_gain_of_one() -> None:
    text = classy('general biastype="affine" biasprm="0 -1 0" ctrlrange="0 0.3"')
    servo = edited(motion.soften_servos, text).find("actuator")[0]
    assert (servo.get("gainprm"), servo.get("biasprm")) == ("0.5", "0 -0.5 0")


def edited(edit: EditDocument, text: str) -> Element:
    root = parse(text)
    assert list(edit(root, Request()))
    return root


def classy(actuator: str, own: str = "") -> str:
    """A limb with one actuator whose numbers stand in its default class."""
    tag = actuator.split(maxsplit=1)[0]
    return f"""<mujoco><compiler angle="radian"/><option integrator="implicitfast"/><default>
    <default class="own"><joint range="-0.5 0.5" damping="1"/><{actuator}/></default></default>
    <worldbody><site name="up" pos="0 0 0.2"/><body name="a"><joint name="j" class="own" axis="0 1 0"/>
    <geom size="0.01" mass="0.1"/><site name="low" pos="0.05 0 0.1"/></body></worldbody>
    <tendon><spatial name="t"><site site="up"/><site site="low"/></spatial></tendon>
    <actuator><{tag} name="p" class="own" {own or 'tendon="t"'}/></actuator></mujoco>"""


SERVO = 'position kp="200" kv="4" ctrlrange="0 0.3" forcerange="-30 0"'
DAMPED_BY_RATIO = 'position kp="200" dampratio="1" ctrlrange="0 0.3"'


@pytest.mark.parametrize(
    ("apply", "actuator", "own", "written"),
    [
        (strength.weaken, SERVO, "", {"kp": "134", "kv": "2.68", "forcerange": "-20.1 0"}),
        (strength.weaken, 'position ctrlrange="0 0.3" forcerange="-30 0"', "", {"kp": "0.67", "forcerange": "-20.1 0"}),
        (strength.weaken, SERVO, 'tendon="t" dampratio="1"', {"kp": "134", "dampratio": "1", "kv": None}),
        (strength.weaken, DAMPED_BY_RATIO, 'tendon="t" kv="4"', {"kp": "134", "kv": "2.68"}),
        (strength.weaken, 'velocity ctrlrange="0 1"', "", {"kv": "0.67"}),
        (strength.weaken, 'general gainprm="-20" ctrlrange="0 1"', "", {"ctrlrange": "0 0.67", "gainprm": None}),
        (strength.weaken, 'motor gear="10"', "", {"gear": "6.7", "ctrlrange": None}),
        (motion.damp_servos, SERVO, "", None),
        (motion.damp_servos, 'position kp="0"', "", None),
        (motion.damp_servos, 'position kp="200" ctrlrange="0 0.3"', "", {"kv": "4", "kp": None}),
        (motion.damp_servos, SERVO, 'tendon="t" dampratio="1"', {"kv": "4", "dampratio": None}),
        (motion.damp_servos, DAMPED_BY_RATIO, "", {"kv": "4"}),
        (motion.soften_servos, SERVO, "", {"kp": "100", "kv": "2"}),
        (motion.soften_servos, DAMPED_BY_RATIO, "", {"kp": "100", "kv": None}),
        (strength.let_go, SERVO, "", {"ctrlrange": "0 0.39"}),
        (strength.pull_only, 'motor ctrlrange="-5 20"', "", {"ctrlrange": "-20 0"}),
        (ranges.add_control_ranges, 'motor forcerange="-30 0"', "", {"ctrlrange": "-30 0"}),
        (ranges.add_control_ranges, 'position kp="200"', 'joint="j"', {"ctrlrange": "-0.5 0.5"}),
    ],
)
def test_numbers_of_default_classes_are_scaled_from_what_they_are(
    apply: EditDocument, actuator: str, own: str, written: dict[str, str | None] | None
) -> None:
    root = parse(classy(actuator, own))
    notes = list(apply(root, Request(fault("seen"))))
    assert bool(notes) == bool(written)
    actuator_element = root.find("actuator")[0]
    assert {name: actuator_element.get(name) for name in written or {}} == (written or {})
    mujoco.MjModel.from_xml_string(to_text(root))


@pytest.mark.parametrize(
    ("defaults", "tag", "attribute", "value", "in_mujoco"),
    [
        ('<default><geom mass="1"/></default><default><motor gear="3"/></default>', "motor", "gear", "3", 3.0),
        ('<default><general gear="3" gainprm="-10"/></default>', "motor", "gear", "3", 3.0),
        ('<default><general gear="3" gainprm="-10"/></default>', "motor", "gainprm", None, 1.0),
        ('<default><intvelocity kp="200"/></default>', "position", "kp", None, 1.0),
        ('<default><position kp="200"/></default>', "position", "kp", "200", 200.0),
    ],
)
def test_values_after_default_classes_are_those_of_mujoco(
    defaults: str, tag: str, attribute: str, value: str | None, in_mujoco: float
) -> None:
    text = f"""<mujoco>{defaults}<worldbody><body><joint name="j"/><geom size="0.1"/></body></worldbody>
    <actuator><{tag} joint="j"/></actuator></mujoco>"""
    root = parse(text)
    assert effective_value(root, root.find("actuator")[0], attribute) == value
    model = mujoco.MjModel.from_xml_string(text)
    assert (model.actuator_gear if attribute == "gear" else model.actuator_gainprm)[0, 0] == in_mujoco


def test_motors_that_push_only_pull_afterwards() -> None:
    motor = swapped(r'<general class="winch" (name="\w+" tendon="\w+")[^>]*/>', r'<motor \1 ctrlrange="-5 20"/>', arm())
    assert 'ctrlrange="-20 0"' in fixed("tendon_pushes", text=motor)


@pytest.mark.parametrize(
    ("servo", "wanted"),
    [
        ('kp="200" ctrlrange="0.1 0.2"', "-2.361 0"),
        ('kp="200" ctrlrange="0.2 0.3"', None),
        ('kp="200" ctrlrange="0.1 0.2" forcerange="-20 40"', "-20 0"),
        ('kp="200" ctrlrange="-0.2 -0.1" gear="-1" forcerange="-40 20"', "0 20"),
    ],
)
def test_servos_that_push_only_pull_afterwards(servo: str, wanted: str | None) -> None:
    root = parse(classy(f"position {servo}"))
    assert bool(list(strength.pull_only(root, Request(fault("tendon_pushes", "p"))))) == bool(wanted)
    assert root.find("actuator")[0].get("forcerange") == wanted


def test_the_commonest_pushing_servo_is_cured() -> None:
    servo = swapped(
        r'<motor (name="\w+" tendon="\w+")[^>]*/>', r'<position \1 kp="500" kv="5" ctrlrange="0.1 0.14"/>', EXAMPLE_ARM
    )
    report = validate(servo)
    assert "tendon_pushes" in {fault.code for fault in report.errors}
    assert not validate(fix(servo, report.errors).mjcf).errors


def test_fixes_grow_harder_until_none_is_left() -> None:
    text, said = arm(), []
    for _ in range(30):
        answer = fix(text, [fault("numerical_instability")])
        if not answer.notes:
            break
        said.append(answer.notes[0].split(": ")[1])
        text = answer.mjcf
        if "multiplied the force" in said[-1]:
            break
    assert "halved the time step to 1 ms" in said[0]
    assert any("doubled" in words for words in said)
    assert "multiplied the force" in said[-1]


def test_several_faults_of_one_code_count_once() -> None:
    text = swapped("ctrlrange", "ctrl_range", arm(), 3)
    report = validate(text)
    answer = fix(text, report.errors)
    assert len(answer.notes) == 1
    assert not answer.unfixed


def test_an_attribute_with_two_slips_is_guessed_and_one_of_another_element_dropped() -> None:
    text = fixed("unknown_attribute", text=swapped('stiffness="', 'gear="1" stffnes="', arm(), 1))
    assert text == arm()


def test_a_word_that_an_attribute_is_short_for_is_written_as_the_attribute() -> None:
    text = fixed("unknown_attribute", text=swapped(' pos="', ' position="', arm(), 1))
    assert text == arm(), "dropped, the body would stand in another"


def test_a_word_that_only_begins_like_an_attribute_is_dropped() -> None:
    text = fixed("unknown_attribute", text=swapped(' stiffness="', ' damping_ratio="0.77" stiffness="', arm(), 1))
    assert "ratio" not in text
    assert '"0.77"' not in text, "as damping, it would be 0.77 N m s/rad"


def test_a_name_that_is_referred_to_is_changed_where_it_stands_for_the_second_time() -> None:
    text = swapped(
        '<site name="tip_touch"',
        '<site name="functional_end"/><site name="functional_end"/><site name="tip_touch"',
        arm(),
    )
    text = swapped("</sensor>", '<framepos objtype="site" objname="functional_end"/></sensor>', text)
    assert fix(text).unfixed == ("duplicate_name",)
    answer = fix(text, [fault("duplicate_name", "functional_end")])
    assert answer.counts == {"duplicate_names_in_use": 1}
    assert answer.mjcf.count('"functional_end"') == 2
    assert '"functional_end_2"' in answer.mjcf


def test_a_reference_is_corrected_among_names_of_its_kind_only() -> None:
    text = swapped("</sensor>", '<tendonpos tendon="tip_touch"/><jointpos joint="seg01_bendx"/></sensor>', arm())
    answer = fix(text, [fault("undefined_reference", "tip_touch", "seg01_bendx")])
    assert "<tendonpos tendon" not in answer.mjcf.replace('name="', "")
    assert 'site="tip_touch"' in answer.mjcf, "the sensor of a site that exists stays"


def test_joints_that_tendons_name_are_left_alone() -> None:
    text = classy(SERVO).replace("</tendon>", '<fixed name="f"><joint joint="j" coef="1"/></fixed></tendon>')
    for code in ("chatter", "energy_growth", "numerical_instability"):
        answer = fix(text, [fault(code)])
        mujoco.MjModel.from_xml_string(answer.mjcf)
        assert '<joint joint="j" coef="1"/>' in answer.mjcf


def test_an_unsafe_document_is_fixed_by_fault_and_never_compiled() -> None:
    text = arm().replace("<worldbody>", '<worldbody><include file="other.xml"/>').replace("ctrlrange", "ctrl_range")
    answer = fix(text, [fault("unknown_attribute"), fault("forbidden"), fault("initial_penetration")])
    assert answer.unfixed == ("forbidden", "initial_penetration")
    assert "ctrl_range" not in answer.mjcf


def test_a_text_that_is_not_xml_is_fixed_where_comments_are_why() -> None:
    text = arm().replace("<worldbody>", "<!-- a -- b --><worldbody>")
    answer = fix(text, [fault("xml_syntax")])
    assert answer.counts == {"dashes_in_comments": 1}
    assert answer.unfixed == ()
    assert fix("no model", [fault("xml_syntax")]).unfixed == ("xml_syntax",)


def test_many_fixes_of_one_fault_are_summed_up() -> None:
    answer = fix(arm().replace("ctrlrange", "ctrl_range"), [fault("unknown_attribute")])
    assert answer.notes[0].count("wrote ctrlrange for ctrl_range") == 3
    assert answer.notes[0].endswith("more like it")


def test_every_fix_has_a_name_of_its_own_and_says_what_it_does() -> None:
    names = [each.name for each in FIXES]
    assert len(names) == len(set(names))
    assert all(each.doc.endswith((".", ":")) for each in FIXES), [each.name for each in FIXES if not each.doc]
    assert all(each.safe or each.cures for each in FIXES)


@pytest.mark.parametrize("code", ["zero_gear", "antagonist_lock"])
def test_what_acts_again_does_not_push(code: str) -> None:
    rule = require_rule(code)
    assert rule.example is not None
    text = rule.example.fails(EXAMPLE_ARM)
    fixed_text = fix(text, validate(text).errors).mjcf
    assert {fault.code for fault in validate(fixed_text).errors} == set()


def test_a_cable_goes_through_the_nearer_of_two_sites_that_shared_a_name() -> None:
    limbs = "".join(
        f'<body><joint stiffness="1"/><geom size="0.01"/><site name="{limb}0"/>'
        f'<body pos="0 0 0.1"><joint stiffness="1"/><geom size="0.01"/><site name="mid"/>'
        f'<body pos="0 0 0.1"><joint stiffness="1"/><geom size="0.01"/><site name="{limb}2"/></body></body></body>'
        for limb in "ab"
    )
    paths = "".join(
        f'<spatial><site site="{limb}0"/><site site="mid"/><site site="{limb}2"/></spatial>' for limb in "ab"
    )
    text = f"<mujoco><worldbody>{limbs}</worldbody><tendon>{paths}</tendon></mujoco>"
    answer = fix(text, [fault("duplicate_name", "mid")])
    stops = [stop.get("site") for stop in etree.fromstring(answer.mjcf.encode()).iterfind("tendon/spatial/site")]
    assert stops == ["a0", "mid", "a2", "b0", "mid_2", "b2"]


def edited_arm(pattern: str, new: str) -> str:
    return swapped(pattern, new, EXAMPLE_ARM, count=1)


@pytest.mark.parametrize(
    ("code", "text", "wanted"),
    [
        (
            "joint_range_invalid",
            edited_arm('<joint name="j3"/>', '<joint name="j3" limited="true" range="10 10"/>'),
            'range="-45 45"',
        ),
        (
            "joint_range_invalid",
            edited_arm(
                '<joint name="j3"/>', '<joint name="j3" type="ball" axis="0 0 1" range="0.2 40" limited="true"/>'
            ),
            'range="0 40"',
        ),
        ("tendon_path_invalid", edited_arm('<site site="front6"/>', '<site site="front6"/><geom geom="g6"/>'), ""),
        ("tendon_path_invalid", edited_arm('<site site="front6"/>', '<site site="front6"/><pulley divisor="2"/>'), ""),
        ("tendon_path_invalid", edited_arm(r'(?s)<site site="front1"/>.*?(?=</spatial>)', ""), ""),
        ("undefined_reference", edited_arm('<site site="front3"/>', '<site site="front503"/>'), ""),
        ("undefined_reference", edited_arm('tendon="front"', 'tendon="vorne"'), ""),
        (
            "loaded_spring",
            edited_arm('<joint name="j3"/>', '<joint name="j3" range="5 45"/>'),
            '<joint name="j3" range="0 45"/>',
        ),
    ],
)
def test_a_slip_is_put_right_where_the_rest_of_the_document_says_how(code: str, text: str, wanted: str) -> None:
    report = validate(text)
    assert code in {fault.code for fault in report.errors}
    answer = fix(text, report.errors)
    assert wanted in answer.mjcf + "".join(answer.notes)
    assert not validate(answer.mjcf).errors


def test_a_shape_with_two_ends_leaves_a_class_that_gives_it_no_size() -> None:
    text = """<mujoco><default><default class="dot"><geom type="sphere"/></default>
      <default class="round"><geom type="capsule" size="0.01"/></default></default><worldbody><body childclass="round">
      <joint/><geom class="dot" fromto="0 0 0 0 0 0.1"/></body></worldbody></mujoco>"""
    left = fixed("wrong_for_type", text=text)
    assert 'class="dot" fromto' not in left
    mujoco.MjModel.from_xml_string(left)


def test_a_cable_that_no_other_shows_the_way_stays_cut() -> None:
    alone = edited_arm(r'(?s)<site site="front1"/>.*?(?=</spatial>)', "").replace('"back0"', '"rear_first"')
    assert fix(alone, [fault("tendon_path_invalid")]).unfixed == ("tendon_path_invalid",)


def test_ranges_of_ball_joints_that_get_wider_begin_with_zero() -> None:
    text = """<mujoco><default><joint type="ball"/><default class="tight"><joint range="0 10"/></default></default>
      <worldbody><body childclass="tight"><joint/><geom size="0.1"/></body></worldbody></mujoco>"""
    assert 'range="0 ' in fixed("joint_range_too_small", text=text)


def test_a_slide_in_a_class_keeps_its_range_in_metres() -> None:
    text = """<mujoco><default><default class="rail"><joint type="slide" range="0 0.05"/></default>
      <default class="tight"><joint range="-0.5 0.5"/></default></default><worldbody>
      <body><joint class="rail"/><joint class="rail" range="0 0.04"/><geom size="0.1"/>
      <body><joint name="a" class="tight"/><joint name="b" class="tight" axis="0 1 0"/><geom size="0.1"/></body></body>
      </worldbody></mujoco>"""
    whole = fixed("joint_range_too_small", text=text)
    assert 'range="0 0.05"' in whole
    assert 'range="0 0.04"' in whole
    assert '<joint range="-28.6479 28.6479"/>' in whole
    of_one = fixed("joint_range_too_small", "a", text=text)
    assert '<joint name="a" class="tight" range="-28.6479 28.6479"/>' in of_one
    assert '<joint range="-0.5 0.5"/>' in of_one


def test_a_free_joint_whose_class_says_so_gets_no_damping() -> None:
    text = """<mujoco><option integrator="implicitfast"/><default><default class="loose"><joint type="free"/></default>
      </default><worldbody>
      <body><joint class="loose"/><geom size="0.1"/>
      <body><joint stiffness="1"/><geom size="0.1"/></body></body></worldbody></mujoco>"""
    damped = fixed("energy_growth", text=text)
    assert '<joint class="loose"/>' in damped
    assert '<joint stiffness="1" damping="0.01"/>' in damped


def test_contacts_that_are_switched_off_are_switched_on() -> None:
    text = arm().replace("<worldbody>", '<option><flag contact="disable"/></option><worldbody>')
    assert "disable" not in fixed("contact_disabled", text=text)


def test_a_control_range_that_is_missing_follows_the_gain() -> None:
    text = swapped(' ctrlrange="[^"]*"', "", EXAMPLE_ARM).replace('gear="-1"', 'gear="-30"')
    assert 'ctrlrange="0 0.5"' in fixed("ctrlrange_missing", text=text)


def test_winches_pull_as_hard_as_bending_takes() -> None:
    weak, strong = (
        fixed("no_actuators", text=re.sub("(?s)<actuator>.*</actuator>", "", text))
        for text in (scaled("stiffness", 0.1, EXAMPLE_ARM), scaled("stiffness", 1.0, EXAMPLE_ARM))
    )
    pulls = [float(re.findall(r'ctrlrange="0 ([^"]+)"', text)[-1]) for text in (weak, strong)]
    assert pulls[1] == pytest.approx(10 * pulls[0], rel=0.05)
