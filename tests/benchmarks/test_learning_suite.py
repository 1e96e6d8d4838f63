"""The suite on which protocols are compared: its halves, and the page made of rows."""

import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

from benchmarks.learning.compare import Point, Row, learn, recipe_now
from benchmarks.learning.hopeless import suite_trainings
from benchmarks.learning.probes import Probe
from benchmarks.learning.report import curves, page_of, reached
from benchmarks.learning.suite import suite

SCENES = suite()


def row(scene, protocol, *successes, half="decide") -> Row:
    points = tuple(
        Point(steps=100 * (i + 1), processor_s=10.0 * (i + 1), wall_s=20.0, success=success, progress=success)
        for i, success in enumerate(successes)
    )
    return Row(
        scene=scene,
        task="grasping/simple_grasping",
        half=half,
        author="built-in rules",
        protocol=protocol,
        seed=0,
        steps=300,
        curve=points,
        recipe=recipe_now(protocol),
        benchmark_version=4,
        commit="",
        processor="",
    )


def test_both_halves_hold_all_categories_and_half_of_the_robots_are_a_language_models():
    assert len(SCENES) >= 16
    for half in ("decide", "aside"):
        mine = [scene for scene in SCENES if scene.half == half]
        assert len(mine) == len(SCENES) / 2
        assert {scene.task.partition("/")[0] for scene in mine} == {
            "reaching",
            "grasping",
            "locomotion",
            "manipulation",
        }
    assert sum(scene.author == "language model" for scene in SCENES) == len(SCENES) / 2


@pytest.mark.parametrize("one", SCENES, ids=lambda scene: scene.name)
def test_a_robot_of_the_suite_becomes_a_scene_of_its_task(one):
    scene = one.scene()
    assert scene.task.name == one.task
    assert scene.actions.size > 0


def test_the_page_counts_what_ends_at_half_of_the_episodes_and_when_that_was_reached_first():
    rows = [
        row("one", "paper", 0.0, 0.4, 0.45),
        row("one", "best", 0.2, 0.6, 0.4),
        row("two", "paper", 0.0, 0.0, 0.5),
        row("two", "best", 0.5, 0.9, 1.0),
        row("two", "sb3", 0.0, 0.1),
        row("alone", "best", 1.0),
    ]
    won = {"one_motion": 1, "progress": 1.0, "steps": 1, "benchmark_version": 4, "commit": ""}
    probes = {name: Probe(scene=name, some_motion=3, **won) for name in ("one", "two", "alone")}
    found = [reached(each) for each in rows[:4]]
    assert [point and point.processor_s for point in found] == [None, 20.0, 30.0, 10.0]
    page = page_of(rows, probes)
    named = "| one | built-in rules | grasping/simple_grasping | 1, 3 | 0 |"
    assert f"{named} - | - | 45% (0.45) after 30 s | never | 40% (0.40)" in page
    assert "median to 50 %: 20 s, 200 steps." in page
    assert "sb3: 0 of 1 scenes" in page
    assert "3 of 4 variations or more, 1 of 2 trainings of `best` end at 50 % or more; not one." in page
    assert "paper: 1 of 2 scenes end at 50 % or more (grasping 1 of 2)" in page
    assert "best: 1 of 2 scenes end at 50 % or more (grasping 1 of 2)" in page
    assert "alone" not in page  # there is nothing beside it
    assert curves(rows).count("<polyline") == 6


def test_of_several_rows_of_a_training_the_last_is_drawn_and_counted():
    rows = [row("one", "best", 0.0, 0.0), row("one", "best", 0.5, 1.0), row("two", "paper", 0.0)]
    changed = row("drawers", "best", 0.0).model_copy(update={"task": "manipulation/drawer_opening"})
    assert curves(rows).count("<polyline") == 2
    at_60000 = [each.model_copy(update={"steps": 60_000}) for each in (*rows, changed)]
    assert suite_trainings(at_60000) == [(100, 60_000, 1.0)]


@pytest.mark.slow
def test_the_defaults_of_the_library_learn_beside_the_protocols():
    made = learn(next(scene for scene in SCENES if scene.name == "zero-gripper"), "sb3", 0, 64)
    assert (made.protocol, made.recipe, made.curve[-1].steps) == ("sb3", None, 8 * 2048)
