"""The tasks can be won by cable-driven soft robots: the scripts of `benchmarks/tasks/wins` win them."""

import json

import pytest
from benchmarks.tasks.wins.scripts import SCRIPTS
from benchmarks.tasks.wins.table import FACTS, PAGE, page

from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import rollout
from aidsr.tasks import TASKS_OUT_OF_SAMPLE, is_current, load_task
from aidsr.validation import validate

ROWS = [json.loads(line) for line in FACTS.read_text(encoding="utf-8").splitlines()]
WON = [row for row in ROWS if row["wins"] and is_current(row["task"], row["version"])]
EPISODES = 3


def test_the_page_is_made_of_the_rows():
    assert PAGE.read_text(encoding="utf-8") == page(ROWS)


@pytest.mark.parametrize("name", SCRIPTS)
def test_a_robot_with_a_script_is_in_scope_and_driven_by_cables(name):
    robot = SCRIPTS[name].robot()
    report = validate(robot.mjcf)
    assert report.in_scope, report.account()
    if name in TASKS_OUT_OF_SAMPLE:
        assert report.stable, report.account()
    assert {(row["sound"], row["in_scope"]) for row in ROWS if row["task"] == name} <= {(report.sound, True)}
    assert robot.mjcf.count("<general ") == robot.mjcf.count(" tendon=") - robot.mjcf.count("<tendonpos ") > 0


@pytest.mark.parametrize("name", TASKS_OUT_OF_SAMPLE)
def test_a_script_wins_a_task_out_of_sample(name):
    assert wins(name, "standard", range(EPISODES)) >= 2


@pytest.mark.slow
@pytest.mark.parametrize("row", [pytest.param(row, id=f"{row['task']} {row['level']}") for row in WON])
def test_a_published_row_is_won_again(row):
    # the last bits of the physics differ between processors
    assert wins(row["task"], row["level"], range(row["episodes"])) >= 0.6 * row["wins"]


def wins(name: str, level: str, indices: range) -> int:
    task = load_task(name, level)
    script = SCRIPTS[name](task)
    drawn = [task.variation("held_out", index) for index in indices]
    return int(rollout(Episodes(script.scene.model, task, script.scene.actions, drawn), script).success.sum())
