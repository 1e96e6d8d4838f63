"""The worked example of docs/add_a_rule.md is a package that works: a new rule is one file and its test."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from aidsr.core.errors import UserError
from aidsr.validation.registry import ENTRY_POINT_GROUP, load_rules
from aidsr.validation.rules_page import EXAMPLE_ARM

PAGE = (Path(__file__).parents[2] / "docs" / "add_a_rule.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r'^```\w+ title="([^"]+)"\n(.*?)^```', PAGE, re.MULTILINE | re.DOTALL))
CODE = "servo_without_forcerange"


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """The example, written down and installed as its pyproject.toml says."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    project = tomllib.loads(FILES["pyproject.toml"])["project"]
    info = tmp_path / "lab_rules-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    points = "".join(f"{name} = {value}\n" for name, value in project["entry-points"][ENTRY_POINT_GROUP].items())
    (info / "entry_points.txt").write_text(f"[{ENTRY_POINT_GROUP}]\n{points}")
    return tmp_path


def run(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-m", *words]
    return subprocess.run(command, cwd=folder, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True)


def test_the_rule_is_applied_like_any_other(installed: Path) -> None:
    passing = '<motor name="pull_back" tendon="back" gear="-1" ctrlrange="0 20"/>'
    servo = '<position name="pull_back" tendon="back" kp="500" kv="5" ctrlrange="0.1 0.14"/>'
    (installed / "arm.xml").write_text(EXAMPLE_ARM.replace(passing, servo))
    ended = run(installed, "aidsr", "validate", "arm.xml", "--json", "--select", f"{CODE},no_sensors")
    report = json.loads(ended.stdout)
    assert [(fault["code"], fault["severity"], fault["names"]) for fault in report["faults"]] == [
        (CODE, "warning", ["pull_back"])
    ]
    assert report["versions"]["lab-rules"] == "1.0"


def test_the_cause_of_its_fault_may_be_another_rules(installed: Path) -> None:
    path = installed / "lab_rules" / f"{CODE}.py"
    path.write_text(
        FILES[f"lab_rules/{CODE}.py"].replace('unit="servos",', 'unit="servos",\n    explained_by=("no_sensors",),')
    )
    servo = EXAMPLE_ARM.replace(
        '<motor name="pull_back" tendon="back" gear="-1"', '<position name="pull_back" tendon="back"'
    )
    (installed / "arm.xml").write_text(re.sub("<sensor>.*</sensor>", "", servo, flags=re.DOTALL))
    ended = run(installed, "aidsr", "validate", "arm.xml", "--json", "--select", f"{CODE},no_sensors")
    assert [fault["code"] for fault in json.loads(ended.stdout)["faults"]] == ["no_sensors"]


def test_its_own_test_passes(installed: Path) -> None:
    ended = run(installed, "pytest", "-q", "-p", "no:cacheprovider", "tests")
    assert ended.returncode == 0, ended.stdout
    assert "2 passed" in ended.stdout


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("slow", "aidsr.validation.rules.motion:CHATTER", "entry point slow of group aidsr.rules is not a rule"),
        (
            "slow",
            "aidsr.validation.rules.motion:CHATTER_WARNING_G",
            "entry point slow of group aidsr.rules is not a rule",
        ),
        ("chatter", "aidsr.validation.rules.motion:CHATTER", "duplicate rule: chatter"),
    ],
)
def test_what_a_package_declares_wrongly_is_one_sentence(name: str, value: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        load_rules([EntryPoint(name, value, ENTRY_POINT_GROUP)])
