"""The worked example of docs/add_a_task.md is a package that works, and docs/tasks.md agrees with the code."""

import re
import sys
import tomllib
from importlib import invalidate_caches
from pathlib import Path

import mujoco
import pytest
from stick import Episode

from aidsr.tasks import BENCHMARK_VERSION, TASKS, Task, load_task

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "tasks.md").read_text(encoding="utf-8")
EXAMPLE = (DOCS / "add_a_task.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r'^```\w+ title="([^"]+)"\n(.*?)^```', EXAMPLE, re.MULTILINE | re.DOTALL))


@pytest.fixture
def kitchen(tmp_path, monkeypatch):
    """The example, written down and installed as its pyproject.toml says."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "kitchen_tasks" / "__init__.py").touch()
    project = tomllib.loads(FILES["pyproject.toml"])["project"]
    info = tmp_path / "kitchen_tasks-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    points = "".join(f"{name} = {value}\n" for name, value in project["entry-points"]["aidsr.tasks"].items())
    (info / "entry_points.txt").write_text(f"[aidsr.tasks]\n{points}")
    monkeypatch.syspath_prepend(tmp_path)
    invalidate_caches()
    yield
    for module in [name for name in sys.modules if name.partition(".")[0] == "kitchen_tasks"]:
        del sys.modules[module]


@pytest.mark.parametrize(("level", "raised_m"), [("standard", 0.05), ("hard", 0.10)])
def test_the_example_is_a_task_like_any_other(kitchen, level, raised_m):
    task = load_task("lid_lifting", level)
    assert f"at least {raised_m:g} m high" in task.brief().objective
    episode = Episode(task)
    assert task.observe(episode.look(), episode.state.task_state).shape == (1, 4)
    episode.run(2.0)
    assert not episode.won

    def lift(e: Episode) -> None:
        weight_n = 9.81 * e.model.body("lid").mass[0]
        e.data.joint("lid_slide").qfrc_applied = weight_n + 40.0 * (1.1 * raised_m - e.sensor("lid_height")[0])
        e.data.joint("lid_slide").qfrc_applied -= 4.0 * e.data.joint("lid_slide").qvel

    episode.run(4.0, lift)
    assert episode.won


def test_the_example_takes_its_environment_along_when_it_is_installed():
    packed = tomllib.loads(FILES["pyproject.toml"])["tool"]["setuptools"]["package-data"]["kitchen_tasks"]
    data = [path for path in map(Path, FILES) if path.parent.name == "kitchen_tasks" and path.suffix != ".py"]
    assert data
    assert all(any(path.match(pattern) for pattern in packed) for path in data)


@pytest.mark.parametrize("level", ["standard", "hard"])
def test_the_team_reads_the_criteria_of_the_example(kitchen, level):
    task = load_task("lid_lifting", level)
    assert "a lid of 80 to 150 g" in task.objective
    assert task.brief().judging == {
        "Episodes differ": "Mass of the lid, 80 to 150 g.",
        "Success": f"The lid is raised at least {task.raised_m:g} m. Held for 1 s.",
        "Penalty": "More than 20 N on the lid.",
        "Stages": "By progress: at the knob (0.5), off the pot (0.6), raised (1); decisive: off the pot.",
        "Time": "10 s, 25 actions a second.",
    }
    masses_kg = [task.variation("development", index).changes[0].value[0] for index in range(50)]
    assert min(masses_kg) >= 0.08
    assert max(masses_kg) <= 0.15


def test_the_example_lists_every_member_that_a_task_may_have():
    table = EXAMPLE.partition("| member | when |")[2]
    optional = ("reset_state", "update_state", "script", "is_failure", "edits")
    for member in (*Task.__abstractmethods__, *optional):
        assert f"`{member}" in table, member


def test_the_page_names_every_task_and_shows_it():
    for name in TASKS:
        short = name.rpartition("/")[2]
        assert f"| {name} |" in PAGE
        assert f"images/tasks/{short}.png" in PAGE
    assert f"version {BENCHMARK_VERSION}" in PAGE


def test_environments_keep_the_mount_on_a_body_that_moves_only_where_they_say():
    for name in TASKS:
        task = load_task(name)
        model = mujoco.MjModel.from_xml_string(task.environment)
        body = int(model.site("mount").bodyid[0])
        assert bool(model.body_weldid[body]) == (task.base == "moving")
