"""A study from its plan to its tables: frozen plans, jobs read off the files, retries, reports, submissions."""

from __future__ import annotations

import csv
import html
import io
import json
import os
import re
import shutil
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any, Literal

import av
import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError
from rich.console import Console

from aidsr.apps.cli import main
from aidsr.apps.cli.studies import print_comparison
from aidsr.core.artifacts import EpisodeResult, Evaluation, Fault, MeanAction, PlausibilityCheck, ValidationReport
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.learn.openloop import probe
from aidsr.learn.rl.recipe import Recipe, recipe_of
from aidsr.studies import jobs, runner
from aidsr.studies.arms import make_plan
from aidsr.studies.estimate import estimate_study
from aidsr.studies.gallery import gallery
from aidsr.studies.jobs import Job, pending_in, run_job
from aidsr.studies.outcomes import DesignRow, read_outcomes, read_repairs
from aidsr.studies.planned import training_folder_of
from aidsr.studies.plots import cost_and_success
from aidsr.studies.pool import EndedJob, LocalPool
from aidsr.studies.report import write_report
from aidsr.studies.runner import MOST_ATTEMPTS, read_failures, run_study
from aidsr.studies.statistics import bootstrap_mean
from aidsr.studies.study import Arm, Study, StudyPlan, create_study, open_study
from aidsr.studies.submission import Submission, read_submission, submit, with_hash
from aidsr.studies.tables import arm_lines, differences, line_of
from aidsr.tasks import BENCHMARK_VERSION

TASK = "reaching/button_pushing"


def pending(study: Study) -> list[Job]:
    return [job for cell in study.cells for job in pending_in(study, cell)]


def plan(**changed: object) -> StudyPlan:
    arms = (
        Arm(name="rules", config=RunConfig(concepts=1)),
        Arm(name="bare", config=RunConfig(concepts=1, repairs=False)),
    )
    return StudyPlan(
        **{"tasks": (TASK,), "arms": arms, "runs": 1, "seeds": 0, "protocol": "best", "probe": False, **changed}
    )


class Here:
    """A pool that does jobs at once, in this process, after what `before` does to them."""

    def __init__(self, study: Study, before: Callable[[Job, int], str] = lambda _job, _attempt: "") -> None:
        self.study, self.before, self.begun = study, before, list[Job]()
        self.free = 1

    def begin(self, job: Job) -> None:
        self.begun.append(job)
        self.free = 0

    def wait(self) -> EndedJob:
        self.free = 1
        job = self.begun[-1]
        error = self.before(job, self.begun.count(job))
        if not error:
            run_job(self.study.path, job)
        return EndedJob(job, error, 1.0)

    def close(self) -> None:
        self.free = 1


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> tuple[Study, list[Job]]:
    study = create_study(tmp_path_factory.mktemp("studies") / "first", plan())
    pool = Here(study)
    run_study(study, pool)
    return study, pool.begun


@pytest.fixture(scope="module")
def finished(driven: tuple[Study, list[Job]]) -> Study:
    return driven[0]


def test_a_run_comes_to_its_end_before_the_next_begins(driven: tuple[Study, list[Job]]) -> None:
    begun = [(job.cell.arm, job.stage) for job in driven[1]]
    assert begun == [(arm, stage) for arm in ("rules", "bare") for stage in ("design", "verify")]


def test_runs_whose_results_are_elsewhere_are_left_alone(tmp_path: Path) -> None:
    study = create_study(tmp_path / "s", plan())
    rules, bare = study.cells
    pool = Here(study)
    run_study(study, pool, without=frozenset({rules, Job(bare, "verify", 1)}))
    assert pool.begun == [Job(bare, "design")]
    assert study.run(rules) is None


def test_a_plan_is_frozen_when_its_study_begins(tmp_path: Path) -> None:
    create_study(tmp_path / "s", plan())
    assert open_study(tmp_path / "s").plan == plan()
    assert create_study(tmp_path / "s", plan(versions={"python": "4.0"})).plan == plan()
    with pytest.raises(UserError, match="other steps; a plan cannot be changed"):
        create_study(tmp_path / "s", plan(steps=7))
    (tmp_path / "link").symlink_to(tmp_path / "s")
    with pytest.raises(UserError, match=r"is not a study folder: study\.toml not found; give the folder of a study"):
        open_study(tmp_path)
    (tmp_path / "run.json").touch()
    with pytest.raises(UserError, match=r"study\.toml not found; it is a run: aidsr show "):
        open_study(tmp_path)
    (tmp_path / "s" / "study.toml").write_text("tasks = []\n")
    with pytest.raises(UserError, match="is not a study plan"):
        open_study(tmp_path / "s")
    with pytest.raises(UserError, match="is not a study folder"):
        open_study(tmp_path / "s" / "study.toml")


@pytest.mark.parametrize(
    ("line", "edited", "said"),
    [
        ("steps = 300000", "steps = 0", r'"steps": expected greater than or equal to 1, found 0; do not edit a plan'),
        ("runs = 1", 'runs = "many"', "\"runs\": expected a valid integer.*found 'many'; do not edit a plan"),
        (
            'level = "standard"',
            'level = "easy"',
            "\"level\": expected 'standard' or 'hard', found 'easy'; do not edit a plan",
        ),
        ("seeds = 0", "seedlings = 0", 'there is no key "seedlings"; found 0 for it'),
        ("concepts = 1", "concepts = 99", r'"arms\[1\].config.concepts": expected less than or equal to 20, found 99'),
        ('name = "bare"', 'name = "rules"', "arm names must be unique, found rules, rules"),
        ("runs = 1", "runs 1", "cannot be read as TOML: .*line"),
    ],
)
def test_a_plan_that_was_edited_badly_is_refused_in_one_sentence(
    line: str, edited: str, said: str, tmp_path: Path
) -> None:
    file = create_study(tmp_path / "s", plan()).path / "study.toml"
    assert line in file.read_text()
    file.write_text(file.read_text().replace(line, edited, 1))
    with pytest.raises(UserError, match=said) as refused:
        open_study(tmp_path / "s")
    assert "\n" not in str(refused.value)
    assert "pydantic" not in str(refused.value)


def test_a_plan_from_before_protocols_were_kept_trained_by_paper_and_a_new_one_trains_by_best(tmp_path: Path) -> None:
    new = make_plan(["button_pushing"], ["builtin"], ["full"], designs=1, concepts=1, seeds=1, steps=9, probe=False)
    assert new.protocol == "best"
    file = create_study(tmp_path / "s", new).path / "study.toml"
    file.write_text(file.read_text().replace('protocol = "best"\n', ""))
    assert open_study(tmp_path / "s").plan == new.model_copy(update={"protocol": "paper"})


def test_a_plan_made_in_code_names_its_protocol() -> None:
    with pytest.raises(ValidationError, match=r"protocol\n  Field required"):
        StudyPlan(tasks=(TASK,), arms=plan().arms)


def test_policies_that_begin_with_a_motion_are_for_protocol_paper_alone() -> None:
    arms = (Arm(name="rules", config=RunConfig(concepts=1), from_probe=True),)
    with pytest.raises(ValueError, match=r'rules: from_probe needs protocol "paper" \(--protocol paper\)'):
        plan(arms=arms, protocol="best")
    assert plan(arms=arms, protocol="paper").arms == arms


@pytest.mark.parametrize(("protocol", "algorithm"), [("paper", "ppo"), ("best", "sac")])
def test_a_job_trains_by_the_plans_protocol_and_perturbs_what_succeeds(
    protocol: str, algorithm: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict[str, Any] = {}

    def trains(*_place: object, recipe: Recipe, **_options: object) -> None:
        asked["algorithm"] = recipe.algorithm

    def evaluates(*_place: object, perturbed: bool | str, **_options: object) -> None:
        asked["perturbed"] = perturbed

    study = create_study(tmp_path / "s", plan(seeds=1, protocol=protocol, perturbed=True))
    for stage in ("design", "verify"):
        run_job(study.path, next(job for job in pending(study) if (job.stage, job.cell.arm) == (stage, "rules")))
    monkeypatch.setattr(jobs, "train_policy", trains)
    monkeypatch.setattr(jobs, "evaluate", evaluates)
    training = next(job for job in pending(study) if job.stage == "train")
    run_job(study.path, training)
    assert asked == {"algorithm": algorithm, "perturbed": "successful"}


def test_jobs_come_task_by_task_before_the_second_run_of_any(tmp_path: Path) -> None:
    study = Study(tmp_path, plan(tasks=(TASK, "locomotion/gap"), runs=2))
    names = [job.name for job in pending(study)]
    assert names[:4] == [
        "design rules/reaching.button_pushing/1",
        "design bare/reaching.button_pushing/1",
        "design rules/locomotion.gap/1",
        "design bare/locomotion.gap/1",
    ]
    assert Job.of(json.loads(json.dumps(pending(study)[0].as_dict()))) == pending(study)[0]


def test_a_finished_study_has_nothing_to_do_and_a_row_for_every_design(finished: Study) -> None:
    assert pending(finished) == []
    rows = read_outcomes(finished)
    assert [(row.arm, row.outcome, row.stable) for row in rows] == [
        ("rules", "approved", True),
        ("bare", "approved", True),
    ]
    assert not rows[0].valid, "a design that was not trained is not valid"
    assert estimate_study(finished).jobs == {"design": 0, "verify": 0, "train": 0, "probe": 0}


@pytest.mark.parametrize("protocol", ["paper", "best"])
@pytest.mark.parametrize("perturbed", [False, True])
@pytest.mark.parametrize(("seeds", "steps"), [(0, 300_000), (1, 300_000), (2, 150_000)])
def test_an_estimate_is_made_of_what_the_docs_say_was_measured(
    seeds: int, steps: int, protocol: str, perturbed: bool, tmp_path: Path
) -> None:
    page = (Path(__file__).parents[2] / "docs" / "studies.md").read_text()
    told = re.search(r"designing (\d+), training ([\d,]+), judging (\d+);", page)
    assert told, "docs/studies.md no longer says what was measured"
    design_s, training_s, judging_s = (float(number.replace(",", "")) for number in told.groups())
    asked = plan(arms=plan().arms[:1], seeds=seeds, steps=steps, protocol=protocol, perturbed=perturbed)
    coming = estimate_study(Study(tmp_path, asked))
    assert "20 held-out episodes a policy; a verdict now has 100, which takes about five times as long" in page
    learning = (Path(__file__).parents[2] / "docs" / "learning.md").read_text()
    assert "A step of `best` costs about twice" in learning
    assert "in each of nine kinds of perturbed scenes" in page
    training_s *= 2 if protocol == "best" else 1
    judging_s *= 5 * (1 + 9 * perturbed)
    expected_s = design_s + seeds * (training_s * steps / 300_000 + judging_s)
    assert coming.core_hours * 3600 == pytest.approx(expected_s)


def test_designs_that_were_not_attempted_yet_are_in_the_denominator(tmp_path: Path) -> None:
    rows = read_outcomes(Study(tmp_path, plan(runs=3)))
    assert [row.outcome for row in rows] == ["unfinished"] * 6


def test_arms_of_one_number_are_pairs(finished: Study) -> None:
    found = {each.what: each for each in differences(read_outcomes(finished), "rules")}
    assert found["stable"].value == 0.0
    assert not found["stable"].real


def evaluation(won: int, *, of: int = 4, plausible: bool = True) -> Evaluation:
    ends = ["succeeded"] * won + ["out_of_time"] * (of - won)
    episodes = [
        EpisodeResult(variation=n, ended=ended, progress=1.0, best_progress=1.0, reward=0.0, time_s=1.0)
        for n, ended in enumerate(ends)
    ]
    check = PlausibilityCheck(name="moves", passed=plausible, measured=1.0, limit=1.0, message="")
    version = StudyPlan.model_fields["benchmark_version"].default
    return Evaluation(task=TASK, level="standard", benchmark_version=version, episodes=episodes, checks=[check])


@pytest.mark.parametrize(
    ("seeds", "judged", "valid", "successful", "share"),
    [
        (1, [], False, False, 0.0),
        (1, [evaluation(3)], True, True, 0.75),
        (1, [evaluation(4, plausible=False)], False, False, 0.0),
        (3, [evaluation(4)], False, False, 1 / 3),
        (3, [evaluation(4), evaluation(2)], True, True, 0.5),
        (3, [evaluation(4), evaluation(1)], True, False, 1.25 / 3),
        (2, [evaluation(4)], False, False, 0.5),
        (0, [], False, False, 0.0),
    ],
)
def test_policies_that_are_missing_count_as_failed(seeds, judged, valid, successful, share) -> None:
    row = DesignRow(arm="a", task=TASK, run=1, design=1, outcome="approved", seeds=seeds, evaluations=judged)
    assert (row.valid, row.successful, row.episodes_share) == (valid, successful, pytest.approx(share))
    assert line_of(TASK, [row]).episodes_share == pytest.approx(share)
    assert bootstrap_mean({TASK: [[row.policies]]}).value == pytest.approx(share)


def test_a_row_knows_how_many_policies_its_plan_asks_for(finished: Study, tmp_path: Path) -> None:
    study = Study(Path(shutil.copytree(finished.path, tmp_path / "s")), plan(seeds=3))
    folder = training_folder_of(study.run(next(study.cells)).design(1), 0)
    folder.mkdir(parents=True)
    (folder / "evaluation.json").write_text(evaluation(100, of=100).model_dump_json())
    row, _ = read_outcomes(study)
    assert (len(row.evaluations), row.complete, row.successful) == (1, False, False)
    assert row.episodes_share == pytest.approx(1 / 3)
    submit(study, tmp_path / "s.json")
    earlier = json.loads((tmp_path / "s.json").read_text())
    for design in earlier["designs"]:
        del design["seeds"]
    (tmp_path / "earlier.json").write_text(with_hash(Submission.model_validate(earlier)).model_dump_json())
    assert read_submission(tmp_path / "s.json").designs == read_outcomes(study)
    with pytest.raises(UserError, match="an older version wrote it"):
        read_submission(tmp_path / "earlier.json")


@pytest.mark.parametrize(
    ("changed", "differing"),
    [
        ({}, ""),
        ({"task": "locomotion/gap"}, "task"),
        ({"level": "hard"}, "level"),
        ({"steps": 4000}, "steps"),
        ({"seed": 3}, "seed"),
        ({"minutes": 5.0}, "minutes"),
        ({"recipe": recipe_of("paper")}, "algorithm"),
        ({"recipe": recipe_of("best", smoothing=0.5)}, "smoothing"),
        ({"recipe": recipe_of("best", script="a: 1")}, "script"),
        ({"recipe": recipe_of("best").model_copy(update={"script": "a: 1"})}, ""),  # learning did not beat a motion
    ],
)
def test_a_policy_that_is_not_by_the_plan_does_not_count(
    changed: dict[str, object], differing: str, finished: Study, tmp_path: Path
) -> None:
    study = Study(Path(shutil.copytree(finished.path, tmp_path / "s")), plan(seeds=1, steps=20_000))
    folder = training_folder_of(study.run(next(study.cells)).design(1), 0)
    folder.mkdir(parents=True)
    config = {"task": TASK, "level": "standard", "steps": 20_000, "seed": 0, "recipe": recipe_of("best"), **changed}
    (folder / "config.json").write_bytes(TypeAdapter(dict[str, Any]).dump_json(config))
    (folder / "evaluation.json").write_text(evaluation(100, of=100).model_dump_json())
    (folder / "training.json").write_text('{"steps": 20000, "wall_s": 60.0}')
    row, _ = read_outcomes(study)
    assert (row.complete, len(row.evaluations), row.steps) == ((False, 0, 0) if differing else (True, 1, 20_000))
    asked = [job for job in pending(study) if job.cell == next(study.cells)]
    assert [job.stage for job in asked] == ["train"] * bool(differing)
    if differing:
        (study.path / "study.toml").unlink()
        create_study(study.path, study.plan)
        with pytest.raises(UserError, match=rf"001 is not by the plan of the study: it differs in {differing}; move"):
            run_job(study.path, asked[0])


@pytest.mark.parametrize(
    ("changed", "counts"),
    [
        ({}, True),
        ({"task": "locomotion/gap"}, False),
        ({"level": "hard"}, False),
        ({"max_steps": 5_000_000}, False),
        ({"max_steps": 7, "benchmark_version": BENCHMARK_VERSION - 1}, True),  # its defaults may have been others
        ({"seed": 1}, False),
    ],
)
def test_a_probe_that_is_not_by_the_plan_does_not_count(
    changed: dict[str, object], counts: bool, finished: Study, tmp_path: Path
) -> None:
    study = Study(Path(shutil.copytree(finished.path, tmp_path / "s")), plan(probe=True))
    design = study.run(next(study.cells)).design(1)
    report = {"task": TASK, "level": "standard", "seed": 0, "max_steps": 300_000, "progress": 0.5}
    report |= {"benchmark_version": BENCHMARK_VERSION, **changed}
    (design.path / "probe.json").write_text(json.dumps(report))
    row, _ = read_outcomes(study)
    assert row.probe_progress == (0.5 if counts else None)
    asked = [job for job in pending(study) if job.cell == next(study.cells)]
    assert [job.stage for job in asked] == ([] if counts else ["probe"])


def test_what_is_still_to_be_judged_is_no_difference() -> None:
    first = DesignRow(arm="first", task=TASK, run=1, design=1, outcome="approved", verified=True, stable=True)
    second = first.model_copy(update={"arm": "second", "iterations": 2})
    judged = {each.what: each.value for each in differences([first, second], "first")}
    assert judged == {"approved": 0.0, "stable": 0.0, "iterations": 2.0}
    waiting = second.model_copy(update={"verified": False, "stable": False})
    assert {each.what for each in differences([first, waiting], "first")} == {"approved", "iterations"}
    unfinished = second.model_copy(update={"outcome": "unfinished"})
    assert differences([first, unfinished], "first") == ()


def test_a_lost_worker_is_retried_and_a_hopeless_job_does_not_stop_the_rest(tmp_path: Path) -> None:
    def before(job: Job, attempt: int) -> str:
        return "the machine went away" if job.cell.arm == "bare" or attempt == 1 else ""

    study = create_study(tmp_path / "s", plan())
    pool = Here(study, before)
    progress = run_study(study, pool)
    assert [row.outcome for row in read_outcomes(study)] == ["approved", "unfinished"]
    assert [job.cell.arm for job in progress.failed] == ["bare"]
    assert sum(job.cell.arm == "bare" for job in pool.begun) == MOST_ATTEMPTS
    assert [job.cell.arm for job in pool.begun[:2]] == ["rules", "bare"], "what failed waits for what was not tried"
    assert {str(note["error"]) for note in read_failures(study)} == {"the machine went away"}


def test_a_job_that_fails_after_its_output_is_complete_is_not_repeated(tmp_path: Path) -> None:
    study = create_study(tmp_path / "s", plan(arms=plan().arms[:1]))

    def fail(job: Job, _attempt: int) -> str:
        run_job(study.path, job)
        return "no film could be drawn"

    pool = Here(study, fail)
    progress = run_study(study, pool)
    assert (progress.done, progress.failed) == (len(set(pool.begun)), ())
    assert len(pool.begun) == len(set(pool.begun))
    assert {(note["attempt"], note["error"]) for note in read_failures(study)} == {(1, "no film could be drawn")}


def test_a_probe_takes_one_core_as_every_job_does(finished: Study) -> None:
    found = []

    def look(frame: FrameType, event: str, _argument: object) -> None:
        if event == "call" and frame.f_code is probe.__code__:
            found.append(frame.f_locals["threads"])
            raise InterruptedError

    sys.setprofile(look)
    try:
        with pytest.raises(InterruptedError):
            run_job(finished.path, Job(next(finished.cells), "probe", 1))
    finally:
        sys.setprofile(None)
    assert found == [1]


def test_jobs_run_in_processes_of_their_own(tmp_path: Path) -> None:
    study = create_study(tmp_path / "s", plan(arms=plan().arms[:1]))
    pool = LocalPool(study.path, 1)
    progress = run_study(study, pool)
    assert (progress.done, progress.failed, read_failures(study)) == (2, (), [])


def test_a_job_that_says_much_comes_to_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.stderr.write('said before\\n' * 20_000)\n")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])]))
    pool, ended = LocalPool(tmp_path, 1), list[EndedJob]()
    pool.begin(Job(next(Study(tmp_path, plan()).cells), "design"))
    waiting = threading.Thread(target=lambda: ended.append(pool.wait()), daemon=True)
    waiting.start()
    waiting.join(timeout=60.0)
    pool.close()
    assert ended, "the job never ended"
    assert "said before" in ended[0].error
    assert ended[0].error.endswith(
        f"{tmp_path} is not a study folder: study.toml not found; give the folder of a study, as studies/first"
    ), "the reason comes last"


def test_the_report_is_one_page_with_every_figure_beside_it(finished: Study) -> None:
    page = write_report(finished).read_text()
    assert "http://" not in page.replace("http://www.w3.org", "").replace("http://purl.org", "").replace(
        "http://creativecommons.org", ""
    )
    assert "data:image/png;base64" in page
    assert "1/1 (21–100 %)" in page
    assert "its tasks are not public" in page
    assert "<b>$0.00</b><span>per design, 0 tokens</span>" in page
    table = (finished.path / "report.md").read_text()
    assert "| bare | no automatic fixes | 1/1 (21–100 %) | 1/1 (21–100 %) | – | – | – | 1.0 |" in table
    assert "2 of 2 designs finished." in table
    assert "| reaching/button_pushing | 1 | 1/1 (21–100 %) | – | – | – |" in table
    assert (finished.path / "report.csv").read_text().count("\n") == 3
    assert len(json.loads((finished.path / "report.json").read_text())["designs"]) == 2


@pytest.mark.parametrize(("seeds", "perturbed"), [(1, True), (1, False), (0, True)])
def test_the_report_says_whether_successful_policies_were_perturbed(
    seeds: int, perturbed: bool, finished: Study, tmp_path: Path
) -> None:
    study = Study(Path(shutil.copytree(finished.path, tmp_path / "s")), plan(seeds=seeds, perturbed=perturbed))
    page = write_report(study).read_text()
    for text in (page, (study.path / "report.md").read_text()):
        assert ("protocol best; successful policies also evaluated in perturbed scenes" in text) == (seeds * perturbed)


def test_a_policy_judged_on_another_number_of_episodes_is_told_and_not_submitted(
    finished: Study, tmp_path: Path
) -> None:
    study = Study(Path(shutil.copytree(finished.path, tmp_path / "s")), plan(seeds=1))
    folder = training_folder_of(study.run(next(study.cells)).design(1), 0)
    folder.mkdir(parents=True)
    told = "1 policy evaluated on another number of held-out episodes than 100"
    for episodes in (20, 100):
        (folder / "evaluation.json").write_text(evaluation(11, of=episodes).model_dump_json())
        texts = [write_report(study).read_text(), (study.path / "report.md").read_text()]
        assert all((told in text) == (episodes == 20) for text in (*texts, compared(study, study)))
        if episodes == 20:
            with pytest.raises(UserError, match="evaluated on 20 held-out episodes, not on 100; evaluate it again"):
                submit(study, tmp_path / "s.json")
            assert not (tmp_path / "s.json").exists()
    submit(study, tmp_path / "s.json")
    read_submission(tmp_path / "s.json")


def test_the_report_says_which_successes_a_learned_policy_did_not_need(finished: Study, tmp_path: Path) -> None:
    study = Study(Path(shutil.copytree(finished.path, tmp_path / "s")), plan(seeds=3))
    learned = {"script": "", "from_probe": True}
    for seed, (won, recipe, by_mean) in enumerate(
        [(100, {"script": "a: 1", "from_probe": True}, 10), (100, learned, 9)]
    ):
        folder = training_folder_of(study.run(next(study.cells)).design(1), seed)
        folder.mkdir(parents=True)
        (folder / "config.json").write_text(json.dumps({"recipe": recipe}))
        told = {"mean_action": MeanAction(action=(0.0,), succeeded=by_mean, of=20)}
        (folder / "evaluation.json").write_text(evaluation(won, of=100).model_copy(update=told).model_dump_json())
    page = write_report(study).read_text()
    table = (study.path / "report.md").read_text()
    for text in (page, table):
        assert "1 of 2 successful policies plays an open-loop motion, which learning did not beat" in text
        assert "In 1 of 2 successful policies the constant mean action wins at least half of the replayed" in text
    rows = list(csv.DictReader((study.path / "report.csv").read_text().splitlines()))
    assert [(row["motions"], row["won_by_mean_action"]) for row in rows] == [("1", "1"), ("0", "0")]
    assert "*At 80, 95 %*: number of designs most of whose policies are valid and win at least this share" in table


@pytest.mark.parametrize(
    ("won", "recipe", "by_mean"),
    [
        (100, {"script": "", "from_probe": True}, 9),  # a learned policy
        (100, {"script": "a: 1", "from_probe": False}, 0),  # it corrects a script
        (100, {}, None),
        (10, {"script": "a: 1", "from_probe": True}, 20),  # not successful
    ],
)
def test_a_report_of_learned_policies_says_nothing_of_motions(
    won: int, recipe: dict[str, object], by_mean: int | None, finished: Study, tmp_path: Path
) -> None:
    study = Study(Path(shutil.copytree(finished.path, tmp_path / "s")), plan(seeds=1))
    folder = training_folder_of(study.run(next(study.cells)).design(1), 0)
    folder.mkdir(parents=True)
    (folder / "config.json").write_text(json.dumps({"recipe": recipe}))
    told = {"mean_action": None if by_mean is None else MeanAction(action=(0.0,), succeeded=by_mean, of=20)}
    (folder / "evaluation.json").write_text(evaluation(won, of=100).model_copy(update=told).model_dump_json())
    for text in (write_report(study).read_text(), (study.path / "report.md").read_text()):
        assert "open-loop motion, which" not in text
        assert "constant mean action" not in text


def evaluated(study: Study, folder: Path, **software: object) -> Study:
    """Return a copy of a study with one policy of each arm; the keys of `software` are fields of the evaluations."""
    made = Study(Path(shutil.copytree(study.path, folder)), plan(seeds=1, versions={"mujoco": "3.0.0"}))
    for number, cell in enumerate(made.cells):
        home = training_folder_of(made.run(cell).design(1), 0)
        home.mkdir(parents=True)
        told = {name: values[number] for name, values in software.items()}
        (home / "evaluation.json").write_text(evaluation(60, of=100).model_copy(update=told).model_dump_json())
    return made


def test_the_report_names_the_software_that_evaluated_the_policies(finished: Study, tmp_path: Path) -> None:
    versions = {"python": "3.11.7", "mujoco": "3.3.5"}
    alike = evaluated(finished, tmp_path / "a", commit=["abc", "abc"], versions=[versions, versions])
    page = write_report(alike).read_text()
    assert '<td>2 policies evaluated by</td><td class="text">commit abc, python 3.11.7, mujoco 3.3.5</td>' in page
    assert "<td>the plan was made with</td>" in page
    unlike = evaluated(finished, tmp_path / "b", commit=["abc", ""], versions=[versions, {}])
    page = write_report(unlike).read_text()
    assert page.count("<td>1 policy evaluated by</td>") == 2
    told = "Policies were evaluated by 2 versions of the software, which can change their results: "
    for text, wanted in ((page, True), ((unlike.path / "report.md").read_text(), True), (page_of(alike), False)):
        assert (told + "1 by commit abc, python 3.11.7, mujoco 3.3.5; 1 by an unknown commit." in text) == wanted
    later = evaluated(finished, tmp_path / "c", commit=["def", "def"], versions=[versions, versions])
    differ = "commit abc, python 3.11.7, mujoco 3.3.5 and commit def, python 3.11.7, mujoco 3.3.5"
    assert f"The studies also differ in: policies evaluated by {differ}" in " ".join(compared(alike, later).split())
    assert "also differ" not in compared(alike, alike)


def test_a_failure_that_was_cut_off_by_a_kill_does_not_stop_the_report(finished: Study, tmp_path: Path) -> None:
    study = Study(Path(shutil.copytree(finished.path, tmp_path / "my study")), finished.plan)
    file = study.path / "failures.jsonl"
    (job,) = {Job(cell, "verify", 1) for cell in study.cells if cell.arm == "bare"}
    runner._note_failure(study, EndedJob(job, "the disk was lost", 1.0), 1)
    whole = file.read_bytes()
    file.write_bytes(whole + whole[:20])
    assert [one["error"] for one in read_failures(study)] == ["the disk was lost"]
    assert "attempt 1: the disk was lost" in write_report(study).read_text()
    runner._note_failure(study, EndedJob(job, "once more", 1.0), 2)
    assert [one["error"] for one in read_failures(study)] == ["the disk was lost", "once more"]
    file.write_bytes(whole + b'{"time": 1}\n')
    with pytest.raises(UserError, match=r"line 2 of .*failures.jsonl is not a failed job; remove or restore that line"):
        read_failures(study)


def test_the_commands_of_a_report_work_for_a_folder_with_a_space(finished: Study, tmp_path: Path) -> None:
    study = Study(Path(shutil.copytree(finished.path, tmp_path / "my study")), finished.plan)
    page = html.unescape(write_report(study).read_text())
    assert f"<pre>aidsr benchmark '{study.path}' --resume\naidsr report '{study.path}'</pre>" in page


def page_of(study: Study) -> str:
    return (study.path / "report.html").read_text()


def compared(one: Study, other: Study) -> str:
    out = io.StringIO()
    print_comparison(Console(file=out, width=200), one, other)
    return out.getvalue()


def test_a_comparison_names_the_arms_that_it_leaves_out(finished: Study, tmp_path: Path) -> None:
    single = Study(Path(shutil.copytree(finished.path, tmp_path / "s")), plan(arms=plan().arms[:1]))
    said = "first: only the first arm is compared: rules, not bare. The report of the study compares its arms."
    assert said in compared(finished, single)
    assert said in compared(single, finished)
    assert "only the first arm" not in compared(single, single)


def test_an_untrained_study_is_not_compared_in_what_only_training_shows(finished: Study, tmp_path: Path) -> None:
    trained = Study(Path(shutil.copytree(finished.path, tmp_path / "s")), plan(seeds=1))
    folder = training_folder_of(trained.run(next(trained.cells)).design(1), 0)
    folder.mkdir(parents=True)
    (folder / "evaluation.json").write_text(evaluation(100, of=100).model_dump_json())
    for text in (compared(finished, trained), compared(trained, finished)):
        assert "stable" in text
        assert not re.search("^(valid|successful|episodes) ", text, re.MULTILINE)
        assert "The studies also differ in: seeds" in text
    text = compared(trained, trained)
    assert re.search(r"^valid +0 % +too few runs +1.000 +not significant", text, re.MULTILINE)
    assert "1 design of 1 run finished in both" in text


def test_an_arm_that_was_to_be_trained_but_had_no_stable_design_is_compared_as_failed() -> None:
    row = DesignRow(arm="first", task=TASK, run=1, design=1, outcome="invalid", complete=True, seeds=1)
    good = {"arm": "second", "outcome": "approved", "verified": True, "evaluations": (evaluation(4),)}
    found = {each.what: each.value for each in differences([row, row.model_copy(update=good)], "first")}
    assert (found["valid"], found["successful"], found["episodes"]) == (1.0, 1.0, 1.0)


def test_studies_of_two_protocols_or_with_perturbed_scenes_are_said_to_differ(finished: Study) -> None:
    other = Study(finished.path, plan(protocol="paper", perturbed=True))
    assert "The studies also differ in: protocol best and paper; perturbed False and True" in compared(finished, other)


def test_a_submission_can_be_checked(finished: Study, tmp_path: Path) -> None:
    path = tmp_path / "first.json"
    submit(finished, path)
    assert len(read_submission(path).scenes_sha256) == 2
    path.write_text(
        path.read_text().replace('"stable":true', '"stable":false', 1).replace('"stable": true', '"stable": false', 1)
    )
    with pytest.raises(UserError, match="was changed after"):
        read_submission(path)


def test_the_command_says_what_it_would_take_and_begins_nothing(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["benchmark", str(tmp_path / "s"), "--tasks", "gap", "tunnel", "--designs", "6", "--dry-run"])
    assert ended.value.code == 0
    said = capsys.readouterr().out
    assert "4 design, 12 verify, 12 train, 12 probe" in said
    assert list(tmp_path.iterdir()) == []


def report_of(*codes: str, layer: Literal["load", "simulate"] = "simulate") -> str:
    faults = [Fault(code=code, layer=layer, severity="error", message="") for code in codes]
    return ValidationReport(stable=not codes, faults=tuple(faults)).model_dump_json()


def test_a_fault_is_cured_only_where_it_was_looked_for_and_counted_once(tmp_path: Path) -> None:
    after = Arm(name="again", after="rules", feedback={TASK: "Longer."}, config=RunConfig(concepts=1))
    study = create_study(tmp_path / "s", plan(arms=(plan().arms[0], after)))
    first = [
        {"robot.xml": "", "robot_report.json": report_of("loose", "open")},
        {"robot.xml": "", "robot_report.json": report_of("open")},
        {"robot.xml": "", "scene_report.json": report_of("overlap")},
        {"robot.xml": "", "robot_report.json": report_of("loose")},
        {},
    ]
    iterations = {
        "rules": first,
        "again": [*first, {"concept.json": "", "robot.xml": "", "scene_report.json": report_of()}],
    }
    for cell in study.cells:
        for number, files in enumerate(iterations[cell.arm], 1):
            folder = study.home(cell) / "run" / "designs" / "1" / f"{number:02d}"
            folder.mkdir(parents=True)
            for name, text in files.items():
                (folder / name).write_text(text)
        (study.home(cell) / "run" / "run.json").write_text("{}")
    seen, cured = read_repairs(study)
    assert seen == {"loose": 2, "open": 2, "overlap": 1}
    assert [(each.code, each.changed) for each in cured] == [
        ("loose", "robot"),
        ("open", "robot"),
        ("loose", "concept"),
    ]


def test_a_document_that_does_not_load_cures_nothing(tmp_path: Path) -> None:
    study = create_study(tmp_path / "s", plan(arms=plan().arms[:1]))
    home = study.home(next(study.cells)) / "run"
    reports = [report_of("loose", "open"), report_of("not_xml", layer="load"), report_of("loose")]
    for number, report in enumerate(reports, 1):
        folder = home / "designs" / "1" / f"{number:02d}"
        folder.mkdir(parents=True)
        (folder / "robot.xml").touch()
        (folder / "robot_report.json").write_text(report)
    (home / "run.json").write_text("{}")
    seen, cured = read_repairs(study)
    assert seen == {"loose": 2, "open": 1, "not_xml": 1}
    assert [each.code for each in cured] == ["not_xml", "open"]


def film(path: Path, brightness: int) -> None:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=10)
        stream.width = stream.height = 32
        picture = av.VideoFrame.from_ndarray(np.full((32, 32, 3), brightness, np.uint8), format="rgb24")
        for packet in (*stream.encode(picture), *stream.encode()):
            container.mux(packet)


def test_a_robot_is_shown_with_its_best_policy(finished: Study, tmp_path: Path) -> None:
    study = Study(Path(shutil.copytree(finished.path, tmp_path / "s")), plan(seeds=4))
    design = study.run(next(study.cells)).design(1)
    for seed, verdict in enumerate([evaluation(1), evaluation(4, plausible=False), evaluation(3)]):
        training_folder_of(design, seed).mkdir(parents=True)
        (training_folder_of(design, seed) / "evaluation.json").write_text(verdict.model_dump_json())
        film(training_folder_of(design, seed) / "best.mp4", 80 * seed)
        (training_folder_of(design, seed) / "best.npz").touch()
    (card, *_) = gallery(study, read_outcomes(study)[:1])
    assert card.motion == training_folder_of(design, 2) / "best.npz"
    assert card.how_well == "not valid, 25 % of episodes won"
    (training_folder_of(design, 2) / "best.mp4").unlink()  # as where there is no OpenGL
    (card, *_) = gallery(study, read_outcomes(study)[:1])
    assert card.motion == training_folder_of(design, 2) / "best.npz"
    assert card.url.startswith("data:image/png")


def test_what_a_design_costs_is_not_drawn_before_one_came_to_an_end() -> None:
    ended = DesignRow(arm="first", task=TASK, run=1, design=1, outcome="invalid")
    coming = ended.model_copy(update={"arm": "second", "outcome": "unfinished"})
    drawn = cost_and_success(arm_lines([ended, coming], {"first": "builtin", "second": "builtin"}))
    assert ">first<" in drawn
    assert ">second<" not in drawn


def test_a_study_of_another_version_of_the_benchmark_is_not_gone_on_with(tmp_path: Path) -> None:
    study = create_study(tmp_path / "s", plan(benchmark_version=1))
    pool = Here(study)
    with pytest.raises(UserError, match="of benchmark version 1, whose tasks differ"):
        run_study(study, pool)
    assert pool.begun == []
    assert run_study(study, pool, without=frozenset(study.cells)).done == 0, "nothing is left to do"


def test_designs_must_be_whole_runs(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["benchmark", str(tmp_path / "s"), "--designs", "4"])
    assert ended.value.code == 2
    assert "use 3 or 6 designs" in capsys.readouterr().err
