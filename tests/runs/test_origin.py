"""A run or study that was not made here sends nothing anywhere until its user has confirmed that."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import aidsr
from aidsr.apps.cli import main
from aidsr.core.artifacts import Outcome
from aidsr.core.config import Budget, RunConfig
from aidsr.core.errors import UserError
from aidsr.evolution import Plan, begin, run_generations
from aidsr.loop.run import create_run, require_run_is_ours
from aidsr.runs import Run
from aidsr.runs.origin import MARK, ForeignFolderError, is_ours
from aidsr.studies.jobs import Job, run_job
from aidsr.studies.study import Arm, StudyPlan, create_study, open_study, require_study_is_ours
from aidsr.teams.providers import destination
from scripted import Scripted, brief

STRANGER = "qwen3@https://collects.example/v1"
HERE = "qwen3@http://localhost:8000/v1"


def made(home: Path, model: str = HERE) -> Run:
    return create_run(brief(), RunConfig(model=model), runs=home)


def redirected(run: Run, model: str = STRANGER) -> Run:
    """As a stranger sends it: run.json names another server."""
    record = json.loads(run.record.path.read_text())
    record["config"]["model"] = model
    run.record.path.write_text(json.dumps(record))
    return run


def test_a_run_made_here_is_resumed_without_a_question(tmp_path: Path) -> None:
    run = made(tmp_path)
    require_run_is_ours(run, trust=False)
    moved = shutil.copytree(run.path, tmp_path / "moved")
    require_run_is_ours(Run(moved), trust=False)


def test_another_server_in_run_json_is_refused_with_server_and_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("AIDSR_API_KEY", "sk-not-to-be-sent")
    run = redirected(made(tmp_path))
    with pytest.raises(ForeignFolderError) as error:
        aidsr.resume(run)
    text = str(error.value)
    assert "https://collects.example/v1 with the key in AIDSR_API_KEY" in text
    assert "--trust" in text
    assert "sk-not" not in text


def test_a_run_without_a_mark_or_with_another_ones_mark_is_refused(tmp_path: Path) -> None:
    run, other = made(tmp_path / "a"), made(tmp_path / "b", STRANGER)
    shutil.copy(other.path / MARK, run.path / MARK)
    with pytest.raises(ForeignFolderError):
        require_run_is_ours(run, trust=False)
    (run.path / MARK).unlink()
    with pytest.raises(ForeignFolderError):
        require_run_is_ours(run, trust=False)


@pytest.mark.parametrize("concepts", [0, 1])
def test_a_stranger_cannot_pretend_that_a_run_is_finished(tmp_path: Path, concepts: int) -> None:
    """Only an outcome is there, of a design that the concepts do not name; resuming would ask for the missing rest."""
    run = redirected(made(tmp_path))
    if concepts:
        run.concepts.write(Scripted().propose(brief(), 1))
    run.design(concepts + 1).outcome.write(Outcome(outcome="approved", reason="", iteration=1))
    with pytest.raises(ForeignFolderError):
        aidsr.resume(run)
    assert not run.events.exists()


@pytest.mark.parametrize("resumed", ["in Python", "by the command"])
def test_a_refused_run_gets_no_other_budget(tmp_path: Path, capsys: pytest.CaptureFixture[str], resumed: str) -> None:
    run = redirected(made(tmp_path))
    run.design(1).outcome.write(Outcome(outcome="out_of_budget", reason="60 tokens", iteration=1))
    if resumed == "in Python":
        with pytest.raises(ForeignFolderError):
            aidsr.resume(run, budget=Budget(tokens=10**6))
    else:
        with pytest.raises(SystemExit):
            main(["resume", str(run.path), "--max-tokens", "1000000"])
        assert "was not made here" in capsys.readouterr().err
    assert not run.larger_budget.exists()
    assert run.design(1).outcome.read() is not None


def test_a_run_in_a_study_names_the_model_of_its_arm(tmp_path: Path) -> None:
    """The study's user confirmed what study.toml names, and that alone."""
    plan = StudyPlan(
        tasks=("reaching/button_pushing",), arms=(Arm(name="one", config=RunConfig(model=HERE)),), protocol="best"
    )
    study = create_study(tmp_path / "study", plan)
    cell = next(iter(study.cells))
    run = redirected(made(study.home(cell)))
    with pytest.raises(UserError, match=r'names the model "qwen3@https://collects\.example/v1", and its arm'):
        run_job(study.path, Job(cell, "design"))
    assert not run.events.exists()


def test_a_generation_that_was_not_made_here_is_refused(tmp_path: Path) -> None:
    evolution = begin(tmp_path / "e", Plan(task="gap", config=RunConfig(model=HERE, task_feedback=True)))
    run = redirected(made(evolution.path / "runs"))
    with pytest.raises(ForeignFolderError, match=r"collects\.example"):
        run_generations(evolution)
    assert not run.events.exists()


def test_a_person_is_asked_once(tmp_path: Path) -> None:
    run = redirected(made(tmp_path))
    require_run_is_ours(run, trust=True)
    require_run_is_ours(run, trust=False)
    assert is_ours(run.record.path)


@pytest.mark.parametrize("model", ["builtin", "reference"])
def test_a_run_that_sends_nothing_needs_no_confirmation(tmp_path: Path, model: str) -> None:
    require_run_is_ours(redirected(made(tmp_path), model), trust=False)


def test_where_prompts_go_and_with_which_key(monkeypatch: pytest.MonkeyPatch) -> None:
    environ = {"OPENAI_API_KEY": "k", "OPENAI_BASE_URL": "https://proxy.example/v1"}
    assert destination("openai:gpt-5", environ) == "https://proxy.example/v1 with the key in OPENAI_API_KEY"
    assert destination("openai:gpt-5", {}) == "https://api.openai.com/v1"
    assert destination("manual:/tmp/prompts", {}) == "manual:/tmp/prompts"
    assert destination("builtin", {}) == destination("replay:/tmp/run", {}) == ""


def test_a_study_that_was_not_made_here_is_refused(tmp_path: Path) -> None:
    plan = StudyPlan(
        tasks=("reaching/button_pushing",), arms=(Arm(name="one", config=RunConfig(model=STRANGER)),), protocol="best"
    )
    study = create_study(tmp_path / "study", plan)
    require_study_is_ours(study, trust=False)
    (study.path / MARK).unlink()
    with pytest.raises(ForeignFolderError, match=r"study\.toml was changed.*collects\.example"):
        require_study_is_ours(open_study(study.path), trust=False)


def test_without_a_place_for_the_key_resuming_asks_instead_of_failing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "file"))
    run = made(tmp_path)
    with pytest.raises(ForeignFolderError):
        require_run_is_ours(run, trust=False)
    require_run_is_ours(run, trust=True)


def test_the_key_is_readable_by_its_user_alone(tmp_path: Path) -> None:
    made(tmp_path)
    key = Path(os.environ["XDG_CONFIG_HOME"]) / "aidsr" / "origin_key"
    assert key.stat().st_mode & 0o077 == 0


def test_the_command_refuses_where_nobody_can_be_asked(tmp_path: Path) -> None:
    run = redirected(made(tmp_path))
    ended = subprocess.run(
        [sys.executable, "-m", "aidsr", "resume", str(run.path)], capture_output=True, text=True, timeout=120
    )
    assert ended.returncode == 2
    assert "collects.example" in ended.stderr + ended.stdout
    assert not run.events.exists()


def test_a_link_in_a_run_is_not_written_through(tmp_path: Path) -> None:
    run = made(tmp_path / "runs", "builtin")
    foreign = tmp_path / "precious.txt"
    foreign.write_text("precious, without a line break")
    run.events.symlink_to(foreign)
    with pytest.raises(aidsr.core.errors.UserError, match=r"holds a link: events\.jsonl"):
        aidsr.resume(run)
    assert foreign.read_text() == "precious, without a line break"
