"""A cluster does what one machine does."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("ray", reason="needs the extra ray")

from aidsr.core.config import RunConfig
from aidsr.studies.cluster import RayPool
from aidsr.studies.outcomes import DesignRow, read_outcomes
from aidsr.studies.pool import LocalPool
from aidsr.studies.runner import Progress, read_failures, run_study
from aidsr.studies.study import Arm, Study, StudyPlan, create_study

PLAN = StudyPlan(
    tasks=("reaching/button_pushing",),
    arms=(Arm(name="rules", config=RunConfig(concepts=1)),),
    runs=2,
    seeds=0,
    protocol="best",
    probe=False,
)


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_cluster_of_one_machine_finishes_a_study(tmp_path: Path) -> None:
    study = create_study(tmp_path / "study", PLAN)
    progress = run_study(study, RayPool(study.path, "local"))
    assert (progress.done, progress.failed, read_failures(study)) == (4, (), [])
    assert [row.outcome for row in read_outcomes(study)] == ["approved", "approved"]


TRAINED = PLAN.model_copy(update={"tasks": ("grasping/dynamic_catching",), "seeds": 1, "steps": 600})
"""Short episodes, so that little of a test is training."""


@pytest.fixture
def cluster(monkeypatch: pytest.MonkeyPatch) -> Iterator[object]:
    from ray.cluster_utils import Cluster

    monkeypatch.setenv("RAY_worker_niceness", "0")  # 15 unless said, and then jobs run out of time on a busy machine

    several = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    yield several
    several.shutdown()


def without_times(study: Study) -> list[DesignRow]:
    return [row.model_copy(update={"latency_s": 0.0, "training_s": 0.0}) for row in read_outcomes(study)]


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_several_nodes_find_what_one_machine_finds(tmp_path: Path, cluster) -> None:
    pytest.importorskip("stable_baselines3", reason="needs the extra rl")
    cluster.add_node(num_cpus=1)
    here, there = (create_study(tmp_path / name, TRAINED) for name in ("here", "there"))
    assert run_study(here, LocalPool(here.path, 2)).failed == ()
    assert run_study(there, RayPool(there.path, cluster.address)).failed == ()
    assert without_times(there) == without_times(here)
    assert all(row.evaluations for row in read_outcomes(there))


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_a_lost_node_loses_no_job_and_doubles_none(tmp_path: Path, cluster) -> None:
    doomed = cluster.add_node(num_cpus=1)
    study, lost = create_study(tmp_path / "study", PLAN), []

    def lose(progress: Progress) -> None:
        import ray

        if len(progress.running) == 2 and not lost:
            deadline = time.monotonic() + 120.0
            while ray.available_resources().get("CPU", 0) > 0:  # until the node to be lost has a job
                assert time.monotonic() < deadline, "the node to be lost was given no job"
                time.sleep(0.2)
            cluster.remove_node(doomed, allow_graceful=False)
            lost.append(progress.running)

    progress = run_study(study, RayPool(study.path, cluster.address), lose)
    assert lost, "no node was taken away: the test shows nothing"
    assert progress.failed == ()
    assert [len(list(study.home(cell).glob("*/run.json"))) for cell in study.cells] == [1, 1]
    assert [row.outcome for row in read_outcomes(study)] == ["approved", "approved"]
