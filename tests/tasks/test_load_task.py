"""Tasks by name, and tasks of other packages."""

import sys

import pytest

from aidsr.core.errors import UserError
from aidsr.tasks import PLUGINS, TASKS, load_task, task_names


def test_a_task_is_found_by_its_whole_name_or_its_last_part():
    assert load_task("button_pushing") == load_task("reaching/button_pushing")
    assert load_task("button_pushing", "hard").level == "hard"


def test_there_are_eighteen_tasks_in_four_categories():
    assert len(TASKS) == 18
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
from aidsr.tasks.task import Task


class DoorbellRinging(ButtonPushing):
    """Ring a doorbell."""

    name = "home/doorbell_ringing"
    hard = {}


class Ringing(DoorbellRinging):
    name = "home/misspelt"
    required_names = ("mount", "buton")


class Renamed(DoorbellRinging):
    name = "home/renamed"
    stages = ((0.5, "at the bell"), (1.0, "rung"))


class Unfinished(Task):
    name = "home/unfinished"


class Bell:
    """Not a task."""
'''
METADATA = "Metadata-Version: 2.1\nName: aidsr-home\nVersion: 1.0\n"


@pytest.fixture
def other_package(tmp_path, monkeypatch):
    """A package with two entry points, as an installer leaves it."""
    (tmp_path / "aidsr_home.py").write_text(PACKAGE)
    (tmp_path / "aidsr_home.xml").write_text(load_task("button_pushing").environment)
    info = tmp_path / "aidsr_home-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(METADATA)
    points = "home/doorbell_ringing = aidsr_home:DoorbellRinging\nhome/bell = aidsr_home:Bell\n"
    points += "home/gong = aidsr_home:Gong\nhome/chime = no_such_module:Chime\n"
    points += "home/ringing = aidsr_home:DoorbellRinging\n"
    points += "home/misspelt = aidsr_home:Ringing\nhome/unfinished = aidsr_home:Unfinished\n"
    points += "home/renamed = aidsr_home:Renamed\n"
    (info / "entry_points.txt").write_text(f"[{PLUGINS.group}]\n{points}")
    monkeypatch.syspath_prepend(tmp_path)
    yield
    sys.modules.pop("aidsr_home", None)


def test_a_task_of_another_package_is_found(other_package):
    assert "home/doorbell_ringing" in task_names()
    task = load_task("doorbell_ringing")
    assert task.name == "home/doorbell_ringing"
    with pytest.raises(UserError, match=r'has no level "hard"; levels: standard$'):
        load_task("doorbell_ringing", "hard")


@pytest.mark.parametrize(
    ("name", "fault"),
    [
        ("bell", "not a subclass of Task"),
        ("gong", "AttributeError: module 'aidsr_home' has no attribute 'Gong'"),
        ("chime", "ModuleNotFoundError: No module named 'no_such_module'"),
        ("ringing", 'its name is "home/doorbell_ringing"; use one name'),
        ("misspelt", "required_names not in the environment: buton"),
        ("renamed", 'Renamed calls "pressed" decisive, which is none of its stages'),
        ("unfinished", "Unfinished does not define criteria, is_success, objective, "),
    ],
)
def test_a_task_that_cannot_be_loaded_is_named_with_its_package(other_package, name, fault):
    with pytest.raises(UserError) as caught:
        load_task(f"home/{name}")
    assert str(caught.value).startswith(f'cannot load task "home/{name}" of aidsr-home ({fault}')
    assert str(caught.value).endswith("); update or uninstall that package")


def test_a_task_without_its_environment_is_refused(other_package, tmp_path):
    (tmp_path / "aidsr_home.xml").unlink()
    with pytest.raises(UserError, match=r"aidsr_home\.xml not found"):
        load_task("doorbell_ringing")
