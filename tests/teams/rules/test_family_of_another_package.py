"""The worked example of docs/add_a_family.md is a package whose family the built-in team designs with."""

import re
import sys
import tomllib
from dataclasses import fields, replace
from importlib import invalidate_caches
from pathlib import Path

import pytest
from jobs import DESERT, LAMP, brief, free_brief

from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.loop.run import create_run, parts_of
from aidsr.loop.runner import run_designs
from aidsr.runs import read_status
from aidsr.teams.rules import team
from aidsr.teams.rules.families import BUILT_IN, PLUGINS, Family, load_families

PAGE = (Path(__file__).parents[3] / "docs" / "add_a_family.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r'^```\w+ title="([^"]+)"\n(.*?)^```', PAGE, re.MULTILINE | re.DOTALL))


def install(folder: Path, points: dict[str, str]) -> None:
    """Leave the example as an installer does, with some entry points."""
    (folder / "my_robots").mkdir()
    (folder / "my_robots" / "__init__.py").touch()
    (folder / "my_robots" / "finger.py").write_text(FILES["my_robots/finger.py"], encoding="utf-8")
    info = folder / "my_robots-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-robots\nVersion: 1.0\n")
    lines = "".join(f"{name} = {value}\n" for name, value in points.items())
    (info / "entry_points.txt").write_text(f"[{PLUGINS.group}]\n{lines}")


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A function that installs the example; it is gone after the test."""
    monkeypatch.syspath_prepend(tmp_path)

    def make(**points: str) -> None:
        declared = tomllib.loads(FILES["pyproject.toml"])["project"]["entry-points"][PLUGINS.group]
        install(tmp_path, points or declared)
        invalidate_caches()

    yield make
    for module in [name for name in sys.modules if name.partition(".")[0] == "my_robots"]:
        del sys.modules[module]


def test_without_other_packages_there_are_the_built_in_families() -> None:
    assert load_families() == BUILT_IN


def test_a_family_of_another_package_is_designed_with(installed, tmp_path) -> None:
    installed()
    run = create_run(free_brief("Flip the switch.", LAMP), RunConfig(concepts=1, seed=1), runs=tmp_path / "runs")
    run_designs(run, replace(parts_of(run), picture=lambda _mjcf: b"png", filmstrip=lambda _mjcf: b"png"))
    concept = run.design(1).iteration(1).concept.read()
    assert concept.family == "finger"
    assert "Finger first: a switch moves in one plane." in concept.interpretation
    assert read_status(run).designs[0].outcome.outcome == "approved"


def test_it_takes_its_turn_among_the_families_of_its_jobs_only(installed) -> None:
    installed()
    assert {concept.family for concept in team(1).designer.propose(brief("button_pushing"), 3)} == {
        "arm",
        "tentacle",
        "finger",
    }
    crawlers = team(1).designer.propose(free_brief("Crawl away.", DESERT), 6)
    assert "finger" not in {concept.family for concept in crawlers}


def test_it_is_changed_by_feedback_and_reinforced_like_any_other(installed) -> None:
    installed()
    rules = team(1)
    (concept,) = rules.designer.propose(free_brief("Flip the switch.", LAMP), 1)
    longer = rules.designer.revise(free_brief("Flip the switch.", LAMP), concept, None, "longer, please")
    assert longer.parameters["length_m"] == pytest.approx(1.25 * concept.parameters["length_m"], rel=0.01)
    finger = load_families()["finger"]
    assert 'model="finger_variation_1"' in finger.write(finger.reinforce(finger.read(concept))).mjcf


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (
            {"finger": "my_robots.finger:SEGMENTS"},
            r'cannot load family "finger" of my-robots \(.* is not Family\); update or uninstall',
        ),
        ({"thumb": "my_robots.finger:FINGER"}, 'cannot load family "thumb" of my-robots .its name is "finger"'),
        ({"arm": "aidsr.teams.rules.families.arm:ARM"}, "duplicate family: arm is built in; uninstall my-robots"),
        ({"finger": "my_robots.finger:THUMB"}, r'cannot load family "finger" of my-robots \(AttributeError: '),
    ],
)
def test_an_entry_point_that_is_no_new_family_is_refused(installed, points, message) -> None:
    installed(**points)
    with pytest.raises(UserError, match=message):
        load_families()


def test_the_page_explains_every_field() -> None:
    table = PAGE.partition("| field | what it is for |")[2]
    assert all(f"`{field.name}" in table for field in fields(Family) if field.name not in ("name", "doc"))
