"""Tasks by name, and tasks of other packages."""

import sys
from importlib.metadata import entry_points

import pytest

from aidsr.core.errors import UserError
from aidsr.tasks import ENTRY_POINT_GROUP, TASKS, load_task, task_names


def test_a_task_is_found_by_its_whole_name_or_its_last_part():
    assert load_task("button_pushing") == load_task("reaching/button_pushing")
    assert load_task("button_pushing", "hard").level == "hard"


def test_there_are_fourteen_tasks_in_four_categories():
    assert len(TASKS) == 14
    assert {name.split("/")[0] for name in TASKS} == {"reaching", "grasping", "locomotion", "manipulation"}
    assert task_names()[: len(TASKS)] == tuple(TASKS)


def test_an_unknown_task_is_answered_with_the_nearest_and_all():
    with pytest.raises(UserError) as caught:
        load_task("buton_pushing")
    assert 'unknown task "buton_pushing"; did you mean "reaching/button_pushing"?' in str(caught.value)
    for name in TASKS:
        assert name in str(caught.value)


def test_an_unknown_level_is_answered_with_those_there_are():
    with pytest.raises(UserError, match='has no level "easy"; levels: standard, hard'):
        load_task("button_pushing", "easy")


PACKAGE = '''
from aidsr.tasks.reaching.button_pushing import ButtonPushing


class DoorbellRinging(ButtonPushing):
    """Ring a doorbell."""

    name = "home/doorbell_ringing"
    hard = {}


class Bell:
    """Not a task."""
'''
METADATA = "Metadata-Version: 2.1\nName: aidsr-home\nVersion: 1.0\n"


@pytest.fixture
def other_package(tmp_path, monkeypatch):
    """A package with two entry points, as an installer leaves it."""
    (tmp_path / "aidsr_home.py").write_text(PACKAGE)
    (tmp_path / "aidsr_home.xml").write_text("<mujoco/>")
    info = tmp_path / "aidsr_home-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(METADATA)
    points = "home/doorbell_ringing = aidsr_home:DoorbellRinging\nhome/bell = aidsr_home:Bell\n"
    (info / "entry_points.txt").write_text(f"[{ENTRY_POINT_GROUP}]\n{points}")
    monkeypatch.syspath_prepend(tmp_path)
    yield
    sys.modules.pop("aidsr_home", None)


def test_a_task_of_another_package_is_found(other_package):
    assert [entry.name for entry in entry_points(group=ENTRY_POINT_GROUP)]
    assert "home/doorbell_ringing" in task_names()
    task = load_task("doorbell_ringing")
    assert task.name == "home/doorbell_ringing"
    with pytest.raises(UserError, match=r'has no level "hard"; levels: standard$'):
        load_task("doorbell_ringing", "hard")


def test_an_entry_point_that_is_no_task_is_named(other_package):
    with pytest.raises(UserError, match=r"is no aidsr\.tasks\.Task: aidsr_home:Bell"):
        load_task("home/bell")
