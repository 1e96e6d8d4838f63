"""The worked example of docs/add_a_rule.md is a package that works: a new rule is one file and its test."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from aidsr.core.errors import UserError
from aidsr.validation.registry import PLUGINS
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
    points = "".join(f"{name} = {value}\n" for name, value in project["entry-points"][PLUGINS.group].items())
    (info / "entry_points.txt").write_text(f"[{PLUGINS.group}]\n{points}")
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
    ("entry", "message"),
    [
        (
            "slow = aidsr.validation.rules.motion:CHATTER",
            'cannot load rule "slow" of lab-rules (its code is "chatter"; ',
        ),
        (
            "slow = aidsr.validation.rules.motion:CHATTER_WARNING_G",
            'cannot load rule "slow" of lab-rules (float is not Rule)',
        ),
        ("slow = lab_rules:FEW", 'cannot load rule "slow" of lab-rules (AttributeError: '),
        ("slow = no_such_module:FEW", 'cannot load rule "slow" of lab-rules (ModuleNotFoundError: '),
        ("chatter = aidsr.validation.rules.motion:CHATTER", "duplicate rule: chatter is built in; uninstall lab-rules"),
    ],
)
def test_a_rule_that_cannot_be_loaded_is_named_with_its_package(
    installed: Path, monkeypatch: pytest.MonkeyPatch, entry: str, message: str
) -> None:
    (installed / "lab_rules-1.0.dist-info" / "entry_points.txt").write_text(f"[{PLUGINS.group}]\n{entry}\n")
    monkeypatch.syspath_prepend(installed)
    with pytest.raises(UserError) as caught:
        PLUGINS.load_all()
    assert str(caught.value).startswith(message)


def test_a_broken_rule_ends_a_command_with_one_sentence_and_doctor_lists_it(installed: Path) -> None:
    (installed / "lab_rules-1.0.dist-info" / "entry_points.txt").write_text(
        f"[{PLUGINS.group}]\nfew = lab_rules:FEW\n[aidsr.tasks]\nhome/bell = lab_rules:BELL\n"
    )
    (installed / "arm.xml").write_text(EXAMPLE_ARM)
    ended = run(installed, "aidsr", "validate", "arm.xml")
    assert ended.returncode == 2
    assert 'cannot load rule "few" of lab-rules (AttributeError' in " ".join(ended.stderr.split())
    assert "Traceback" not in ended.stderr
    doctor = run(installed, "aidsr", "doctor")
    assert doctor.returncode == 1
    shown = " ".join(doctor.stdout.split())
    assert 'cannot load rule "few" of lab-rules' in shown
    assert 'cannot load task "home/bell" of lab-rules' in shown
