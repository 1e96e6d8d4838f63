"""Folders that AID-SR 0.1.0 wrote are read by today's code: a run, its policy, its export, and a study."""

import json
import shutil
import zipfile
from collections.abc import Set
from pathlib import Path

import pytest

from aidsr.apps.cli import main
from aidsr.core.errors import UserError
from aidsr.fabrication.schema import PartEntry, Verdict
from aidsr.learn.rl.trained import evaluate_training
from aidsr.learn.rl.training_folder import TrainingFolder
from aidsr.loop.run import resume
from aidsr.runs import Library, Run, read_events, read_status, write_summary
from aidsr.runs.files import JsonFile
from aidsr.runs.origin import mark_as_ours
from aidsr.runs.trainings import read_curve, trainings_of
from aidsr.studies.jobs import pending_in
from aidsr.studies.leaderboard import check_scenes, leaderboard
from aidsr.studies.outcomes import read_outcomes
from aidsr.studies.report import write_report
from aidsr.studies.study import open_study
from aidsr.studies.submission import read_submission, submit
from aidsr.teams.providers.replay import ReplayedModel

WRITTEN = Path(__file__).parent / "data" / "written_by_0_1_0"
HISTORY = {"steps": 1536, "wall_s": 2.5, "episodes": 1, "diverged": 0, "resumed": 0, "recent": [[0.0, 0.004, -0.006]]}
"""A checkpoint's history.json."""


@pytest.fixture
def run(tmp_path):
    """The run, with the folder in which its model's replies were written made one of the test's own."""
    with zipfile.ZipFile(WRITTEN / "run.zip") as archive:
        archive.extractall(tmp_path)
    (folder,) = (path.parent for path in tmp_path.glob("*/run.json"))
    record = (folder / "run.json").read_text()
    assert "manual:/lab/desk" in record
    (folder / "run.json").write_text(record.replace("/lab/desk", (tmp_path / "desk").as_posix()))
    return Run(folder)


@pytest.fixture
def study(tmp_path):
    with zipfile.ZipFile(WRITTEN / "study.zip") as archive:
        archive.extractall(tmp_path)
    return open_study(tmp_path / "study")


def files_of(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def assert_holds(now: object, then: object, without: Set[str] = frozenset()) -> None:
    """Compare what is written today with what was written then: the same, and perhaps more."""
    if isinstance(then, dict):
        for key in then.keys() - without:
            assert_holds(now[key], then[key], without)
    elif isinstance(then, list):
        assert len(now) == len(then)
        for one, other in zip(now, then, strict=True):
            assert_holds(one, other, without)
    else:
        assert now == then


def exit_code(*words: object) -> int:
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    return ended.value.code


def test_a_run_has_its_status_its_calls_and_its_two_iterations(run):
    status = read_status(run)
    design = status.design(1)
    assert (status.state, status.approved, design.iteration, design.stable, design.judged) == (
        "finished",
        1,
        2,
        True,
        True,
    )
    assert status.usage.input_tokens > 10_000
    assert [event.kind for event in read_events(run.events)] == ["started", "begun", "done", "finished"]
    assert {event.kind for event in read_events(run.design(1).events)} == {"started", "begun", "done", "finished"}
    first, second = run.design(1).iterations
    assert [fault.code for fault in first.robot_report.read().faults] == ["numerical_instability"]
    assert second.scene.read().mjcf == run.design(1).final_scene.read().decode()
    assert run.brief().summary.mounts
    assert [call.question.role for call in (*run.calls, *first.calls, *second.calls)] == [
        "designer",
        "coder",
        "coder",
        "integrator",
        "judge",
    ]
    assert Library(run.path.parent).runs() == (run,)


def test_a_run_is_shown_and_summarised(run, capsys):
    assert exit_code("show", run.path) == 0
    shown = capsys.readouterr().out
    assert "approve" in shown
    assert "scene.xml" in shown
    assert "Two-cable finger" in write_summary(run).read_text()


def test_resuming_a_finished_run_changes_nothing(run):
    write_summary(run)
    mark_as_ours(run.record.path)  # it was made elsewhere
    before = files_of(run.path)
    resume(run.path)
    changed = {name for name, content in files_of(run.path).items() if before.get(name) != content}
    assert changed <= {"summary.html", "events.jsonl"}  # the log of the run notes the visit
    assert before.keys() == files_of(run.path).keys()


def test_recorded_calls_are_replayed(run):
    (recorded,) = run.calls
    assert ReplayedModel(run.path).ask(recorded.question).reply == recorded.reply


def test_the_verdict_on_a_policy_stays_readable_and_is_not_repeated_by_another_benchmark(run):
    (training,) = trainings_of(run.design(1))
    recorded = training.evaluation.read()
    assert (recorded.valid, recorded.successful, len(recorded.episodes)) == (True, False, 20)
    assert recorded.benchmark_version == 3
    assert [row.steps for row in read_curve(training)] == [512, 1024, 1536, 2048]
    with pytest.raises(UserError, match=r"is of version 3 of the benchmark, not \d+; train it again"):
        evaluate_training(training.path, videos=False)


def test_an_interrupted_training_of_another_benchmark_is_left_and_one_is_made_beside_it(run):
    folder = TrainingFolder(run.design(1).path / "training" / "001")
    (folder / "checkpoint").mkdir()
    for name in ("policy.zip", "normalisation.json"):
        shutil.move(folder / name, folder / "checkpoint" / name)
    (folder / "checkpoint" / "history.json").write_text(json.dumps(HISTORY))
    for name in ("training.json", "evaluation.json"):
        (folder / name).unlink()
    before = files_of(folder.path)
    assert exit_code("train", run.design(1).path, "--steps", 500, "--no-videos", "--no-evaluate") == 0
    assert files_of(folder.path) == before
    assert json.loads((folder.path.with_name("002") / "training.json").read_text())["resumed"] == 0


def test_an_export_is_read(run):
    export = run.design(1).path / "export"
    verdict = JsonFile(export / "verdict.json", Verdict).read()
    parts = JsonFile(export / "parts.json", tuple[PartEntry, ...]).read()
    assert (verdict.verdict, len(verdict.reasons), verdict.retest.stable) == ("buildable with changes", 3, True)
    assert {part.file for part in parts} >= {"base", "link_1_slice_1"}


def test_a_study_has_nothing_left_to_do_and_its_report_is_made(study):
    (row,) = read_outcomes(study)
    assert (row.outcome, row.verified, row.complete, len(row.evaluations)) == ("approved", True, True, 1)
    recorded = json.loads((study.path / "report.json").read_text())
    assert not any(list(pending_in(study, cell)) for cell in study.cells)
    write_report(study)
    ends = {"success_low", "success_high"}  # an arm of one run a task has no interval any more
    assert_holds(json.loads((study.path / "report.json").read_text()), recorded, ends)
    assert (study.path / "report.html").is_file()


def test_a_submission_is_verified_and_written_again_the_same(study, tmp_path):
    sent = study.path / "submission.json"
    read_submission(sent)
    assert check_scenes(sent, study) == 1
    assert "builtin" in leaderboard([sent])
    again = submit(study, tmp_path / "again.json").model_dump(mode="json", exclude={"sha256"})
    assert_holds(again, json.loads(sent.read_text()), without={"sha256"})
