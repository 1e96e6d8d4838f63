"""Each repair removes the fault it claims, from robots broken on purpose."""

import re
from collections.abc import Callable
from pathlib import Path

import mujoco
import pytest
from jobs import DESERT, brief, concept, free_brief

from aidsr.core.artifacts import Critique, CritiqueIssue, Fault, ValidationReport
from aidsr.core.errors import UserError
from aidsr.teams import rules as builtin
from aidsr.teams.rules.coder import RuleCoder
from aidsr.teams.rules.edit import effective, parse, to_text
from aidsr.teams.rules.repairs import REPAIRS, Repair, blocks, mend, strength, winches
from aidsr.validation import validate


def arm() -> str:
    return RuleCoder().write(brief("button_pushing"), concept("button_pushing", "arm", "two sections")).mjcf


def swapped(pattern: str, new: str, text: str, count: int = 0) -> str:
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
def test_a_fault_is_repaired(code: str) -> None:
    text = BROKEN[code]()
    report = validate(text, mount="fixed")
    assert code in {fault.code for fault in report.errors}
    for _ in range(4):
        if report.stable:
            break
        mended = mend(text, report.errors)
        assert mended.done, mended.helpless
        text, report = mended.mjcf, validate(mended.mjcf, mount="fixed")
    assert report.stable, report.account()


def fault(code: str, *names: str) -> Fault:
    return Fault(code=code, layer="simulate", severity="error", names=names, message="seen")


def mended(code: str, *names: str, text: str = "") -> str:
    answer = mend(text or arm(), [fault(code, *names)])
    assert answer.done, code
    assert answer.done[0].startswith(f"{code}: ")
    return answer.mjcf


def test_stiffness_and_damping_follow_gravity_and_stiffness_faults() -> None:
    def joint(text: str) -> tuple[float, float]:
        found = re.search(r'<joint range="-0.6 0.6" .*stiffness="([\d.]+)" damping="([\d.]+)"', text)
        return float(found[1]), float(found[2])

    k, c = joint(arm())
    stiffer, softer = joint(mended("gravity_collapse")), joint(mended("too_stiff"))
    assert stiffer == (pytest.approx(1.8 * k, rel=1e-4), pytest.approx(1.8 * c, rel=1e-4))
    assert softer == (pytest.approx(0.6 * k, rel=1e-4), pytest.approx(0.6 * c, rel=1e-4))
    assert joint(mended("underdamped"))[1] == pytest.approx(2 * c, rel=1e-4)


def test_overlapping_bodies_of_a_scene_are_excluded_by_their_own_names() -> None:
    text = mended("initial_penetration", "robot/seg02", "robot/seg04")
    assert '<exclude body1="seg02" body2="seg04"/>' in text
    assert 'conaffinity="0"' in mended("self_collision_lock")


def test_only_the_named_actuators_get_stronger() -> None:
    before, after = arm(), mended("actuator_too_weak", "robot/pull_distal_060")
    changed = [line for line in after.splitlines() if line not in before.splitlines()]
    assert len(changed) == 1
    assert "pull_distal_060" in changed[0]


def test_servos_are_damped_and_let_go() -> None:
    servo = swapped(
        r'<general class="winch" (name="\w+" tendon="\w+")[^>]*/>',
        r'<position \1 kp="500" ctrlrange="0.2 0.3"/>',
        arm(),
    )
    assert 'kv="10"' in mended("chatter", text=servo)
    assert 'ctrlrange="0.2 0.39"' in mended("antagonist_lock", text=servo)


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
    ("repair", "actuator", "own", "written"),
    [
        (strength.weaken, SERVO, "", {"kp": "134", "kv": "2.68", "forcerange": "-20.1 0"}),
        (strength.weaken, 'position ctrlrange="0 0.3" forcerange="-30 0"', "", {"kp": "0.67", "forcerange": "-20.1 0"}),
        (strength.weaken, SERVO, 'tendon="t" dampratio="1"', {"kp": "134", "dampratio": "1", "kv": None}),
        (strength.weaken, DAMPED_BY_RATIO, 'tendon="t" kv="4"', {"kp": "134", "kv": "2.68"}),
        (strength.weaken, 'velocity ctrlrange="0 1"', "", {"kv": "0.67"}),
        (strength.weaken, 'general gainprm="-20" ctrlrange="0 1"', "", {"ctrlrange": "0 0.67", "gainprm": None}),
        (strength.weaken, 'motor gear="10"', "", {"gear": "6.7", "ctrlrange": None}),
        (winches.damp_servos, SERVO, "", None),
        (winches.damp_servos, 'position kp="0"', "", None),
        (winches.damp_servos, 'position kp="200" ctrlrange="0 0.3"', "", {"kv": "4", "kp": None}),
        (winches.damp_servos, SERVO, 'tendon="t" dampratio="1"', {"kv": "4", "dampratio": None}),
        (winches.damp_servos, DAMPED_BY_RATIO, "", {"kv": "4"}),
        (winches.soften_servos, SERVO, "", {"kp": "100", "kv": "2"}),
        (winches.soften_servos, DAMPED_BY_RATIO, "", {"kp": "100", "kv": None}),
        (winches.let_go, SERVO, "", {"ctrlrange": "0 0.39"}),
        (winches.pull_only, 'motor ctrlrange="-5 20"', "", {"ctrlrange": "-20 0"}),
        (blocks.add_control_ranges, 'motor forcerange="-30 0"', "", {"ctrlrange": "-30 0"}),
        (blocks.add_control_ranges, 'position kp="200"', 'joint="j"', {"ctrlrange": "-0.5 0.5"}),
    ],
)
def test_numbers_of_default_classes_are_mended_from_what_they_are(
    repair: Repair, actuator: str, own: str, written: dict[str, str | None] | None
) -> None:
    root = parse(classy(actuator, own))
    said = repair(root, fault("seen"))
    assert bool(said) == bool(written)
    mended = root.find("actuator")[0]
    assert {name: mended.get(name) for name in written or {}} == (written or {})
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
    assert effective(root, root.find("actuator")[0], attribute) == value
    model = mujoco.MjModel.from_xml_string(text)
    assert (model.actuator_gear if attribute == "gear" else model.actuator_gainprm)[0, 0] == in_mujoco


def test_motors_that_push_only_pull_afterwards() -> None:
    motor = swapped(r'<general class="winch" (name="\w+" tendon="\w+")[^>]*/>', r'<motor \1 ctrlrange="-5 20"/>', arm())
    assert 'ctrlrange="-20 0"' in mended("tendon_pushes", text=motor)


def test_repairs_grow_harder_until_none_is_left() -> None:
    text, said = arm(), []
    for _ in range(30):
        answer = mend(text, [fault("numerical_instability")])
        if not answer.done:
            break
        said.append(answer.done[0].split(": ")[1])
        text = answer.mjcf
        if "multiplied the force" in said[-1]:
            break
    assert "halved the time step to 1 ms" in said[0]
    assert any("doubled" in words for words in said)
    assert "multiplied the force" in said[-1]


def test_several_faults_of_one_code_count_once() -> None:
    text = swapped("ctrlrange", "ctrl_range", arm(), 3)
    report = validate(text)
    answer = mend(text, report.errors)
    assert len(answer.done) == 1
    assert not answer.helpless


def test_a_fault_without_repair_leads_to_a_sturdier_robot_and_is_said() -> None:
    rules, idea = builtin.team(1), concept("button_pushing", "arm", "two sections")
    robot = rules.coder.write(brief("button_pushing"), idea)
    report = ValidationReport(stable=False, faults=(fault("tendon_one_body", "tendon_distal_060"),))
    first = rules.coder.repair(brief("button_pushing"), idea, robot, report)
    second = rules.coder.repair(brief("button_pushing"), idea, first, report)
    assert 'model="arm_variation_1"' in first.mjcf
    assert 'model="arm_variation_2"' in second.mjcf
    assert "no repair for tendon_one_body" in first.notes
    assert rules.coder.repair(brief("button_pushing"), idea, robot, report) == first


def test_another_authors_robot_without_repair_is_left_and_said() -> None:
    asked = free_brief("Crawl away.", DESERT, arm())
    rules = builtin.team(1)
    idea = rules.designer.propose(asked, 1)[0]
    robot = rules.coder.write(asked, idea)
    report = ValidationReport(stable=False, faults=(fault("no_tendons"),))
    repaired = rules.coder.repair(asked, idea, robot, report)
    assert repaired.mjcf == robot.mjcf
    assert "no repair for no_tendons" in repaired.notes


def test_a_free_robot_keeps_its_free_joint_whatever_falls() -> None:
    idea = concept("flat_ground", "worm", "wave")
    robot = RuleCoder().write(brief("flat_ground"), idea)
    report = ValidationReport(stable=False, faults=(fault("free_fall", "tail"),))
    assert "<freejoint" in RuleCoder().repair(brief("flat_ground"), idea, robot, report).mjcf


def test_the_judges_issues_are_repaired_by_their_component() -> None:
    idea = concept("button_pushing", "arm", "two sections")
    robot = RuleCoder().write(brief("button_pushing"), idea)
    bare = robot.model_copy(update={"mjcf": BROKEN["no_sensors"]()})
    issue = CritiqueIssue(blame="coder", component="no_sensors", problem="the robot has no sensors of its own")
    repaired = RuleCoder().repair(brief("button_pushing"), idea, bare, Critique(passed=False, issues=(issue,)))
    assert "tendonpos" in repaired.mjcf


def test_a_concept_of_no_built_in_family_is_refused_in_a_sentence() -> None:
    idea = concept("button_pushing", "arm", "two sections").model_copy(update={"family": "octopus"})
    with pytest.raises(UserError, match="cannot write the family 'octopus'"):
        RuleCoder().write(brief("button_pushing"), idea)


def test_the_page_lists_every_code_that_is_repaired() -> None:
    page = (Path(__file__).parents[3] / "docs" / "builtin.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([a-z_, ]+) \|", page.partition("## Repairs")[2], re.MULTILINE)
    assert {code for row in rows for code in row.split(", ")} - {"faults"} == set(REPAIRS)
    assert all(REPAIRS.values())
