"""Whole runs with the built-in team and everything else real, but for the pictures."""

from dataclasses import replace
from pathlib import Path

import pytest

from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.loop.run import create_run, make_brief, parts_of
from aidsr.loop.runner import run_designs
from aidsr.runs import Run, read_status

ENVIRONMENT = """<mujoco model="bell"><option timestep="0.002" integrator="implicitfast"/><worldbody>
<site name="mount" pos="0 0 0.6" euler="180 0 0"/><geom name="floor" type="plane" size="1 1 0.1"/>
<body name="bell" pos="0.1 0 0.3"><geom name="bell" type="sphere" size="0.03" mass="0.2"/></body>
</worldbody></mujoco>"""


def grow(folder: Path, brief, **config) -> Run:
    run = create_run(brief, RunConfig(concepts=1, **config), level="standard" if brief.task else "", runs=folder)
    quick = replace(parts_of(run), picture=lambda _mjcf: b"png", filmstrip=lambda _mjcf: b"png")
    return run_designs(run, quick)


def files(run: Run) -> dict[str, bytes]:
    return {path.relative_to(run.path).as_posix(): path.read_bytes() for path in run.path.rglob("*.xml")}


def test_the_same_seed_gives_the_same_mjcf_and_another_seed_another(tmp_path) -> None:
    brief = make_brief(task="button_pushing")
    first, again = grow(tmp_path, brief, seed=1), grow(tmp_path, brief, seed=1)
    assert read_status(first).approved == 1
    assert "designs/1/final.xml" in files(first)
    assert files(first) == files(again)
    other = parts_of(create_run(brief, RunConfig(seed=2), level="standard", runs=tmp_path)).team_for(tmp_path)
    assert other.designer.propose(brief, 1) != first.concepts.read()


def test_an_objective_in_words_with_an_environment_of_ones_own(tmp_path) -> None:
    path = tmp_path / "bell.xml"
    path.write_text(ENVIRONMENT)
    brief = make_brief("Touch the bell with the tip.", environment=path)
    assert brief == make_brief("Touch the bell with the tip.", environment=ENVIRONMENT)
    run = grow(tmp_path / "runs", brief)
    status = read_status(run)
    assert status.state == "finished"
    assert status.record.task == ""
    assert run.path.name.split("_", 2)[2].startswith("touch_the_bell")


def test_a_robot_of_ones_own_reaches_the_team(tmp_path) -> None:
    path = tmp_path / "mine.xml"
    path.write_text("<mujoco><worldbody/></mujoco>")
    brief = make_brief(task="button_pushing", robot=path)
    assert brief.starting_robot == "<mujoco><worldbody/></mujoco>"
    run = create_run(brief, RunConfig(), level="standard", runs=tmp_path)
    assert run.brief() == brief


def test_run_json_decides_whether_code_repairs(tmp_path) -> None:
    brief, misspelt = make_brief(task="button_pushing"), '<mujoco><option timestap="0.001"/></mujoco>'
    for repairs, count in ((True, 1), (False, 0)):
        asked = create_run(brief, RunConfig(repairs=repairs), level="standard", runs=tmp_path)
        assert parts_of(Run(asked.path)).repair(misspelt).total == count


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        ({}, "no task and no objective"),
        ({"objective": " "}, "no task and no objective"),
        ({"objective": "press"}, "requires an environment"),
        ({"objective": "press", "task": "button_pushing"}, "has its own"),
        ({"task": "button_pushing", "level": "easy"}, "easy"),
        ({"task": "button_pushing", "robot": "nowhere.xml"}, "robot nowhere.xml does not exist"),
        ({"objective": "press", "environment": "<mujoco><geom/></mujoco>"}, "environment cannot be loaded"),
        ({"objective": "press", "environment": Path(__file__).parent}, "cannot be read"),
    ],
)
def test_what_does_not_fit_together_is_said(asked, sentence) -> None:
    with pytest.raises(UserError, match=sentence):
        make_brief(**asked)


def test_a_run_folder_that_cannot_be_made(tmp_path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="no run folder can be made"):
        create_run(make_brief(task="button_pushing"), RunConfig(), level="standard", runs=tmp_path / "file")
