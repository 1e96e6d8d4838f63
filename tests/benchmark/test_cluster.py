"""Runs travel as bytes: nothing but the study's folder is written, and a cluster does what one machine does."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("ray", reason="needs the extra ray")

from aidsr.benchmark.cluster import RayPool, pack, unpack
from aidsr.benchmark.driving import drive, failures_of
from aidsr.benchmark.jobs import pending
from aidsr.benchmark.outcomes import read_outcomes
from aidsr.benchmark.study import Arm, StudyPlan, begin_study
from aidsr.runs import RunConfig

PLAN = StudyPlan(
    tasks=("reaching/button_pushing",),
    arms=(Arm(name="rules", config=RunConfig(concepts=1)),),
    runs=2,
    seeds=0,
    probe=False,
)


def test_a_run_travels_whole(tmp_path: Path) -> None:
    study = begin_study(tmp_path / "here", PLAN)
    job = next(pending(study))
    home = study.home(job.cell)
    (home / "deep").mkdir(parents=True)
    (home / "deep" / "file.txt").write_text("kept")
    unpack(pack(study.path, job.cell), tmp_path / "there")
    assert (tmp_path / "there" / "study.toml").read_text() == (study.path / "study.toml").read_text()
    assert (tmp_path / "there" / "runs" / job.cell.name / "deep" / "file.txt").read_text() == "kept"


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_cluster_of_one_machine_finishes_a_study(tmp_path: Path) -> None:
    study = begin_study(tmp_path / "study", PLAN)
    progress = drive(study, RayPool(study.path, "local"))
    assert (progress.done, progress.failed, failures_of(study)) == (4, (), [])
    assert [row.outcome for row in read_outcomes(study)] == ["approved", "approved"]
