"""The hooks that others use, and the examples of docs/validation.md, run as written."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import faulty
import pytest
import robots
import yaml

from aidsr.apps.cli import app

ROOT = Path(__file__).parents[1]
HOOKS: list[dict[str, Any]] = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text())
PAGE = (ROOT / "docs" / "validation.md").read_text()


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A repository in which a good robot, a strong one and a note are about to be committed."""
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots" / "good.xml").write_text(robots.arm())
    (tmp_path / "robots" / "too strong.xml").write_text(faulty.arm(bend_rad=3))
    (tmp_path / "notes.md").write_text("no robot")
    for words in (["init", "--quiet"], ["add", "."]):
        subprocess.run(["git", *words], cwd=tmp_path, check=True)
    return tmp_path


def environment() -> dict[str, str]:
    """The one in which `aidsr` is found, as in the virtual environment that pre-commit makes."""
    return os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}


def staged(repository: Path) -> list[str]:
    told = subprocess.run(
        ["git", "diff", "--cached", "--name-only", "-z"], cwd=repository, capture_output=True, text=True, check=True
    )
    return told.stdout.strip("\0").split("\0")


@pytest.mark.parametrize(("hook", "code"), list(zip(HOOKS, (0, 1), strict=True)), ids=[hook["id"] for hook in HOOKS])
def test_a_hook_runs_on_what_is_staged(hook: dict[str, Any], code: int, repository: Path) -> None:
    """As pre-commit does: the entry, then the staged files that match."""
    files = [file for file in staged(repository) if re.search(hook["files"], file)]
    assert files == ["robots/good.xml", "robots/too strong.xml"]
    command = [*shlex.split(hook["entry"]), *files]
    told = subprocess.run(command, cwd=repository, env=environment(), capture_output=True, text=True, check=False)
    assert told.returncode == code, told.stderr
    assert "robots/good.xml: stable" in told.stdout
    assert "actuator_overforce" in told.stdout


def test_the_plain_hook_of_the_docs_runs(repository: Path) -> None:
    (script,) = re.findall(r"```sh\n(.*?)```", PAGE, re.DOTALL)
    told = subprocess.run(
        ["sh", "-c", script], cwd=repository, env=environment(), capture_output=True, text=True, check=False
    )
    assert told.returncode == 0, told.stderr
    assert "too strong.xml: stable (sound, in scope), with warnings" in told.stdout


def test_the_examples_are_yaml_that_names_our_hooks() -> None:
    before_commit, on_push = (yaml.safe_load(text) for text in re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL))
    used = [hook["id"] for repo in before_commit["repos"] for hook in repo["hooks"]]
    assert set(used) <= {hook["id"] for hook in HOOKS}
    runs = [step["run"] for step in on_push["jobs"]["validate"]["steps"] if "run" in step]
    commands = re.findall(r"aidsr ([^|;]*)", " ; ".join(run for run in runs if "pip" not in run))
    assert len(commands) == 2
    for command in commands:
        app.parse_args(shlex.split(command), exit_on_error=False, print_error=False)
