"""The Designer reads the job, proposes bodies that differ, and changes them as far as it understands."""

import re
from dataclasses import replace

import numpy as np
import pytest
from jobs import DESERT, FAMILIES, IDEAS, KINDS, LAMP, MARBLE, OTHER_KINDS, brief, free_brief

from aidsr.core.artifacts import Keep
from aidsr.core.errors import ReplyError
from aidsr.teams import rules as builtin
from aidsr.teams.rules import user_robot as own_robot
from aidsr.teams.rules.apply_feedback import UNDERSTOOD, WORDS
from aidsr.teams.rules.families.ring import tread_radius
from aidsr.teams.rules.job import read_job


def proposals(task: str, seed: int, count: int = 3):
    return builtin.team(seed).designer.propose(brief(task), count)


MORE_TASKS = {
    "zero_gravity_grasping": "grasp",
    "delicate_grasping": "grasp",
    "dynamic_catching": "grasp",
    "ball_from_bowl": "grasp",
    "stairs": "crawl",
    "obstacles": "crawl",
    "gap": "crawl",
    "incline": "crawl",
    "around_corners": "reach",
    "crank_turning": "reach",
}
"""Kinds of the other tasks: a reworded objective must not change the bodies that the rules propose."""


@pytest.mark.parametrize(("task", "kind"), {**KINDS, **OTHER_KINDS, **MORE_TASKS}.items())
def test_the_job_is_read_from_objective_and_environment(task: str, kind: str) -> None:
    job = read_job(brief(task))
    assert job.kind == kind
    assert job.mount_name == "mount"


@pytest.mark.parametrize(("base", "kind"), [("fixed", "reach"), ("moving", "reach"), ("any", "crawl")])
def test_a_body_whose_base_is_held_is_not_to_crawl(base: str, kind: str) -> None:
    job = free_brief("Point forward.", LAMP).model_copy(update={"base": base})
    assert read_job(job).kind == kind


def test_distances_are_seen_from_the_mount() -> None:
    button, handle = read_job(brief("button_pushing")).target, read_job(brief("drawer_opening")).target
    assert (button.along_m, button.beside_m) == (pytest.approx(0.26, abs=0.002), pytest.approx(0.12, abs=0.01))
    assert handle.part == "drawer_2_bar"
    assert handle.distance_m == pytest.approx(0.25, abs=0.002)
    grasp = read_job(brief("simple_grasping"))
    assert (grasp.approach_m, grasp.room_m) == (pytest.approx(0.10), pytest.approx(0.25))


def test_the_headroom_is_that_under_the_lowest_roof() -> None:
    assert read_job(brief("tunnel")).headroom_m == pytest.approx(0.10)
    assert read_job(brief("gap")).headroom_m == float("inf")


@pytest.mark.parametrize("headroom_m", [0.021, 0.05, 0.07, 0.10, float("inf")])
def test_a_small_ring_fits_under_the_roof_down_to_what_can_be_built(headroom_m: float) -> None:
    job = replace(read_job(brief("tunnel")), headroom_m=headroom_m)
    for variant in ("small, four sectors", "small, five sectors"):
        ring = FAMILIES["ring"].size(job, np.random.default_rng(0), variant)
        height_m = 2.0 * (ring.radius_m + tread_radius(ring))
        assert 0.0549 <= height_m <= max(0.8 * headroom_m, 0.055) + 1e-4


def test_a_ball_that_is_caught_is_met_where_the_objective_says() -> None:
    target = read_job(brief("dynamic_catching")).target
    assert target.body == "ball"
    assert (target.along_m, target.beside_m) == (pytest.approx(0.12, abs=1e-4), pytest.approx(0, abs=1e-4))


@pytest.mark.parametrize("task", KINDS)
def test_concepts_of_a_run_differ_in_family_or_actuation(task: str) -> None:
    for seed in range(1, 6):
        concepts = proposals(task, seed)
        assert len({(c.family, c.name, c.actuation.split(" of at most")[0]) for c in concepts}) == 3
        assert len({c.family for c in concepts}) >= 2
        assert len({c.morphology for c in concepts}) == 3


@pytest.mark.parametrize("task", KINDS)
def test_same_seed_same_bytes_and_other_seeds_other_robots(task: str) -> None:
    def robots(seed: int) -> list[str]:
        team = builtin.team(seed)
        return [team.coder.write(brief(task), c).mjcf for c in team.designer.propose(brief(task), 3)]

    assert robots(7) == robots(7)
    every = [text for seed in range(1, 6) for text in robots(seed)]
    assert len(set(every)) == 15


@pytest.mark.parametrize(
    ("task", "family"),
    {
        "stairs": "crawler",
        "obstacles": "crawler",
        "gap": "ring",
        "tunnel": "ring",
        "drawer_opening": "arm",
        "force_controlled_brushing": "tentacle",
    }.items(),
)
def test_the_family_known_to_be_better_comes_first_and_says_why(task: str, family: str) -> None:
    for seed in range(1, 6):
        concepts = proposals(task, seed)
        assert concepts[0].family == family
        assert f"{family.capitalize()} first: " in concepts[0].interpretation


def test_where_no_family_is_known_to_be_better_chance_decides() -> None:
    assert {proposals("flat_ground", seed)[0].family for seed in range(1, 12)} == set(IDEAS["crawl"])


def test_more_concepts_than_ideas_still_differ() -> None:
    concepts = proposals("drawer_opening", 1, 8)
    assert len({str(c.parameters) for c in concepts}) == 8


def test_concepts_say_that_they_are_rules_and_what_the_rules_saw() -> None:
    concept = proposals("button_pushing", 1)[0]
    assert "built-in rules" in concept.rationale
    assert "press" in concept.interpretation
    assert "260 mm along the axis of mount" in concept.interpretation


def test_what_breaks_is_held_by_weaker_cables() -> None:
    firm, gentle = read_job(brief("simple_grasping")), read_job(brief("delicate_grasping"))
    for family, variant, name in (("gripper", "pincer", "closing_n"), ("tentacle", "wrap", "tension_n")):
        usual, weak = (FAMILIES[family].size(job, np.random.default_rng(0), variant) for job in (firm, gentle))
        assert 0 < getattr(weak, name) < 0.5 * getattr(usual, name)
    assert "breaks easily" in proposals("delicate_grasping", 1)[0].interpretation
    assert "breaks easily" not in proposals("simple_grasping", 1)[0].interpretation


@pytest.mark.parametrize(
    ("objective", "environment", "kind", "said"),
    [
        ("Flip the switch by touching it.", LAMP, "reach", "speaks of touch"),
        ("Pick the marble up.", MARBLE, "grasp", "speaks of pick"),
        ("Do something useful with it.", MARBLE, "grasp", "marble lies free and fits a hand"),
        ("Do something useful.", LAMP, "reach", "an arm that reaches is assumed"),
        ("Do something useful.", DESERT, "crawl", "a body that moves itself is assumed"),
        ("Crawl away.", DESERT, "crawl", "speaks of crawl"),
    ],
)
def test_an_objective_in_words_is_understood_or_its_default_said(
    objective: str, environment: str, kind: str, said: str
) -> None:
    asked = free_brief(objective, environment)
    concepts = builtin.team(1).designer.propose(asked, 3)
    assert read_job(asked).kind == kind
    assert {c.family for c in concepts} <= set(IDEAS[kind])
    assert all(said in c.interpretation for c in concepts)


@pytest.mark.parametrize(
    ("wish", "parameter", "factor"),
    [
        ("Make it longer please", "length_m", 1.25),
        ("the arm is too stiff", "bending_stiffness_n_m2", 0.8),
        ("longer and stiffer", "bending_stiffness_n_m2", 1.5625),
        ("it should be stronger", "tension_n", 1.25),
        ("thinner", "radius_m", 0.8),
    ],
)
def test_wishes_are_granted(wish: str, parameter: str, factor: float) -> None:
    concept = next(c for c in proposals("button_pushing", 1) if c.family == "arm")
    changed = builtin.team(1).designer.revise(brief("button_pushing"), concept, None, wish)
    assert changed.parameters[parameter] == pytest.approx(concept.parameters[parameter] * factor, rel=0.01)
    assert "Changed as you asked" in changed.rationale
    assert changed.family == "arm"


def test_a_wish_stays_within_the_range_of_its_parameter() -> None:
    concept = next(c for c in proposals("simple_grasping", 1) if c.family == "gripper")
    for _ in range(8):
        concept = builtin.team(1).designer.revise(brief("simple_grasping"), concept, None, "more fingers, stronger")
    assert concept.parameters["fingers"] == 6
    assert concept.parameters["closing_n"] == 30


@pytest.mark.parametrize(
    ("wish", "present", "wanted"),
    [
        ("Try a tentacle instead.", "gripper", "tentacle"),
        ("Tentacles, please", "gripper", "tentacle"),
        ("make it ring-shaped", "worm", "ring"),
        ("less ringing please", "crawler", "crawler"),
        ("an armrest would be nice", "tentacle", "tentacle"),
    ],
)
def test_another_family_can_be_asked_for(wish: str, present: str, wanted: str) -> None:
    task = next(task for task, kind in KINDS.items() if {present, wanted} <= set(IDEAS[kind]))
    concept = next(c for c in proposals(task, 1) if c.family == present)
    assert builtin.team(1).designer.revise(brief(task), concept, None, wish).family == wanted


def test_what_is_not_understood_is_said_and_changes_nothing() -> None:
    concept = proposals("flat_ground", 1)[0]
    changed = builtin.team(1).designer.revise(brief("flat_ground"), concept, None, "Paint it green.")
    assert changed.parameters == concept.parameters
    assert "recognized no change" in changed.rationale


def test_the_rationale_names_who_asked_and_what_was_not_understood() -> None:
    """A change that the Judge has undone stays in the rationale, and so does what the rules did not understand."""
    revise, asked = builtin.team(1).designer.revise, brief("button_pushing")
    arm = next(c for c in proposals("button_pushing", 1) if c.family == "arm")
    words = "About robot/tendon_240: Make it 30 percent shorter and use only three tendons. Thinner, please."
    refined = revise(asked, arm, None, words)
    judged = revise(asked, refined, None, "reach: the functional part reaches 0.24 m. make it longer")
    assert 'Changed as you asked: "shorter" (length_m, bending_stiffness_n_m2 x 0.8), "thinner"' in refined.rationale
    missed = '"robot/tendon_240" (the rules change the whole robot), "30 percent", "use only three tendons", "please".'
    assert refined.rationale.endswith(f"Not understood: {missed}")
    first, second = judged.rationale.index("Changed as you asked"), judged.rationale.index("Changed as the Judge asked")
    assert judged.rationale[first:].startswith(refined.rationale[refined.rationale.index("Changed as you asked") :])
    assert (
        judged.rationale[second:] == 'Changed as the Judge asked: "longer" (length_m, bending_stiffness_n_m2 x 1.25).'
    )
    other = revise(asked, judged, None, "Try a tentacle instead.")
    assert 'Changed as you asked: "tentacle" (a tentacle instead of the arm).' in other.rationale


def test_the_words_shown_to_a_person_are_those_that_the_rules_understand() -> None:
    for word in UNDERSTOOD.partition(";")[0].split(", "):
        assert any(re.search(pattern, word) for pattern, _, _ in WORDS), word


def test_a_robot_brought_along_is_kept_and_varied() -> None:
    text = builtin.team(1).coder.write(brief("button_pushing"), proposals("button_pushing", 1)[0]).mjcf
    asked = free_brief("Touch the switch.", LAMP, text)
    team = builtin.team(1)
    concepts = team.designer.propose(asked, 3)
    robots = [team.coder.write(asked, c) for c in concepts]
    assert {c.family for c in concepts} == {own_robot.FAMILY}
    assert robots[0].mjcf == text
    assert robots[0].functional_part == "tip"
    assert len({r.mjcf for r in robots}) == 3
    softer = team.designer.revise(asked, concepts[0], robots[0], "too stiff")
    assert softer.parameters["stiffness_factor"] == pytest.approx(0.8)
    # the words are those of the built-in families; a length is not changed, nor what grows with it
    gentler = team.designer.revise(asked, concepts[0], robots[0], "longer, more flexible, gentler")
    assert gentler.parameters == pytest.approx({"stiffness_factor": 0.8, "force_factor": 0.8})


def test_all_versions_of_a_robot_brought_along_differ_and_say_by_how_much() -> None:
    concepts = builtin.team(1).designer.propose(free_brief("Touch the switch.", LAMP, "no robot"), 9)
    assert [c.name.removeprefix("Own robot, ") for c in concepts[:5]] == [
        "as brought",
        "stiffer and stronger",
        "softer",
        "stronger",
        "stiffer and stronger (2)",
    ]
    for of in ("name", "parameters", "morphology"):
        assert len({str(getattr(c, of)) for c in concepts}) == 9
    assert "2.25 times as stiff and its actuators 2.25 times as strong" in concepts[4].morphology


def test_a_robot_without_names_gets_one_for_its_working_end() -> None:
    text = """<mujoco><worldbody><body><geom size="0.01"/><body pos="0 0 0.1"><joint axis="0 1 0"/><geom size="0.01"/>
    </body></body></worldbody></mujoco>"""
    asked = free_brief("Touch the switch.", LAMP, text)
    team = builtin.team(1)
    robot = team.coder.write(asked, team.designer.propose(asked, 1)[0])
    assert f'name="{robot.functional_part}"' in robot.mjcf


def test_a_robot_that_is_no_mjcf_is_handed_on_for_the_validator_to_say_so() -> None:
    asked = free_brief("Touch the switch.", LAMP, "no robot")
    team = builtin.team(1)
    concept = team.designer.propose(asked, 1)[0]
    assert team.coder.write(asked, concept).mjcf == "no robot"


def test_what_a_person_wants_to_keep_is_kept_or_refused() -> None:
    asked, rules = brief("button_pushing"), builtin.team(1)
    idea = rules.designer.propose(asked, 1)[0]
    robot = rules.coder.write(asked, idea)
    name = robot.functional_part
    same = asked.model_copy(update={"starting_robot": robot.mjcf, "keep": (Keep(name=name),)})
    assert rules.coder.write(same, idea) == robot
    other = same.model_copy(update={"starting_robot": robot.mjcf.replace(f'name="{name}"', 'name="elsewhere"')})
    with pytest.raises(ReplyError, match="cannot keep a part of one"):
        rules.coder.write(other, idea)
