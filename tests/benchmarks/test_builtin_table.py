"""The table of the built-in team says how much of it was measured."""

import importlib.util
import sys
from pathlib import Path

import pytest

from aidsr.benchmark.study import Arm, StudyPlan, begin_study
from aidsr.errors import UserError
from aidsr.rl.recipe import Recipe
from aidsr.runs import RunConfig
from aidsr.tasks import BENCHMARK_VERSION

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
    return begin_study(tmp_path / "study", plan)


def outcome(program, **changed):
    facts = {"task": TASKS[0], "level": "standard", "design": 2, "family": "arm", "outcome": "approved", "valid": True}
    facts |= {"successful": True, "success_share": 0.75, "steps": 1000, "training_s": 60.0, "mujoco": "3.17.0"}
    facts |= {"benchmark_version": BENCHMARK_VERSION, "recipe": Recipe(), "most_steps": 300_000, "best_progress": 0.9}
    return program.Outcome(**facts | changed)


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


@pytest.mark.parametrize(
    "changed",
    [
        {"benchmark_version": BENCHMARK_VERSION - 1},
        {"most_steps": 60_000},
        {"recipe": None},
        {"recipe": Recipe(epochs=3)},
        {"level": "hard"},
        {"design": 6},
        {"task": "locomotion/stairs"},
    ],
)
def test_what_a_table_has_no_place_for_is_not_overwritten(program, study, tmp_path, changed):
    path = written(tmp_path / "some.jsonl", outcome(program, **changed))
    with pytest.raises(UserError, match="has no place for it: version"):
        program.kept(path, study.plan)
