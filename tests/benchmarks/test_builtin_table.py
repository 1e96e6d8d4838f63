"""The table of the built-in team says how much of it was measured."""

import importlib.util
import json
import sys
from pathlib import Path

import pytest

from aidsr.core.artifacts import EpisodeResult, Evaluation, PlausibilityCheck
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.learn.rl.recipe import Recipe
from aidsr.studies.outcomes import DesignRow
from aidsr.studies.study import Arm, StudyPlan, create_study
from aidsr.tasks import BENCHMARK_VERSION, task_names

PATH = Path(__file__).parents[2] / "benchmarks" / "builtin" / "table.py"
TASKS = ("reaching/button_pushing", "locomotion/gap")


@pytest.fixture(scope="module")
def program():
    spec = importlib.util.spec_from_file_location("builtin_table", PATH)
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)  # there pydantic looks types up
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def study(tmp_path):
    arm = Arm(name="builtin", config=RunConfig(model="builtin", concepts=1))
    plan = StudyPlan(tasks=TASKS, arms=(arm,), runs=5, versions={"mujoco": "3.17.0"})
    return create_study(tmp_path / "study", plan)


def outcome(program, **changed):
    facts = {"task": TASKS[0], "level": "standard", "design": 2, "family": "arm", "outcome": "approved", "valid": True}
    facts |= {"successful": True, "success_share": 0.75, "steps": 1000, "training_s": 60.0, "mujoco": "3.17.0"}
    facts |= {
        "benchmark_version": BENCHMARK_VERSION,
        "recipe": Recipe().model_dump(mode="json"),
        "most_steps": 300_000,
        "best_progress": 0.9,
    }
    return program.Row(**facts | changed)


def written(path, *outcomes):
    path.write_text("".join(each.model_dump_json() + "\n" for each in outcomes))
    return path


def test_designs_that_did_not_end_are_in_no_rate(program, study):
    text = program.table(study.plan, program.merged(study, ()))
    assert "**0 of 10 planned designs came to an end**" in text
    assert "| locomotion/gap | 0 of 5 |  |  |" in text
    assert "0 of 2 tasks have a design that ended" in text


def test_what_was_measured_elsewhere_is_kept(program, study, tmp_path):
    found = outcome(program)
    assert program.kept(written(tmp_path / "some.jsonl", found), study.plan) == (found,)
    assert program.kept(tmp_path / "none.jsonl", study.plan) == ()
    text = program.table(study.plan, program.merged(study, [found]))
    assert "**1 of 10 planned designs came to an end**" in text
    assert "| reaching/button_pushing | 1 of 5 | 1 of 1 (21% to 100%) | 1 of 1 (21% to 100%) | 75% | 0.90 |" in text


def test_a_design_without_a_policy_is_in_no_mean(program, study):
    lost = outcome(program, outcome="out_of_iterations", valid=False, successful=False, success_share=0.0)
    lost = lost.model_copy(update={"best_progress": None, "steps": 0})
    text = program.table(study.plan, [lost])
    assert "| reaching/button_pushing | 1 of 5 | 0 of 1 (0% to 79%) | 0 of 1 (0% to 79%) | 0% |  |  |  | arm |" in text


def test_a_policy_of_the_study_is_told_with_what_it_was_trained_with(program, study):
    cell = next(iter(study.cells))
    folder = study.home(cell) / "run"
    trained = folder / "designs" / "1" / "training" / "001"
    trained.mkdir(parents=True)
    (folder / "run.json").write_text("{}")
    config = {"benchmark_version": BENCHMARK_VERSION, "steps": 300_000, "recipe": {"epochs": 3}, "scene_sha256": "5e"}
    (trained / "config.json").write_text(json.dumps(config | {"versions": {"mujoco": "3.16.0"}}))
    check = PlausibilityCheck(name="still", passed=False, measured=0.0, limit=1.0, message="it stays still")
    episode = EpisodeResult(variation=0, ended="failed", progress=0.1, best_progress=0.4, reward=0.0, time_s=1.0)
    evaluation = Evaluation(
        task=cell.task, level="standard", benchmark_version=BENCHMARK_VERSION, episodes=[episode], checks=[check]
    )
    row = DesignRow(arm="builtin", task=cell.task, run=1, design=1, outcome="approved", evaluations=(evaluation,))
    found = program.row_of(row, study)
    assert (found.mujoco, found.recipe, found.scene_sha256) == ("3.16.0", {"epochs": 3}, "5e")
    assert (found.episodes, found.failed_checks) == ({"failed": 1}, {"still": "it stays still"})


def test_the_published_table_and_the_readme_are_of_the_published_outcomes(program):
    home, arm = PATH.parent, Arm(name="builtin", config=RunConfig(model="builtin", concepts=1))
    rows = [program.Row.model_validate_json(line) for line in (home / "results.jsonl").read_text().splitlines()]
    ((version, steps),) = {(row.benchmark_version, row.most_steps) for row in rows}
    plan = StudyPlan(tasks=task_names(), arms=(arm,), benchmark_version=version, steps=steps)
    assert (home / "results.md").read_text() == program.table(plan, rows)
    valid, successful = sum(row.valid for row in rows), sum(row.successful for row in rows)
    readme = (PATH.parents[2] / "README.md").read_text()
    assert f"{len(rows)} of 70 designs" in readme
    assert f"{valid} valid, {successful} successful" in readme


@pytest.mark.parametrize(
    "changed",
    [
        {"benchmark_version": BENCHMARK_VERSION - 1},
        {"most_steps": 60_000},
        {"recipe": None},
        {"recipe": Recipe(epochs=3).model_dump(mode="json")},
        {"recipe": Recipe().model_dump(mode="json", exclude={"settling"})},
        {"level": "hard"},
        {"design": 6},
        {"task": "locomotion/stairs"},
    ],
)
def test_what_a_table_has_no_place_for_is_not_overwritten(program, study, tmp_path, changed):
    path = written(tmp_path / "some.jsonl", outcome(program, **changed))
    with pytest.raises(UserError, match="has no place for it: version"):
        program.kept(path, study.plan)
