"""Arms are configurations of switches; some go on with the designs of another."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pytest

from aidsr.apps.cli import main
from aidsr.apps.cli.plan_options import PlanOptions
from aidsr.core.config import RunConfig, StudyMethod
from aidsr.core.errors import UserError
from aidsr.studies.arms import make_arms, read_feedback
from aidsr.studies.outcomes import read_outcomes
from aidsr.studies.pool import LocalPool
from aidsr.studies.runner import run_study
from aidsr.studies.study import Study, StudyPlan, create_study, open_study

TASK = "reaching/button_pushing"
SAID = {TASK: "Make it longer."}
ALL = get_args(StudyMethod)


def test_baselines_are_arms_of_their_own() -> None:
    arms = make_arms(["builtin"], ["full"], concepts=3, feedback={}, baselines=["reference", "search"])
    cells = Study(Path("s"), StudyPlan(tasks=(TASK,), arms=arms, runs=2, protocol="best")).cells
    assert [cell.name.split("/")[0] for cell in cells] == ["builtin", "reference", "search", "builtin", "search"]
    assert [arm.settings for arm in arms] == [
        "",
        "robots designed by hand, iterations 0",
        "parameters found by CMA-ES over 32 robots",
    ]


def test_every_way_is_an_arm_that_can_be_frozen(tmp_path: Path) -> None:
    arms = make_arms(["openai:gpt-5", "builtin"], ALL, concepts=3, feedback=SAID)
    assert len({(a.config.model, a.settings) for a in arms}) == 2 * len(ALL), "no two arms are the same"
    assert arms[0].settings == ""
    plan = StudyPlan(tasks=(TASK,), arms=arms, protocol="paper")
    create_study(tmp_path / "s", plan)
    assert open_study(tmp_path / "s").plan == plan


def test_the_team_that_measures_is_an_arm_beside_the_four_roles() -> None:
    four, direct, measuring = make_arms(["openai:gpt-5"], ["full", "direct", "measuring"], concepts=1, feedback={})
    assert [arm.config.team for arm in (four, direct, measuring)] == ["four_roles", "four_roles", "measuring"]
    assert (measuring.name, measuring.settings) == ("openai-gpt-5.measuring", "team measuring")


@pytest.mark.parametrize(
    ("ways", "said", "complaint"),
    [
        (["human"], SAID, 'list "full" first: --method full human'),
        (["no_groups", "full"], {}, "first: --method full"),
        (["human_only"], {}, "give it with --feedback"),
    ],
)
def test_an_arm_that_lacks_something_is_refused(ways, said, complaint) -> None:
    with pytest.raises(UserError, match=complaint):
        make_arms(["builtin"], ways, concepts=1, feedback=said)


def test_a_person_says_something_to_every_task(tmp_path: Path) -> None:
    file = tmp_path / "said.toml"
    file.write_text('button_pushing = " Make it longer. "\n')
    assert read_feedback(file, [TASK]) == SAID
    with pytest.raises(UserError, match=r"no feedback on locomotion/gap; .* gap = "):
        read_feedback(file, [TASK, "locomotion/gap"])
    file.write_text("button_pushing = ")
    with pytest.raises(UserError, match="cannot be read as a person's feedback"):
        read_feedback(file, [TASK])


def test_feedback_goes_one_round_further_on_the_same_designs(tmp_path: Path) -> None:
    arms = make_arms(["builtin"], ["full", "human", "no_groups"], concepts=1, feedback=SAID)
    study = create_study(
        tmp_path / "s", StudyPlan(tasks=(TASK,), arms=arms, runs=1, seeds=0, protocol="best", probe=False)
    )
    progress = run_study(study, LocalPool(study.path, 1))
    assert progress.failed == ()
    full, human, ungrouped = (study.run(cell).design(1) for cell in study.cells)
    assert [row.outcome for row in read_outcomes(study)] == ["approved"] * 3
    assert human.iteration(1).robot.read() == full.iteration(1).robot.read()
    assert human.iteration(1).decision.read().text == "Make it longer."
    lengths = [it.concept.read().parameters["length_m"] for it in human.iterations if it.concept.read()]
    assert lengths[-1] > lengths[0]
    assert ungrouped.final_scene.read() == full.final_scene.read()


def test_the_command_shows_the_arms(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    file = tmp_path / "said.toml"
    file.write_text('button_pushing = "Longer."\n')
    command = ["benchmark", str(tmp_path / "s"), "--tasks", "button_pushing", "--method", "full", "human", "no_repairs"]
    with pytest.raises(SystemExit) as ended:
        main([*command, "--feedback", str(file), "--dry-run"])
    assert ended.value.code == 0
    said = capsys.readouterr().out
    assert "builtin.human       builtin  a person's feedback, designs taken from builtin" in said
    assert "no automatic fixes" in said


def test_the_command_line_and_runs_search_over_as_many_robots() -> None:
    assert PlanOptions().search_robots == RunConfig().search_robots
