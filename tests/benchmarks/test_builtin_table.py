"""The table of the built-in team says how much of it was measured."""

import importlib.util
from pathlib import Path

import pytest

from aidsr.benchmark.study import Arm, StudyPlan, begin_study
from aidsr.runs import RunConfig

PATH = Path(__file__).parents[2] / "benchmarks" / "builtin" / "table.py"
TASKS = ("reaching/button_pushing", "locomotion/gap")


@pytest.fixture(scope="module")
def program():
    spec = importlib.util.spec_from_file_location("builtin_table", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_designs_that_did_not_end_are_in_no_rate(program, tmp_path):
    arm = Arm(name="builtin", config=RunConfig(model="builtin", concepts=1))
    study = begin_study(tmp_path, StudyPlan(tasks=TASKS, arms=(arm,), runs=5, versions={"mujoco": "3.17.0"}))
    text = program.table(study)
    assert "**0 of 10 planned designs came to an end**" in text
    assert "| locomotion/gap | 0 of 5 |  |  |" in text
    assert "0 of 2 tasks have a design that ended" in text
