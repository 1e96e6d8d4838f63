"""The built-in Coder: fixes by fault code, then a sturdier relative, then says that it cannot."""

import re

import pytest
from jobs import DESERT, brief, concept, free_brief

from aidsr.core.artifacts import Critique, CritiqueIssue, Fault, Keep, ValidationReport
from aidsr.core.errors import UserError
from aidsr.mjcf.kept_parts import changes_to_kept_parts
from aidsr.teams import rules as builtin
from aidsr.teams.rules.coder import RuleCoder


def arm() -> str:
    return RuleCoder().write(brief("button_pushing"), concept("button_pushing", "arm", "two sections")).mjcf


def fault(code: str, *names: str) -> Fault:
    return Fault(code=code, layer="simulate", severity="error", names=names, message="seen")


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


def test_a_fix_leaves_alone_what_a_person_keeps() -> None:
    text = re.sub('damping="[^"]*"', 'damping="0"', arm())
    asked = free_brief("Touch the switch.", DESERT, text)
    rules = builtin.team(1)
    idea = rules.designer.propose(asked, 1)[0]
    robot = rules.coder.write(asked, idea)
    report = ValidationReport(stable=False, faults=(fault("energy_growth"),))
    assert rules.coder.repair(asked, idea, robot, report).mjcf != robot.mjcf
    section = re.findall('<body name="(seg[^"]*)"', text)[0]
    keeping = asked.model_copy(update={"starting_robot": robot.mjcf, "keep": (Keep(name=section),)})
    repaired = rules.coder.repair(keeping, idea, robot, report)
    assert changes_to_kept_parts(robot.mjcf, repaired.mjcf, keeping.keep) == []
    assert "would change a part to keep" in repaired.notes


def test_a_free_robot_keeps_its_free_joint_whatever_falls() -> None:
    idea = concept("flat_ground", "worm", "wave")
    robot = RuleCoder().write(brief("flat_ground"), idea)
    report = ValidationReport(stable=False, faults=(fault("free_fall", "tail"),))
    assert "<freejoint" in RuleCoder().repair(brief("flat_ground"), idea, robot, report).mjcf


def test_the_judges_issues_are_repaired_by_their_component() -> None:
    idea = concept("button_pushing", "arm", "two sections")
    robot = RuleCoder().write(brief("button_pushing"), idea)
    bare = robot.model_copy(update={"mjcf": re.sub(r"(?s)<sensor>.*</sensor>", "", robot.mjcf)})
    issue = CritiqueIssue(blame="coder", component="no_sensors", problem="the robot has no sensors of its own")
    repaired = RuleCoder().repair(brief("button_pushing"), idea, bare, Critique(passed=False, issues=(issue,)))
    assert "tendonpos" in repaired.mjcf


def test_a_concept_of_no_built_in_family_is_refused_in_a_sentence() -> None:
    idea = concept("button_pushing", "arm", "two sections").model_copy(update={"family": "octopus"})
    with pytest.raises(UserError, match="cannot write the family 'octopus'"):
        RuleCoder().write(brief("button_pushing"), idea)
