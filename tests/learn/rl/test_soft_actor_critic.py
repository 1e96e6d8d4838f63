"""Soft actor-critic: what the protocol `best` learns with, how it goes on after a kill, and what it costs."""

import copy
import json
import os
import subprocess
import sys
import zipfile
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

import torch
from stable_baselines3 import SAC

from aidsr.core.errors import UserError
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.rl import recipe, training
from aidsr.learn.rl.callbacks import History
from aidsr.learn.rl.evaluation import evaluate
from aidsr.learn.rl.fused_adam import FusedAdam
from aidsr.learn.rl.policy import Normalisation, TrainedPolicy, without_critics
from aidsr.learn.rl.recipe import PROTOCOLS, Recipe, recipe_of
from aidsr.learn.rl.soft_actor_critic import SoftActorCritic
from aidsr.learn.rl.trained import FinishedTraining, evaluate_training
from aidsr.learn.rl.training import train
from aidsr.learn.rl.training_folder import TrainingFolder
from aidsr.tasks import Feature, Variation
from scenes import Always, QuickPushing, small_learning

SMALL = Recipe(
    algorithm="sac",
    simulations=8,
    hold_steps=3,
    batch_size=32,
    hidden_sizes=(16, 16),
    updates=2,
    noiseless_simulations=2,
)
STEPS = 1_200


@dataclass(frozen=True)
class TwoSided(QuickPushing):
    """Won by bending to the side that the task names, lost by bending to the other."""

    features: ClassVar = (Feature("side", "", (-1, 1), "(state)"),)

    def sample_variation(self, rng):
        return Variation(parameters={"side": (rng.choice([-1.0, 1.0]),)})

    def reset_state(self, readings):
        return {}

    def update_state(self, readings, state):
        return state

    def _bent(self, readings):
        return readings["tip_position"][:, 0] * readings.parameters["side"][:, 0]

    def observe(self, readings, state):
        return readings.parameters["side"]

    def progress(self, readings, state):
        return np.clip(self._bent(readings) / 0.05, 0.0, 1.0)

    def is_success(self, readings, state):
        return self._bent(readings) > 0.05

    def is_failure(self, readings, state):
        return self._bent(readings) < -0.05


@dataclass(frozen=True)
class NeverWon(TwoSided):
    """Nothing succeeds."""

    def is_success(self, readings, state):
        return np.zeros(readings.n, dtype=bool)


@dataclass(frozen=True)
class WonTogether(TwoSided):
    """Won by being there, but only where as many simulations run side by side as in training."""

    def is_success(self, readings, state):
        return np.full(readings.n, readings.n == SMALL.simulations)

    def is_failure(self, readings, state):
        return np.zeros(readings.n, dtype=bool)


@dataclass(frozen=True)
class WonAtFirst(TwoSided):
    """Won by being there for a while, then by nothing any more."""

    played: ClassVar[int] = 0

    def is_success(self, readings, state):
        type(self).played += readings.n == SMALL.simulations
        return np.full(readings.n, readings.n == SMALL.simulations and self.played < 160)

    def is_failure(self, readings, state):
        return np.zeros(readings.n, dtype=bool)


def trained(folder, task=TwoSided, *, steps=STEPS, recipe=SMALL, threads=1, **options):
    return train(small_learning(task()), folder, steps=steps, recipe=recipe, threads=threads, **options)


def events(folder) -> list[dict]:
    return [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]


def policy_of(folder) -> TrainedPolicy:
    return TrainedPolicy.load(folder, SMALL, 2)


def at(steps, ending):
    """Return a listener that ends a training with the first point of its curve from so many steps on."""

    def listen(point):
        if point.steps >= steps:
            raise ending

    return listen


def test_it_learns_what_no_single_motion_can_do(tmp_path):
    recipe = SMALL.model_copy(update={"simulations": 16, "batch_size": 128, "hidden_sizes": (64, 64), "updates": 16})
    result = trained(tmp_path, steps=10_000, recipe=recipe)
    assert result.success_share >= 0.9
    policy = TrainedPolicy.load(tmp_path, recipe, 2)
    scene = small_learning(TwoSided()).with_hold(recipe.hold_steps)
    variations = [scene.task.variation("held_out", index) for index in range(20)]
    episodes = Episodes(scene.model, scene.task, scene.actions, variations, threads=1)
    assert rollout(episodes, policy).success.mean() >= 0.9


def test_the_same_seed_gives_the_same_policy_whatever_the_threads(tmp_path):
    for name, options in {"one": {}, "three": {"threads": 3}, "other": {"seed": 1}}.items():
        result = trained(tmp_path / name, **options)
        assert STEPS <= result.steps < STEPS + 2 * 3 * SMALL.simulations
    one, three, other = (policy_of(tmp_path / name).fingerprint for name in ("one", "three", "other"))
    assert one == three != other


def test_a_resumed_training_goes_on_with_all_it_has_seen(tmp_path, monkeypatch):
    """Its networks, the weight of its entropy, and the transitions it learns from."""
    with pytest.raises(KeyboardInterrupt):
        trained(tmp_path, listen=at(STEPS // 2, KeyboardInterrupt))
    saved = tmp_path / "checkpoint" / "memory"
    before = {path.stem: np.load(path, allow_pickle=False) for path in saved.iterdir()}
    networks = TrainedPolicy.load(tmp_path / "checkpoint", SMALL, 2).fingerprint
    assert before["position"] == len(before["rewards"]) >= STEPS // 2 // 3 // SMALL.simulations
    assert before["log_entropy_weight"] != np.log(np.float32(SMALL.entropy_weight))
    models = []
    with monkeypatch.context() as still:
        still.setattr(SoftActorCritic, "learn", lambda model, *_, **__: models.append(model))
        still.setattr(TrainingFolder, "remove_folder", lambda *_: None)
        assert trained(tmp_path).resumed == 1
    after = {path.stem: np.load(path, allow_pickle=False) for path in saved.iterdir()}
    assert before.keys() == after.keys()
    assert all(np.array_equal(before[name], after[name]) for name in before)
    assert policy_of(tmp_path).fingerprint == networks


def test_a_killed_training_comes_to_its_end(tmp_path):
    for ending_at in (STEPS // 3, STEPS // 2):
        with pytest.raises(KeyboardInterrupt):
            trained(tmp_path, listen=at(ending_at, KeyboardInterrupt))
    heard = []
    result = trained(tmp_path, listen=heard.append)
    assert (result.resumed, result.stopped) == (2, "budget")
    assert heard[0].steps > STEPS // 2
    assert not (tmp_path / "checkpoint").exists()


def test_an_update_is_that_of_stable_baselines3(tmp_path, monkeypatch):
    """From the same networks, memory and random numbers, after ten updates; values and actor differ by rounding."""
    models = []
    with monkeypatch.context() as untrained:
        untrained.setattr(SoftActorCritic, "train", lambda model, **_: models.append(model))
        trained(tmp_path)
    model = models[-1]

    def updated(train):
        model.set_parameters(before, device="cpu")
        with torch.no_grad():
            model.log_ent_coef.fill_(-3.0)
        torch.manual_seed(1)
        np.random.seed(1)  # noqa: NPY002 - what the memory draws by
        train(model, 10, 32)
        return {name: value.clone() for name, value in model.policy.state_dict().items()} | {
            "weight": model.log_ent_coef.detach().clone()
        }

    before = copy.deepcopy(model.get_parameters())
    ours, theirs = updated(SoftActorCritic.train), updated(SAC.train)
    unchanged = before["policy"]
    assert all(torch.allclose(ours[name], theirs[name], atol=2e-6) for name in theirs)
    assert max(float((theirs[name] - unchanged[name]).abs().max()) for name in unchanged) > 5e-4


def test_torch_does_not_load_its_compiler_to_learn(tmp_path):
    """It would take 2 s of each training."""
    program = f"""
import sys
from pathlib import Path
from test_soft_actor_critic import trained
trained(Path({str(tmp_path / "home")!r}))
assert not [name for name in sys.modules if name.startswith("torch._dynamo")]
"""
    python_path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    subprocess.run([sys.executable, "-c", program], check=True, env={**os.environ, "PYTHONPATH": python_path})


def test_adam_is_that_of_torch_and_goes_on_where_it_stopped():
    rng = torch.Generator().manual_seed(0)
    start = [torch.randn(3, 2, generator=rng), torch.randn(2, generator=rng), torch.ones(1)]
    ours, theirs = ([each.clone().requires_grad_() for each in start] for _ in range(2))
    optimizers = FusedAdam(ours, 1e-2), torch.optim.Adam(theirs, 1e-2)
    fresh = FusedAdam(ours, 1.0)
    fresh.load_state_dict(torch.optim.Adam(theirs, 1e-2).state_dict())
    assert fresh.param_groups[0]["lr"] == 1e-2
    for step in range(6):
        if step == 3:
            resumed = FusedAdam(ours, 1.0)
            resumed.load_state_dict(copy.deepcopy(optimizers[0].state_dict()))
            optimizers = resumed, optimizers[1]
        if step == 4:
            resumed.load_state_dict(copy.deepcopy(optimizers[1].state_dict()))
        for optimizer, parameters in zip(optimizers, (ours, theirs), strict=True):
            optimizer.zero_grad()
            sum(((each - step) ** 2).sum() for each in parameters[:2]).backward()
            optimizer.step()
    assert all(torch.allclose(mine, torchs, atol=1e-6) for mine, torchs in zip(ours, theirs, strict=True))
    assert not torch.allclose(ours[0], start[0], atol=1e-2)


def test_memory_that_is_full_begins_again_with_its_oldest(tmp_path, monkeypatch):
    monkeypatch.setattr(import_module("aidsr.learn.rl.soft_actor_critic"), "_MOST_TRANSITIONS", 10 * SMALL.simulations)
    with pytest.raises(KeyboardInterrupt):
        trained(tmp_path, listen=at(STEPS // 2, KeyboardInterrupt))
    saved = tmp_path / "checkpoint" / "memory"
    position = int(np.load(saved / "position.npy"))
    assert len(np.load(saved / "rewards.npy")) == 10 != position
    assert trained(tmp_path).stopped == "budget"


def test_the_first_simulations_act_without_noise(tmp_path, monkeypatch):
    """Once the random actions are over, and only they tell how far the policy has come."""
    acted, sample = [], SoftActorCritic._sample_action

    def noted(model, learning_starts, *rest):
        action, stored = sample(model, learning_starts, *rest)
        assert np.array_equal(action, stored)
        best, _ = model.predict(model._last_obs, deterministic=True)
        acted.append((model.num_timesteps >= learning_starts, np.isclose(action, best, atol=1e-5).all(axis=1)))
        return action, stored

    monkeypatch.setattr(SoftActorCritic, "_sample_action", noted)
    trained(tmp_path)
    begun = np.array([same for learned, same in acted if not learned])
    then = np.array([same for learned, same in acted if learned])
    assert not begun.any()
    assert then[:, : SMALL.noiseless_simulations].all()
    assert not then[:, SMALL.noiseless_simulations :].all(axis=0).any()


def test_a_test_for_saturation_is_paid_from_the_budget(tmp_path):
    result = trained(tmp_path, WonTogether, steps=6_000)
    tested = [event for event in events(tmp_path) if event["kind"] == "tested"]
    tests = [event for event in tested if event["steps"] < result.steps]
    assert {event["success_share"] for event in tested} == {0.0}
    assert 2 <= len(tests) <= 4, "learning takes four times as many steps as they do"
    assert len(tested) - len(tests) == 2, "at the end, of the last policy and of the best"
    assert (result.stopped, result.success_share) == ("budget", 0.0)
    # each step of the eight simulations ends an episode; a test plays twenty of 24 steps, those at the end are not paid
    played = (result.episodes - 20) * SMALL.hold_steps
    assert result.steps - played > 0.8 * len(tests) * 20 * 24


def winning(count, episodes):
    """Return the counting of a training in which only so many episodes without noise succeed."""

    def counted(history, info, *, measures=True):
        count(history, {**info, "is_success": measures and history.won < episodes}, measures=measures)

    return counted


@pytest.mark.parametrize(
    ("asked", "least", "stops"), [(True, STEPS, True), (False, 0, False), (True, STEPS + 1, False)]
)
def test_a_hopeless_training_ends_where_that_is_asked_for(tmp_path, monkeypatch, asked, least, stops):
    """Unless its budget is too small to tell."""
    monkeypatch.setattr(recipe, "LEAST_TELLING", least)
    monkeypatch.setattr(History, "count", winning(History.count, 0))
    result = trained(tmp_path, recipe=SMALL.model_copy(update={"stop_hopeless": asked}))
    assert result.stopped == ("hopeless" if stops else "budget")
    assert (result.steps < 0.8 * STEPS) is stops
    assert result.steps >= 0.7 * STEPS


def test_a_training_that_has_won_is_not_hopeless(tmp_path, monkeypatch):
    monkeypatch.setattr(recipe, "LEAST_TELLING", 0)
    monkeypatch.setattr(History, "count", winning(History.count, 1))
    assert trained(tmp_path, recipe=SMALL.model_copy(update={"stop_hopeless": True})).stopped == "budget"


def test_a_saturated_training_ends_before_its_budget(tmp_path):
    @dataclass(frozen=True)
    class Given(TwoSided):
        def is_success(self, readings, state):
            return readings.time_s > 0.0

    result = trained(tmp_path, Given, steps=20_000)
    assert (result.stopped, result.success_share >= 0.9) == ("saturated", True)
    assert result.steps < 5_000


class Told:
    """Lets the policies that seemed best win a share of their tests, and any others another share."""

    def __init__(self, monkeypatch, best: float, others: float) -> None:
        self.kept: list[str] = []
        self._keep, self._test = training._Training._keep_best, training._Training._test
        self._shares = {True: best, False: others}
        monkeypatch.setattr(training._Training, "_keep_best", lambda learning: self.keep(learning))
        monkeypatch.setattr(training._Training, "_test", lambda *asked: self.tested(*asked))

    def _fingerprint(self, learning) -> str:
        return TrainedPolicy.of(learning.model.policy, Normalisation.of(learning.normalised)).fingerprint

    def keep(self, learning) -> None:
        self._keep(learning)
        self.kept.append(self._fingerprint(learning))

    def tested(self, learning, variations):
        course, share = self._test(learning, variations), self._shares[self._fingerprint(learning) in self.kept]
        return replace(course, success=np.arange(course.success.size) < share * course.success.size)


@pytest.mark.parametrize("killed", [False, True])
def test_the_policy_that_seemed_best_is_kept_if_it_wins_more_fresh_episodes(tmp_path, monkeypatch, killed):
    """Also after a kill: it is part of a checkpoint."""
    told = Told(monkeypatch, best=0.75, others=0.25)
    WonAtFirst.played = 0
    if killed:
        with pytest.raises(KeyboardInterrupt):
            trained(tmp_path, WonAtFirst, steps=6_000, listen=at(4_500, KeyboardInterrupt))
    assert trained(tmp_path, WonAtFirst, steps=6_000).success_share == 0.75
    restored = next(event for event in events(tmp_path) if event["kind"] == "restored")
    assert (restored["success_share"], restored["best"]) == (0.25, 0.75)
    assert policy_of(tmp_path).fingerprint == told.kept[-1]


@pytest.mark.parametrize("others", [0.25, 0.5])
def test_the_last_policy_is_kept_if_none_wins_more(tmp_path, monkeypatch, others):
    told = Told(monkeypatch, best=0.25, others=others)
    WonAtFirst.played = 0
    assert trained(tmp_path, WonAtFirst, steps=6_000).success_share == others
    assert "restored" not in [event["kind"] for event in events(tmp_path)]
    assert policy_of(tmp_path).fingerprint not in told.kept


def test_wall_time_ends_a_training(tmp_path):
    result = trained(tmp_path, NeverWon, steps=20_000, minutes=0.0001)
    assert result.stopped == "time"
    assert 0 < result.steps < 2_000


def test_a_policy_is_judged_with_actions_held_as_it_learned_them(tmp_path):
    train(small_learning("button_pushing"), tmp_path, steps=300, recipe=SMALL, threads=1)
    found = FinishedTraining.load(tmp_path)
    assert found.scene.actions.hold_steps == found.scene_at("hard").actions.hold_steps == 3
    assert len(evaluate_training(tmp_path, episodes=20, threads=1, videos=False).episodes) == 20


BENDS = "pull_left: t=0 -1, t=0.2 1"
"""A script by which the arm bends to one side."""


def beginning_with(script, **changes):
    return SMALL.model_copy(update={"script": script, **changes})


def test_a_script_that_wins_nearly_always_is_the_policy(tmp_path):
    recipe = beginning_with(BENDS)
    result = trained(tmp_path, QuickPushing, recipe=recipe)
    assert (result.stopped, result.success_share, result.episodes) == ("saturated", 1.0, 20)
    assert 0 < result.steps < 20 * 25
    assert [event["kind"] for event in events(tmp_path)] == ["started", "tested", "checkpoint", "finished"]
    assert len((tmp_path / "curve.csv").read_text().splitlines()) == 2
    plain = small_learning(QuickPushing())
    scene, policy = recipe.acting_in(plain), policy_of(tmp_path)

    def play(scene, policy):
        variations = [scene.task.variation("held_out", 0)]
        return rollout(Episodes(scene.model, scene.task, scene.actions, variations), policy)

    assert play(scene, policy).success[0]
    assert play(scene, policy).reward == play(scene, Always(0.0, 0.0)).reward, "it corrects nothing"
    assert not play(plain.with_hold(3), policy).success[0]
    found = FinishedTraining.load(tmp_path)
    assert found.scene.actions.base
    assert found.scene_at("hard").actions.base


BOTH_SIDES = f"when f1 > 0:\n{BENDS}\notherwise:\n{BENDS.replace('left', 'right')}"
"""A script by which the arm bends to the side that it observes."""


def test_a_script_with_blocks_wins_where_one_motion_cannot(tmp_path):
    result = trained(tmp_path, recipe=beginning_with(BOTH_SIDES))
    assert (result.stopped, result.success_share) == ("saturated", 1.0)


def test_a_policy_that_corrects_a_script_with_blocks_is_learned_and_judged(tmp_path):
    script = BOTH_SIDES.replace("f1 > 0:", "f1 > 0 for 0.2 s:")
    for name in ("one", "other"):
        assert trained(tmp_path / name, NeverWon, recipe=beginning_with(script)).stopped == "budget"
    one, other = (FinishedTraining.load(tmp_path / name) for name in ("one", "other"))
    assert one.policy.fingerprint == other.policy.fingerprint, "episodes that are reset at different times"
    scene = beginning_with(script).acting_in(small_learning(TwoSided()))
    verdict, rolled = evaluate(scene, one.policy, episodes=20, threads=1)
    again, _ = evaluate(scene, one.policy, episodes=20, threads=1)
    assert verdict.episodes == again.episodes
    sides = np.array([variation.parameters["side"][0] for variation in rolled.variations])
    assert np.all(np.sign(rolled.mean_actions[:, 0] - rolled.mean_actions[:, 1]) == sides)


def test_a_script_that_does_not_win_is_learned_from(tmp_path):
    """It wins on one side; where it may be changed to anything, the other is learned."""
    recipe = PROTOCOLS["best"].beginning_with(BENDS).model_copy(update={"correction": 2.0})
    result = trained(tmp_path, recipe=recipe, steps=30_000)
    first = next(event for event in events(tmp_path) if event["kind"] == "tested")
    assert 0.2 < first["success_share"] < 0.8
    assert result.success_share >= 0.9


def test_what_is_learned_from_a_script_goes_on_after_a_kill(tmp_path):
    recipe = beginning_with(BENDS)
    with pytest.raises(KeyboardInterrupt):
        trained(tmp_path, NeverWon, recipe=recipe, listen=at(900, KeyboardInterrupt))
    assert trained(tmp_path, NeverWon, recipe=recipe).stopped == "budget"
    assert [event["kind"] for event in events(tmp_path)].count("tested") == 1


def test_where_learning_makes_a_script_worse_it_is_kept(tmp_path, monkeypatch):
    told = Told(monkeypatch, best=0.9, others=0.5)
    result = trained(tmp_path, NeverWon, recipe=beginning_with(BENDS), steps=3_000)
    assert result.success_share == 0.9
    assert policy_of(tmp_path).fingerprint in told.kept


def test_a_script_for_another_scene_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(UserError, match='no group "wheel" in this scene'):
        trained(tmp_path / "training", recipe=beginning_with("wheel: 1"))
    assert not (tmp_path / "training").exists()
    with pytest.raises(ValueError, match="a policy of PPO corrects no script"):
        Recipe(script=BENDS)


def test_a_protocol_is_a_recipe_and_options_are_added_to_it():
    assert recipe_of("paper") == PROTOCOLS["paper"] == Recipe()
    assert recipe_of("best", smoothing=0.7) == PROTOCOLS["best"].model_copy(update={"smoothing": 0.7})
    with pytest.raises(UserError, match="stop_hopeless needs protocol"):
        recipe_of("paper", stop_hopeless=True)
    with pytest.raises(UserError, match="from_probe needs protocol"):
        recipe_of("best", from_probe=True)
    with pytest.raises(UserError, match="begins with a script needs protocol"):
        recipe_of("paper", script=BENDS)
    with pytest.raises(UserError, match='no protocol "fast"'):
        recipe_of("fast")


def test_a_recipe_of_before_is_read_where_no_motion_was_searched():
    plain = json.loads(Recipe().model_dump_json()) | {"search_share": 0.0, "correction_noise_std": 0.3}
    assert Recipe.model_validate(plain) == Recipe()
    with pytest.raises(ValueError, match="search_share"):
        Recipe.model_validate(plain | {"search_share": 0.7})


def test_a_recipe_that_explores_nowhere_is_refused():
    with pytest.raises(ValueError, match="no simulation is left to explore in"):
        Recipe(algorithm="sac", simulations=8)


def test_a_policy_without_its_critics_is_the_same_policy(tmp_path):
    trained(tmp_path)
    whole = policy_of(tmp_path)
    with zipfile.ZipFile(tmp_path / "policy.zip") as archive:
        weights = archive.read("policy.pth")
    small = without_critics(weights)
    with zipfile.ZipFile(tmp_path / "policy.zip", "w") as archive:
        archive.writestr("policy.pth", small)
    again = policy_of(tmp_path)
    assert again.fingerprint == whole.fingerprint
    seen = np.linspace(-1.0, 1.0, whole.normalisation.mean.size)
    assert np.array_equal(again.act(seen), whole.act(seen))
    assert len(small) < len(weights) / 3
