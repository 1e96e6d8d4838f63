"""Tasks of one's own: made of an environment and a goal, and taken by every tool."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.scenes import small_arm

from aidsr.core.errors import UserError
from aidsr.examples import examples
from aidsr.teams.measuring.toolbox import Toolbox, ToolBudget
from aidsr.tools import OWNER_TOOLS, TOOLS, Job, Result, Workspace

VALVE = examples()["valve"]
BESIDE_PIPE = {"mount": "mount", "base": "fixed", "rotation_deg": [40, 0, 0]}


def call(work: Workspace, tool: str, /, **arguments: object) -> Result:
    return {**OWNER_TOOLS, **TOOLS}[tool].call(work, arguments)


def make(work: Workspace, goal: str = VALVE.goal, environment: str = VALVE.environment) -> Result:
    return call(work, "make_task", objective=VALVE.objective, environment=environment, goal=goal)


def test_an_own_task_is_kept_drawn_and_told_of(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    made = make(work)
    assert made.text.startswith("task_1: base any, at most 12 s, mounts: mount\n")
    assert "The joint stem is turned at least 85 deg" in made.text
    assert made.pictures[0].startswith(b"\x89PNG")
    told = json.loads(call(work, "read_task", task="task_1").text)
    assert (told["name"], told["objective"]) == ("task_1", VALVE.objective)
    assert told["environment_mjcf"] == VALVE.environment
    assert json.loads(call(work, "list_tasks").text)[-1] == {"name": "task_1", "objective": VALVE.objective}
    assert call(work, "look", subject="task_1").pictures


@pytest.mark.parametrize("tool", ["make_task", "look"])
def test_the_picture_of_an_own_task_has_its_mount_and_what_is_to_be_worked_on(tmp_path: Path, tool: str) -> None:
    work = Workspace(tmp_path)
    made = make(work)
    drawn = made if tool == "make_task" else call(work, "look", subject="task_1")
    red, green, blue = np.asarray(Image.open(io.BytesIO(drawn.pictures[0]))).astype(int).transpose(2, 0, 1)
    assert 50 < ((green > 1.5 * red) & (green > 1.5 * blue)).sum() < 5000, "the mount"
    assert ((red > 2 * green) & (red > 2 * blue)).sum() > 50, "the lever"


def test_a_robot_is_tested_and_measured_under_the_physics_of_its_task(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    moon = VALVE.environment.replace('timestep="0.002"', 'timestep="0.002" gravity="0 0 -1.62"')
    make(work, environment=moon)
    make(work)
    call(work, "validate", mjcf=small_arm(), functional_part="tip", task="task_1")
    call(work, "edit", robot="robot_1", patch="<set sel='//joint' damping='0.03'/>")
    call(work, "validate", mjcf=small_arm(), functional_part="tip", task="task_2")
    assert [work.subject(f"robot_{number}").environment for number in (1, 2, 3)] == [moon, moon, VALVE.environment]
    on_the_moon, on_earth = (
        float(re.search(r"sag[^;]*? ([\d.]+) mm", call(work, "measure", what="load", subject=name).text)[1])
        for name in ("robot_2", "robot_3")
    )
    assert 0.1 < on_the_moon / on_earth < 0.3


def test_a_scene_of_an_own_task_is_played_and_swept_by_its_goal(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    make(work)
    call(work, "validate", mjcf=small_arm(), functional_part="tip", task="task_1")
    placed = call(work, "assemble", robot="robot_1", placement=BESIDE_PIPE, task="task_1").text
    assert "; robot_1 in task_1, file scene_1/scene.xml" in placed
    played = call(work, "play", scene="scene_1", script="*: -1", seconds=0.2).text
    assert 'not: "at what turns", "half of the angle", "all of the angle"' in played
    how = {"script": "*: -1", "seconds": 0.2}
    swept = {"select": "//body/joint", "attribute": "stiffness", "values": ["0.2"], "what": "play", "how": how}
    assert "failed" not in call(work, "sweep", subject="scene_1", **swept).text


def test_goals_are_found_in_a_relative_folder_and_in_a_run_that_was_moved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    own = Workspace(Path("own"))
    make(own)
    call(own, "validate", mjcf=small_arm(), functional_part="tip", task="task_1")
    call(own, "assemble", robot="robot_1", placement=BESIDE_PIPE, task="task_1")
    assert call(own, "play", scene="scene_1", script="*: -1", seconds=0.2).figures["episodes"] == 1

    brief = own.brief("task_1")
    assert brief is not None
    brief = brief.model_copy(update={"task": ""})  # as in a run for a goal
    Path("run").mkdir()
    Path("run/goal.toml").write_text(VALVE.goal)
    paid = Workspace(Path("run/work"), Job(brief, goal=Path("run/goal.toml")))
    call(paid, "validate", mjcf=small_arm(), functional_part="tip")
    assert "no script can be played" not in call(paid, "assemble", robot="robot_1", placement=BESIDE_PIPE).text
    Path("run").rename("moved")
    moved = Workspace(Path("moved/work"), Job(brief, goal=Path("moved/goal.toml")))
    assert call(moved, "play", scene="scene_1", script="*: -1", seconds=0.2).figures["episodes"] == 1


@pytest.mark.parametrize(
    ("goal", "message"),
    [
        (VALVE.goal.replace("by_deg = 85", "by_deg = 200"), "200"),
        (VALVE.goal.replace('"stem"', '"stam"'), "stam"),
        (VALVE.goal.replace("by_deg", "by_dg"), 'did you mean "by_deg"'),
    ],
)
def test_a_goal_that_cannot_be_met_is_refused_and_nothing_is_kept(tmp_path: Path, goal: str, message: str) -> None:
    with pytest.raises(UserError, match=re.escape(message)):
        make(Workspace(tmp_path), goal)
    assert list(tmp_path.iterdir()) == []


def test_what_an_own_task_has_not_is_said(tmp_path: Path) -> None:
    work = Workspace(tmp_path)
    make(work)
    call(work, "validate", mjcf=small_arm(), functional_part="tip")
    with pytest.raises(UserError, match="levels are those of benchmark tasks"):
        call(work, "assemble", robot="robot_1", placement=BESIDE_PIPE, task="task_1", level="hard")
    with pytest.raises(UserError, match='no robot "task_1"; robots: robot_1'):
        call(work, "measure", what="bends", subject="task_1")
    with pytest.raises(UserError, match="task_1 is a task, without a robot; assemble one into it"):
        call(work, "probe", scene="task_1")
    (tmp_path / "task_1" / "goal.toml").unlink()
    with pytest.raises(UserError, match="goal not found"):
        call(work, "read_task", task="task_1")


def test_a_team_has_one_job_and_no_held_out_variations(tmp_path: Path) -> None:
    brief = Workspace(tmp_path).brief("button_pushing")
    toolbox = Toolbox(Workspace(tmp_path, Job(brief)), tmp_path, ToolBudget(calls=1, minutes=1), pictures=True)
    assert set(TOOLS) < set(toolbox.tools)
    assert not set(OWNER_TOOLS) & set(toolbox.tools)
