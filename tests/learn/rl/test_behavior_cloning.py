"""A policy that begins with the probe's best motion can already do what the motion does."""

import json

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.openloop import ProbeReport
from aidsr.learn.rl.policy import TrainedPolicy
from aidsr.learn.rl.recipe import Recipe
from aidsr.learn.rl.training import train
from scenes import QuickPushing, small_learning

SMALL = Recipe(simulations=8, rollout_steps=8, batch_size=32, epochs=2, hidden_sizes=(16, 16), from_probe=True)
STEPS = 8_000


class NeverWon(QuickPushing):
    """Nothing succeeds."""

    def is_success(self, readings, state):
        return np.zeros(readings.n, dtype=bool)


def probed(folder) -> dict:
    kinds = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    return next(event for event in kinds if event["kind"] == "probed")


def won(scene, policy) -> float:
    variations = [scene.task.variation("held_out", index) for index in range(10)]
    return float(
        rollout(Episodes(scene.model, scene.task, scene.actions, variations, threads=1), policy).success.mean()
    )


def test_the_motion_is_known_before_anything_is_learned(tmp_path, monkeypatch):
    scene, shown, blank = small_learning(), tmp_path / "shown", tmp_path / "blank"
    monkeypatch.setattr("stable_baselines3.PPO.learn", lambda model, *_, **__: model)
    result = train(scene, shown, steps=STEPS, recipe=SMALL, threads=1)
    train(scene, blank, steps=STEPS, recipe=SMALL.model_copy(update={"from_probe": False}), threads=1)
    assert result.steps == probed(shown)["steps"]
    assert 250 * SMALL.simulations < result.steps <= STEPS / 2
    assert probed(shown)["ended"] == "succeeded"
    assert ProbeReport.model_validate_json((shown / "probe.json").read_text()).best.episode.ended == "succeeded"
    assert won(scene, TrainedPolicy.load(shown, SMALL, 2)) >= 0.8
    assert won(scene, TrainedPolicy.load(blank, SMALL, 2)) <= 0.2


def test_a_head_start_is_given_once(tmp_path, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("stable_baselines3.PPO.learn", interrupted)
    with pytest.raises(KeyboardInterrupt):
        train(small_learning(), tmp_path, steps=STEPS, recipe=SMALL, threads=1)
    began = TrainedPolicy.load(tmp_path / "checkpoint", SMALL, 2)
    monkeypatch.setattr("stable_baselines3.PPO.learn", lambda model, *_, **__: model)
    result = train(small_learning(), tmp_path, steps=STEPS, recipe=SMALL, threads=1)
    kinds = [json.loads(line)["kind"] for line in (tmp_path / "events.jsonl").read_text().splitlines()]
    assert (kinds.count("probed"), result.steps) == (1, probed(tmp_path)["steps"])
    seen = np.random.default_rng(0).normal(size=(5, began.normalisation.mean.size))
    assert np.array_equal(TrainedPolicy.load(tmp_path, SMALL, 2).act(seen), began.act(seen))


def test_learning_goes_on_from_there_and_counts_what_was_spent(tmp_path):
    heard = []
    result = train(small_learning(), tmp_path, steps=STEPS, recipe=SMALL, threads=1, listen=heard.append)
    assert heard[0].steps > probed(tmp_path)["steps"]
    assert result.steps <= STEPS + SMALL.simulations * SMALL.rollout_steps
    assert result.success_share > 0.5


def test_what_no_motion_can_do_is_learned_from_nothing(tmp_path):
    train(small_learning(NeverWon()), tmp_path, steps=STEPS, recipe=SMALL, threads=1)
    report = ProbeReport.model_validate_json((tmp_path / "probe.json").read_text())
    assert probed(tmp_path)["ended"] == "out_of_time"
    assert probed(tmp_path)["steps"] == round(report.simulated_s / QuickPushing.control_dt_s)
