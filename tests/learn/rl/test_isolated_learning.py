"""Training, evaluating and probing a foreign scene happens in a child process, where it can do no harm."""

from __future__ import annotations

import ctypes
import json
import os
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

from pydantic import TypeAdapter

import aidsr
from aidsr.core.errors import IsolationError, UserError
from aidsr.learn.rl.curve_point import CurvePoint
from aidsr.learn.rl.training_config import TrainingConfig
from aidsr.learn.rl.training_folder import TrainingFolder
from aidsr.sandbox.environment import inside_worker
from aidsr.tasks import load_task
from aidsr.tasks.travelling_task import TravellingTask, can_travel
from scenes import QuickPushing, small_scene


class Crashing(QuickPushing):
    """Does what a scene can make a native library do, in the process that steps it."""

    def sample_variation(self, rng):
        if inside_worker():
            ctypes.string_at(0)
        return super().sample_variation(rng)


class Telling(QuickPushing):
    """Says where it is played."""

    def sample_variation(self, rng):
        raise UserError(f"in process {os.getpid()}")


def probed(task) -> object:
    return aidsr.probe(small_scene(), task, candidates=16, variations=1, threads=1)


def trained(task, folder: Path, **options) -> aidsr.runs.trainings.Training:
    return aidsr.train(small_scene(), task, out=folder, threads=1, **({"steps": 64} | options))


def test_a_crash_is_one_sentence_and_leaves_this_process_alone(tmp_path):
    for call in (lambda: probed(Crashing()), lambda: trained(Crashing(), tmp_path)):
        with pytest.raises(IsolationError, match=r"the process running run_(probe|training) died: SIGSEGV"):
            call()


def test_a_task_of_a_script_is_played_here_because_no_other_process_could_import_it(tmp_path):
    class Local(Telling):
        pass

    assert can_travel(Telling())
    assert not can_travel(Local())
    here = f"in process {os.getpid()}"
    for call in (probed, lambda task: trained(task, tmp_path)):
        with pytest.raises(UserError, match=here):
            call(Local())
        with pytest.raises(UserError, match=r"in process \d+") as elsewhere:
            call(Telling())
        assert str(elsewhere.value) != here


def test_a_task_that_comes_back_from_a_child_is_not_unpickled():
    adapter = TypeAdapter(TravellingTask)
    sent = adapter.dump_python(load_task("button_pushing"))
    with pytest.raises(ValueError, match="never back"):
        adapter.validate_python(sent)
    assert adapter.validate_python(adapter.dump_python("button_pushing")) == "button_pushing"


def test_the_curve_is_heard_and_every_file_is_where_it_belongs(tmp_path):
    heard: list[CurvePoint] = []
    home = tmp_path / "learned" / "here"
    training = trained("button_pushing", home, steps=1024, tensorboard=True, listen=heard.append)
    assert training.path == home / "001"
    assert [point.steps for point in heard] == list(range(96, 1057, 96))  # 32 simulations, held for three steps
    assert {"config.json", "training.json", "policy.zip", "curve.csv", "tensorboard"} <= {
        path.name for path in training.path.iterdir()
    }
    evaluation = aidsr.evaluate(training, episodes=20, threads=1, videos=False)
    assert (training.path / "evaluation.json").exists()
    assert len(evaluation.episodes) == 20
    assert evaluation.commit


def test_an_interrupted_training_keeps_what_it_learned_and_resumes(tmp_path):
    def impatient(point: CurvePoint) -> None:
        if point.steps >= 1024:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        trained("button_pushing", tmp_path, steps=4096, listen=impatient)
    events = (tmp_path / "001" / "events.jsonl").read_text().splitlines()
    kinds = [json.loads(event)["kind"] for event in events]
    assert kinds[0] == "started"
    assert kinds[-1] == "checkpoint"
    heard: list[int] = []
    again = trained("button_pushing", tmp_path, steps=4096, listen=lambda point: heard.append(point.steps))
    assert again.path == tmp_path / "001"
    assert min(heard) > 1024
    assert TrainingFolder(again.path).read("config.json", TrainingConfig).steps == 4096
