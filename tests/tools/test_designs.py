"""A design of a run is measured with the tools."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

import aidsr
from aidsr.core.errors import UserError
from aidsr.runs import Run
from aidsr.tools import TOOLS, Workspace


def call(work: Workspace, tool: str, /, **arguments: object) -> str:
    return TOOLS[tool].call(work, arguments).text


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return aidsr.design(task="button_pushing", seed=1, concepts=1, runs=tmp_path_factory.mktemp("runs"))


def test_a_design_is_played_measured_varied_and_seen(run: Run, tmp_path: Path) -> None:
    work = Workspace(tmp_path / "work")
    design = run.design(1)
    scene = work.add_design(design)
    assert scene == "scene_1"
    assert work.mjcf(scene) == design.final_scene.path.read_text()
    assert work.mjcf("robot_1") == design.final_robot.path.read_text()
    assert work.subject(scene).task == "reaching/button_pushing"
    assert work.robot("robot_1").functional_part == "tip"
    assert "best progress" in call(work, "play", scene=scene, script="*: t=0 -1, t=1 1", seconds=1)
    assert "sag" in call(work, "measure", what="load", subject=scene)
    swept = {"select": "//joint", "attribute": "stiffness", "values": ["0.5", "1"], "what": "load"}
    assert "failed" not in call(work, "sweep", subject=scene, **swept)
    assert TOOLS["look"].call(work, {"subject": scene}).pictures


def test_its_folder_does_as_well_and_a_second_time_gets_another_name(run: Run, tmp_path: Path) -> None:
    work = Workspace(tmp_path / "work")
    assert [work.add_design(str(run.design(1).path)) for _ in range(2)] == ["scene_1", "scene_2"]


def test_a_design_for_a_goal_brings_its_goal_as_a_task(run: Run, tmp_path: Path) -> None:
    own = Run(shutil.copytree(run.path, tmp_path / "own"))
    record = json.loads(own.record.path.read_text()) | {"task": "", "level": ""}
    own.record.path.write_text(json.dumps(record))
    own.goal.write(b'kind = "touch"\ntarget = "button_cap"\ntime_limit_s = 2\n')
    work = Workspace(tmp_path / "work")
    scene = work.add_design(own.design(1))
    assert (work.own_tasks(), work.record(scene).task) == (["task_1"], "task_1")
    assert work.objective("task_1") == run.asked().objective
    assert "best progress" in call(work, "play", scene=scene, script="*: 0", seconds=0.5)
    swept = {"select": "//joint", "attribute": "damping", "values": ["0.5"], "what": "load"}
    assert "failed" not in call(work, "sweep", subject=scene, **swept)


def test_what_is_no_approved_design_is_named(tmp_path: Path) -> None:
    work = Workspace(tmp_path / "work")
    with pytest.raises(UserError, match=r"is not an approved design: final\.xml not found"):
        work.add_design(Run(tmp_path).design(1))
    with pytest.raises(TypeError, match="design must be a design or its folder, not 5"):
        work.add_design(5)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []
