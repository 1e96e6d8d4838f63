"""The commands of studies as a person meets them: what they refuse, what they say while they work."""

from __future__ import annotations

import io
import re
from pathlib import Path

import pytest
from rich.console import Console

from aidsr.apps.cli import main
from aidsr.apps.cli.plan_options import PlanOptions
from aidsr.apps.cli.studies import StudyTable
from aidsr.core.config import RunConfig
from aidsr.loop.run import create_run, make_brief
from aidsr.studies import benchmark
from aidsr.studies.jobs import Job
from aidsr.studies.pool import EndedJob
from aidsr.studies.runner import Progress
from aidsr.studies.study import Arm, Cell, Study, StudyPlan, create_study
from aidsr.teams.baselines.generations import Generation, write_search

TASK = "reaching/button_pushing"
PLAN = StudyPlan(
    tasks=(TASK,), arms=(Arm(name="rules", config=RunConfig(concepts=1)),), runs=3, steps=230_000, protocol="paper"
)


def said(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str]:
    with pytest.raises(SystemExit) as ended:
        main(["benchmark", *words])
    captured = capsys.readouterr()
    return int(ended.value.code or 0), captured.out + captured.err


def test_an_interrupted_study_says_how_to_resume_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(*_asked: object, **_how: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(benchmark, "run_jobs", interrupted)
    study = create_study(tmp_path / "my study", PLAN)
    code, text = said(capsys, str(study.path), "--resume")
    assert code == 130
    assert f"Interrupted. Resume with aidsr benchmark '{study.path}' --resume\n" in text


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["--designs", "1"], "use 3 designs, or set concepts to 1"),
        (["--designs", "50"], "use 48 or 51 designs, or set concepts to 1"),
        (["--tasks"], "--tasks requires a name"),
        (["--tasks", "gap", "gap"], "duplicate task: locomotion/gap"),
        (["--method", "full", "full"], "arm names must be unique, found builtin, builtin"),
        (["--model", "gpt-99", "--seeds", "0"], '"gpt-99" is not a model name'),
        (["--method", "direct", "--seeds", "0"], "cannot be prompted directly"),
        (["--baseline", "search", "--search-robots", "20"], "be a multiple of 8"),
        (["--resume", "--search-robots", "8"], "--resume cannot be combined with --search-robots"),
        (["--resume", "--designs", "3"], "--resume cannot be combined with --designs: the plan is read from"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_is_begun(
    words: list[str], complaint: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, text = said(capsys, str(tmp_path / "s"), *words)
    assert code == 2
    assert complaint in text.replace("\n", " ")
    assert list(tmp_path.iterdir()) == []


def test_a_trial_run_of_another_plan_is_refused_where_a_study_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    create_study(tmp_path / "s", PLAN)
    code, text = said(capsys, str(tmp_path / "s"), "--tasks", "gap", "--dry-run")
    assert code == 2
    assert "holds a study with other tasks" in text


def test_an_estimate_counts_what_training_takes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    create_study(tmp_path / "s", PLAN)
    _, text = said(capsys, str(tmp_path / "s"), "--resume", "--dry-run")
    assert "remaining jobs: 3 design, 3 verify, 3 train, 3 probe" in text
    # 3 x (6 s designing + 767 s training + 220 s judging + 20 s probing) are 50 minutes
    assert "50 min of one core, 25 min with --jobs 2, $0.00" in text


def test_perturbed_scenes_are_asked_for_by_an_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--tasks", "gap", "--designs", "3", "--no-probe", "--dry-run"]
    assert not PlanOptions().plan().perturbed
    assert PlanOptions(perturbed=True).plan().perturbed
    hours = [
        float(re.search(r"([\d.]+) h of one core", said(capsys, str(tmp_path / "s"), *words, *more)[1])[1])
        for more in ((), ("--perturbed",))
    ]
    # 3 x 9 times the 215 s of judging are 1.6 hours
    assert hours[1] - hours[0] == pytest.approx(1.6, abs=0.11)


def test_an_estimate_counts_the_robots_of_a_search(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--tasks", "gap", "--designs", "3", "--baseline", "search", "--seeds", "0", "--no-probe", "--dry-run"]
    _, text = said(capsys, str(tmp_path / "s"), *words, "--search-robots", "64")
    assert "parameters found by CMA-ES over 64 robots" in text
    # 3 x 5 s of the rules, then 64 robots of 5 s and 5 s of the rules
    assert "6 min of one core" in text


def test_a_search_at_work_tells_how_far_it_is(tmp_path: Path) -> None:
    pytest.importorskip("cma", reason="needs the extra search")
    arm = Arm(name="search", config=RunConfig(model="search", concepts=1))
    study = create_study(tmp_path / "s", PLAN.model_copy(update={"arms": (arm,)}))
    job = Job(Cell("search", TASK, 1), "design")
    out = io.StringIO()
    console = Console(file=out, force_terminal=True, width=120, color_system=None)
    with StudyTable(console, study) as table:
        table.listen(Progress(0, (job,), 0, ()))
        run = create_run(make_brief(task=TASK), arm.config, level="standard", runs=study.home(job.cell))
        write_search(run, [Generation(concept=1, generation=3, of=4, values=(0.25, 0.5))])
    assert "design search/reaching.button_pushing/1: generation 3 of 4, worth 0.50 (0.25 at first)" in out.getvalue()


def progress(study: Study, error: str = "") -> Progress:
    first, second = (Job(Cell("rules", TASK, number), "design") for number in (1, 2))
    return Progress(1, (second,), 1, (), EndedJob(first, error, 4.0))


@pytest.mark.parametrize("terminal", [True, False])
def test_the_table_says_what_is_done_and_how_long_it_takes(terminal: bool, tmp_path: Path) -> None:
    study = create_study(tmp_path / "s", PLAN)
    out = io.StringIO()
    console = Console(file=out, force_terminal=terminal, width=100, color_system=None)
    with StudyTable(console, study) as table:
        table.listen(progress(study, error="it [fell] over\nbecause of [red]that"))
    shown = " ".join(out.getvalue().split())
    assert "design rules/reaching.button_pushing/1: because of [red]that" in shown
    if terminal:
        assert "done running to do failed cost time left" in shown
        assert "1 1 11 0 $0.00 about 50 min design rules/reaching.button_pushing/2" in shown
    else:
        assert "done 1, running 1, to do 11, failed 0, cost $0.00, time left about 50 min" in shown
