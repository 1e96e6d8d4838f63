"""The protocol `best` is beaten by a motion that a short probe finds, where that wins more than what was learned."""

import json
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

import torch

from aidsr.learn.episodes import overlap_meter, plausibility
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.openloop.script_policy import script_policy
from aidsr.learn.rl import fallback_motion, training
from aidsr.learn.rl.fallback_motion import find_fallback_motion
from aidsr.learn.rl.policy import TrainedPolicy
from aidsr.learn.rl.recipe import PROTOCOLS, Recipe, recipe_of
from aidsr.learn.rl.soft_actor_critic import SoftActorCritic
from aidsr.learn.rl.trained import FinishedTraining
from aidsr.learn.rl.training import train
from aidsr.learn.rl.training_config import TrainingConfig
from aidsr.learn.rl.training_folder import FolderInUseError, TrainingFolder, folder_for
from aidsr.runs.trainings import Training
from scenes import QuickPushing, small_learning

SMALL = Recipe(
    algorithm="sac",
    simulations=8,
    hold_steps=3,
    batch_size=32,
    hidden_sizes=(16, 16),
    updates=1,
    noiseless_simulations=2,
    from_probe=True,
)
STEPS = 10_000


class NeverWon(QuickPushing):
    """Nothing succeeds."""

    def is_success(self, readings, state):
        return np.zeros(readings.n, dtype=bool)


def events(folder) -> list[dict]:
    return [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]


def won(folder) -> float:
    policy, scene = FinishedTraining.load(folder).policy, config_of(folder).recipe.acting_in(small_learning())
    variations = [scene.task.variation("held_out", index) for index in range(10)]
    episodes = Episodes(scene.model, scene.task, scene.actions, variations, threads=1)
    return float(rollout(episodes, policy).success.mean())


def config_of(folder) -> TrainingConfig:
    return TrainingFolder(folder).read("config.json", TrainingConfig)


class WonBy:
    """Takes the place of a rollout, and lets a share of the episodes be won."""

    def __init__(self, share: float) -> None:
        self.share, self.play = share, fallback_motion.rollout_without_overlap

    def __call__(self, *about):
        played = self.play(*about)
        return replace(played, success=np.arange(played.success.size) < self.share * played.success.size)


def learn_to_rest(model, *_, **__) -> None:
    """Take the place of learning."""
    with torch.no_grad():
        model.actor.mu.weight.zero_()
        model.actor.mu.bias.fill_(-5.0)


def test_a_motion_that_wins_in_variations_it_was_not_searched_in_is_found():
    scene = small_learning()
    found = find_fallback_motion(scene, seed=0, threads=1)
    assert found.share >= 0.95
    assert found.failed_checks == ()
    script_policy(scene, found.script)
    assert found.steps > found.report.simulated_s / QuickPushing.control_dt_s, "the other variations are counted"


@pytest.mark.parametrize(("share", "is_found"), [(0.4, False), (0.5, True)])
def test_a_motion_that_wins_less_than_half_of_the_others_is_none(monkeypatch, share, is_found):
    monkeypatch.setattr(fallback_motion, "rollout_without_overlap", WonBy(share))
    found = find_fallback_motion(small_learning(), seed=0, threads=1)
    assert (bool(found.script), found.share) == (is_found, share if is_found else 0.0)


def test_where_nothing_wins_nothing_else_is_played(monkeypatch):
    monkeypatch.setattr(
        fallback_motion, "rollout_without_overlap", lambda *about: pytest.fail("nothing won in the search")
    )
    found = find_fallback_motion(small_learning(NeverWon()), seed=0, threads=1)
    assert (found.share, found.script) == (0.0, "")
    assert found.steps == round(found.report.simulated_s / QuickPushing.control_dt_s)


def test_a_motion_in_which_parts_overlap_deeply_does_not_count(monkeypatch):
    monkeypatch.setattr(overlap_meter, "DEEP", -1.0)
    assert find_fallback_motion(small_learning(), seed=0, threads=1).share == 0.0


def test_a_motion_that_an_evaluation_calls_implausible_is_not_used(monkeypatch):
    monkeypatch.setattr(plausibility, "MOVED_LENGTHS", 1e9)
    found = find_fallback_motion(small_learning(), seed=0, threads=1)
    assert (found.script, found.share, found.failed_checks) == ("", 0.0, ("moves",))


@pytest.mark.parametrize(("penalty", "stopped"), [(0.0, "saturated"), (0.1, "budget")])
def test_a_policy_in_which_parts_overlap_deeply_does_not_succeed(tmp_path, monkeypatch, penalty, stopped):
    script = find_fallback_motion(small_learning(), seed=0, threads=1).script
    monkeypatch.setattr(overlap_meter, "DEEP", -1.0)
    recipe = SMALL.model_copy(update={"overlap_penalty": penalty}).beginning_with(script)
    result = train(small_learning(), tmp_path, steps=600, recipe=recipe, threads=1)
    assert result.stopped == stopped
    assert (result.success_share == 0.0) == bool(penalty)


def test_a_motion_that_wins_nearly_always_is_the_policy(tmp_path):
    result = train(small_learning(), tmp_path, steps=STEPS, recipe=SMALL, threads=1)
    config = config_of(tmp_path)
    assert config.recipe.script == config.motion != ""
    assert (result.stopped, result.success_share) == ("saturated", 1.0)
    assert config.probe_steps == next(event["steps"] for event in events(tmp_path) if event["kind"] == "probed")
    assert result.steps < 20 * 25, "what it cost to test the motion; the search is not among the steps"
    assert result.wall_s >= config.probe_s > 0
    assert FinishedTraining.load(tmp_path).scene.actions.base, "evaluated as it was trained"


def test_a_policy_that_wins_less_than_the_motion_makes_way_for_it(tmp_path, monkeypatch):
    monkeypatch.setattr(fallback_motion, "rollout_without_overlap", WonBy(0.9))
    monkeypatch.setattr(SoftActorCritic, "learn", learn_to_rest)
    result = train(small_learning(), tmp_path, steps=STEPS, recipe=SMALL, threads=1)
    config = config_of(tmp_path)
    beaten = next(event for event in events(tmp_path) if event["kind"] == "beaten")
    assert (beaten["success_share"], beaten["motion_share"]) == (0.0, 0.9)
    assert (config.recipe.script, result.stopped, result.success_share) == (config.motion, "budget", 1.0)
    assert won(tmp_path) == 1.0
    assert Training(tmp_path).beginning == "; the policy is a motion of the probe, which learning did not beat"


@pytest.mark.parametrize("during", ["play_fallback", "finish"])
def test_a_kill_while_the_motion_that_beat_it_is_tested_changes_nothing(tmp_path, monkeypatch, during):
    monkeypatch.setattr(fallback_motion, "rollout_without_overlap", WonBy(0.9))
    monkeypatch.setattr(SoftActorCritic, "learn", learn_to_rest)
    whole = train(small_learning(), tmp_path / "whole", steps=STEPS, recipe=SMALL, threads=1)

    def killed(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(training._Training, during, killed)
        with pytest.raises(KeyboardInterrupt):
            train(small_learning(), tmp_path / "killed", steps=STEPS, recipe=SMALL, threads=1)
    result = train(small_learning(), tmp_path / "killed", steps=STEPS, recipe=SMALL, threads=1)
    assert result.model_copy(update={"wall_s": whole.wall_s}) == whole
    assert won(tmp_path / "killed") == 1.0
    assert not (tmp_path / "killed" / "checkpoint").exists()


def test_a_policy_that_wins_about_as_much_stays(tmp_path, monkeypatch):
    monkeypatch.setattr(fallback_motion, "rollout_without_overlap", WonBy(0.5))
    result = train(small_learning(), tmp_path, steps=STEPS, recipe=SMALL, threads=1)
    config = config_of(tmp_path)
    assert config.motion
    assert result.success_share > config.motion_share
    assert (config.recipe.script, Training(tmp_path).beginning) == ("", "")


@pytest.mark.parametrize(
    ("motion", "policy", "replaced"),
    [(14, 10, True), (14, 11, False), (18, 14, True), (18, 15, False), (20, 16, True), (20, 17, False), (10, 6, True)],
)
def test_a_motion_replaces_a_policy_that_wins_four_episodes_less(tmp_path, motion, policy, replaced):
    scene = small_learning()
    config = TrainingConfig.of(scene, steps=STEPS, seed=0, recipe=SMALL)
    config = config.model_copy(update={"motion": "left: 1", "motion_share": motion / 20})
    learning = training._Training(scene, TrainingFolder(tmp_path), config, 1, tensorboard=False)
    learning.history.won = policy
    learning.history.recent.extend([(1.0, 1.0, 1.0)] * policy + [(0.0, 0.0, 0.0)] * (20 - policy))
    assert learning.needs_fallback("budget") is replaced
    assert not learning.needs_fallback("saturated")


def test_the_same_request_is_the_same_training_whatever_the_probe_found(tmp_path):
    scene = small_learning()
    home = tmp_path / "training"
    asked = TrainingConfig.of(scene, steps=STEPS, seed=0, recipe=SMALL)
    first = train(scene, folder_for(home, asked), steps=STEPS, recipe=SMALL, threads=1)
    assert folder_for(home, asked) == home / "001"
    assert train(scene, home / "001", steps=STEPS, recipe=SMALL, threads=1) == first
    assert len([event for event in events(home / "001") if event["kind"] == "probed"]) == 1
    with pytest.raises(FolderInUseError, match="differs in recipe"):
        train(scene, home / "001", steps=STEPS, recipe=SMALL.from_nothing(), threads=1)


def test_a_training_without_such_a_motion_is_that_of_before_and_goes_on_after_a_kill(tmp_path, monkeypatch):
    def killed(self):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(training._Training, "run", killed)
        with pytest.raises(KeyboardInterrupt):
            train(small_learning(NeverWon()), tmp_path / "begun", steps=STEPS, recipe=SMALL, threads=1)
    begun, plain = tmp_path / "begun", tmp_path / "plain"
    result = train(small_learning(NeverWon()), begun, steps=STEPS, recipe=SMALL, threads=1)
    config = config_of(begun)
    assert (config.recipe.script, result.stopped) == ("", "budget")
    assert [event["kind"] for event in events(begun)][:3] == ["started", "probed", "resumed"]
    train(small_learning(NeverWon()), plain, steps=STEPS, recipe=SMALL.from_nothing(), threads=1)
    learned = [TrainedPolicy.load(folder, SMALL, 2) for folder in (begun, plain)]
    seen = np.random.default_rng(0).normal(size=(5, learned[0].normalisation.mean.size))
    assert np.array_equal(*(policy.act(seen) for policy in learned)), "a search that finds nothing changes nothing"


def test_a_search_that_was_killed_is_made_again(tmp_path, monkeypatch):
    def killed(*_, **__):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(fallback_motion, "find_fallback_motion", killed)
        with pytest.raises(KeyboardInterrupt):
            train(small_learning(), tmp_path, steps=STEPS, recipe=SMALL, threads=1)
    assert config_of(tmp_path).recipe == SMALL
    train(small_learning(), tmp_path, steps=STEPS, recipe=SMALL, threads=1)
    assert config_of(tmp_path).recipe.script


def test_a_budget_too_small_for_a_search_has_none(tmp_path):
    train(small_learning(), tmp_path, steps=800, recipe=SMALL, threads=1)
    assert "probed" not in [event["kind"] for event in events(tmp_path)]
    assert config_of(tmp_path).probe_steps == 0


def test_who_names_a_script_or_none_asks_no_probe():
    assert PROTOCOLS["best"].from_probe
    assert recipe_of("best").from_probe
    assert not recipe_of("best", script="both: 1").from_probe
    assert recipe_of("best").beginning_with("") == recipe_of("best")
    assert not recipe_of("best").from_nothing().from_probe


@pytest.mark.parametrize(
    ("script", "own", "starts_from", "searches"),
    [
        ("own", "own: 1", "own: 1", False),
        ("own", "", "", True),
        ("none", "own: 1", "", False),
        ("given: 1", "own: 1", "given: 1", False),
    ],
)
def test_a_policy_starts_from_the_given_the_own_or_no_motion(script, own, starts_from, searches):
    recipe = recipe_of("best").starting_from(script, own)
    assert (recipe.script, recipe.from_probe) == (starts_from, searches)
    assert recipe_of("paper", from_probe=True).starting_from(script, own).from_probe
    assert recipe_of("paper").starting_from(script, own) == recipe_of("paper")
