"""Runs travel to a cluster as bytes; what comes back is what the job made, and nothing that others made meanwhile."""

from __future__ import annotations

from pathlib import Path

import pytest

from aidsr.core.config import RunConfig
from aidsr.runs import DesignFolder
from aidsr.runs.origin import MARK
from aidsr.studies.cluster import pack, run_packed_job, unpack
from aidsr.studies.jobs import VERIFIED, Job, output_of_job, run_job
from aidsr.studies.planned import training_folder_of
from aidsr.studies.study import Arm, Study, StudyPlan, create_study

PLAN = StudyPlan(
    tasks=("reaching/button_pushing",),
    arms=(Arm(name="rules", config=RunConfig(concepts=1)),),
    runs=1,
    seeds=2,
    protocol="best",
)


@pytest.fixture
def study(tmp_path: Path) -> Study:
    """A study whose one run has a design with two policies, none of them real."""
    study = create_study(tmp_path / "here", PLAN)
    design = design_of(study)
    for seed in (0, 1):
        (training_folder_of(design, seed) / "checkpoint").mkdir(parents=True)
        (training_folder_of(design, seed) / "checkpoint" / "history.json").write_text("{}")
        (training_folder_of(design, seed) / "curve.csv").write_text("early\n")
    (study.home(next(study.cells)) / "run" / "run.json").write_text("{}")
    return study


def design_of(study: Study) -> DesignFolder:
    return DesignFolder(study.home(next(study.cells)) / "run" / "designs" / "1")


def sent(study: Study) -> bytes:
    return pack(study.path, study.path / "study.toml", study.home(next(study.cells)))


def test_a_run_travels_whole_with_the_plan(study: Study, tmp_path: Path) -> None:
    unpack(sent(study), tmp_path / "there")
    names = {path.relative_to(study.path) for path in study.path.rglob("*")}
    assert {path.relative_to(tmp_path / "there") for path in (tmp_path / "there").rglob("*")} == names - {Path(MARK)}
    assert (tmp_path / "there" / "study.toml").read_text() == (study.path / "study.toml").read_text()


@pytest.mark.parametrize(
    ("job", "made"),
    [
        (Job(next(Study(Path(), PLAN).cells), "design"), ""),
        (Job(next(Study(Path(), PLAN).cells), "verify", 1), "run/designs/1/verified.json"),
        (Job(next(Study(Path(), PLAN).cells), "train", 1, 1), "run/designs/1/training/002"),
        (Job(next(Study(Path(), PLAN).cells), "probe", 1), "run/designs/1/probe.json"),
    ],
)
def test_a_job_makes_one_thing(job: Job, made: str, study: Study) -> None:
    assert output_of_job(study, job) == study.home(job.cell) / made


def test_a_policy_that_comes_back_leaves_the_one_beside_it_alone(study: Study, tmp_path: Path) -> None:
    there, job = Study(tmp_path / "there", PLAN), Job(next(study.cells), "train", 1, 1)
    unpack(sent(study), there.path)
    (output_of_job(there, job) / "curve.csv").write_text("late\n")
    (output_of_job(there, job) / "checkpoint" / "history.json").unlink()
    (output_of_job(there, job) / "checkpoint").rmdir()
    sibling = training_folder_of(design_of(study), 0)
    (sibling / "curve.csv").write_text("later still\n")
    (sibling / "checkpoint" / "history.json").unlink()
    unpack(pack(there.path, output_of_job(there, job)), study.path, instead_of=output_of_job(study, job))
    assert (sibling / "curve.csv").read_text() == "later still\n"
    assert not (sibling / "checkpoint" / "history.json").exists()
    assert (output_of_job(study, job) / "curve.csv").read_text() == "late\n"
    assert not (output_of_job(study, job) / "checkpoint").exists(), "what the job removed is gone here as well"
    assert sorted(path.name for path in study.path.iterdir()) == [MARK, "runs", "study.toml"]


def test_a_worker_sends_back_what_its_job_made(tmp_path: Path) -> None:
    study = create_study(tmp_path / "here", PLAN)
    design, verify = Job(next(study.cells), "design"), Job(next(study.cells), "verify", 1)
    run_job(study.path, design)
    packed, *said = run_packed_job(sent(study), verify.as_dict())
    assert said == ["", ()]
    unpack(packed, tmp_path / "back")
    assert [path.name for path in (tmp_path / "back").rglob("*") if path.is_file()] == [VERIFIED]
