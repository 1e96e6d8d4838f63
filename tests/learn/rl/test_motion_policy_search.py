"""A motion with feedback: what it does, how it is kept, and that the search finds one where no open loop can win."""

import json
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

from aidsr.core.errors import UserError
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.openloop.motion import GroupMotion, Motion
from aidsr.learn.rl import motion_policy_search
from aidsr.learn.rl.feedback_motion import BASE_MOTION, FeedbackMotion, FeedbackMotions
from aidsr.learn.rl.motion_policy_search import IdlePolicy, least_steps, search_motion_policy
from aidsr.learn.rl.policy import TrainedPolicy, read_base_motion
from aidsr.learn.rl.recipe import PROTOCOLS, Recipe, recipe_of
from aidsr.learn.rl.trained import FinishedTraining, evaluate_training
from aidsr.learn.rl.training import train
from aidsr.tasks import Feature, Variation
from scenes import QuickPushing, small_learning

STEPS = 9_000
SMALL = Recipe(simulations=8, rollout_steps=8, batch_size=32, epochs=2, hidden_sizes=(16, 16), search_share=0.7)


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
class NearlyWon(NeverWon):
    """But all that happens looks good."""

    def progress(self, readings, state):
        return 0.6 + 0.3 * super().progress(readings, state)


@dataclass(frozen=True)
class OneSided(TwoSided):
    """Only one of the two sides can be won."""

    def is_success(self, readings, state):
        return super().is_success(readings, state) & (readings.parameters["side"][:, 0] > 0)


def motion(*groups: GroupMotion) -> Motion:
    return Motion(begin_s=0.1, ramp_s=0.2, frequency_hz=1.0, groups=groups)


STEADY = FeedbackMotion(
    motion=motion(GroupMotion(group="a", first=0.5, last=0.5), GroupMotion(group="b", first=-0.5, last=0.0)),
    gains=((0.1, 0.0), (0.0, -3.0)),
    mean=(1.0, 0.0),
    std=(2.0, 0.5),
)


def searched(task=TwoSided, seed=0, threads=1, **options):
    scene, drawn = small_learning(task()), iter(range(10**6))
    return search_motion_policy(
        scene,
        lambda: scene.task.variation("development", next(drawn)),
        steps=STEPS,
        saturation=0.95,
        rng=np.random.default_rng(seed),
        threads=threads,
        **options,
    )


def events(folder) -> list[dict]:
    return [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]


def wins(scene, policy) -> float:
    variations = [scene.task.variation("held_out", index) for index in range(20)]
    return float(
        rollout(Episodes(scene.model, scene.task, scene.actions, variations, threads=1), policy).success.mean()
    )


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("best") / "001"
    train(small_learning(TwoSided()), folder, steps=STEPS, recipe=SMALL, threads=1)
    return folder


def test_a_motion_with_feedback_follows_the_features_it_knows():
    one = FeedbackMotions.of(STEADY)
    seen = np.array([[9.0, 1.0, 0.0], [9.0, 5.0, 0.1], [9.0, 1.0, 10.0]])
    action = one.act(seen, np.array([0.0, 0.0, 1.0]))
    assert np.allclose(action, [[0.5, -0.5], [0.7, -1.0], [0.5, -1.0]])
    assert np.allclose(one.repeated(3).act(seen, np.array([0.0, 0.0, 1.0])), action)
    again = FeedbackMotions.of(one.one(0, ["a", "b"]))
    assert np.allclose(again.act(seen, np.array([0.0, 0.0, 1.0])), action)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"gains": ((0.1, 0.0),)}, "fit neither"),
        ({"mean": (1.0,)}, "fit neither"),
        ({"std": (2.0, 0.0)}, "greater than 0"),
    ],
)
def test_a_base_motion_that_does_not_fit_is_refused(tmp_path, change, message):
    plain = STEADY.model_dump(mode="json") | change
    (tmp_path / BASE_MOTION).write_text(json.dumps(plain))
    with pytest.raises(ValueError, match=message):
        FeedbackMotion.model_validate(plain)
    with pytest.raises(UserError, match="holds no motion"):
        read_base_motion(tmp_path, 2)


def test_a_base_motion_of_another_robot_is_refused(tmp_path):
    (tmp_path / BASE_MOTION).write_text(STEADY.model_dump_json())
    assert read_base_motion(tmp_path, 2) == STEADY
    with pytest.raises(UserError, match="moves 2 groups of actuators, not 3"):
        read_base_motion(tmp_path, 3)


def test_an_action_is_added_to_the_base_motion():
    scene = small_learning(TwoSided())
    base = FeedbackMotions.of(STEADY.model_copy(update={"gains": ((0.5,), (0.0,)), "mean": (0.0,), "std": (1.0,)}))
    moved = scene.with_base(base)
    seen, time_s = np.array([[7.0, 1.0], [7.0, -1.0]]), np.zeros(2)
    assert np.allclose(moved.actions.total(np.array([[0.25, 0.0]] * 2), seen, time_s), [[1.0, -0.5], [0.25, -0.5]])
    assert np.allclose(scene.actions.total(np.array([[0.25, 2.0]] * 2), seen, time_s), [[0.25, 1.0]] * 2)


def test_the_search_finds_feedback_where_no_single_motion_can_win():
    heard = []
    found = searched(listen=lambda state: heard.append(state) or True)
    assert found.success >= 0.95
    assert np.abs(found.motion.gains).max() > 0.1
    assert heard[0].success < 0.95  # random motions alone see nothing
    assert [state.steps for state in heard] == sorted(state.steps for state in heard)
    scene = small_learning(TwoSided()).with_base(FeedbackMotions.of(found.motion))
    assert wins(scene, IdlePolicy(2)) >= 0.9


def test_a_search_depends_on_its_seed_and_not_on_threads():
    np.random.seed(1)  # noqa: NPY002 - what another library does must not matter
    one = searched()
    np.random.seed(2)  # noqa: NPY002
    assert searched(threads=2) == one
    assert searched(seed=1).motion != one.motion


def test_a_search_ends_when_it_is_told_to():
    assert searched(listen=lambda state: False).steps <= least_steps(small_learning(TwoSided())) + 8 * 25


def test_a_search_that_neither_wins_nor_comes_far_ends_with_random_motions():
    heard = []
    assert not searched(NeverWon, listen=lambda state: heard.append(state) or True).is_worth_correcting
    assert len(heard) == 1


def test_a_search_that_comes_far_and_does_not_win_has_a_part_of_its_budget():
    heard = []
    assert not searched(NearlyWon, listen=lambda state: heard.append(state) or True).is_worth_correcting
    assert len(heard) > 1
    assert [state.steps >= 0.4 * STEPS for state in heard] == [False] * (len(heard) - 1) + [True]


def test_a_training_ends_with_the_search_when_that_is_enough(trained):
    kinds = [event["kind"] for event in events(trained)]
    assert kinds == ["started", "searched", "checkpoint", "tested", "checkpoint", "finished"]
    policy = TrainedPolicy.load(trained, SMALL, 2)
    assert np.array_equal(policy.act(np.random.default_rng(0).normal(size=(3, 17))), np.zeros((3, 2)))
    assert policy.fingerprint != TrainedPolicy(policy.network, policy.normalisation).fingerprint
    scene = small_learning(TwoSided()).with_base(FeedbackMotions.of(policy.base))
    assert wins(scene, policy) >= 0.9
    curve = (trained / "curve.csv").read_text().splitlines()
    assert len(curve) >= 3
    assert curve[-1].split(",")[0] == str(json.loads((trained / "training.json").read_text())["steps"])


def test_a_finished_training_is_judged_with_its_base_motion(tmp_path):
    folder = tmp_path / "001"
    scene = small_learning("button_pushing")
    recipe = SMALL.model_copy(update={"search_share": 0.0})
    train(scene, folder, steps=64, recipe=recipe, threads=1)
    without = evaluate_training(folder, episodes=20, threads=1, videos=False)
    size = sum(feature.size for feature in scene.task.features)
    pulling = motion(*(GroupMotion(group=name, first=1.0, last=1.0) for name in "ab"))
    base = FeedbackMotion(motion=pulling, gains=((0.0,) * size,) * 2, mean=(0.0,) * size, std=(1.0,) * size)
    (folder / BASE_MOTION).write_text(base.model_dump_json())
    judged = evaluate_training(folder, episodes=20, threads=1, videos=False)
    assert judged.policy_sha256 != without.policy_sha256
    assert judged.episodes != without.episodes
    again = FinishedTraining.load(folder)
    assert again.scene.actions.base is not None
    assert again.scene_at("hard").actions.base is again.scene.actions.base


def test_what_a_search_leaves_open_is_learned_as_corrections(tmp_path):
    result = train(small_learning(OneSided()), tmp_path, steps=STEPS, recipe=SMALL, threads=1)
    kinds = [event["kind"] for event in events(tmp_path)]
    assert (kinds.count("searched"), kinds.count("compared"), result.stopped) == (1, 1, "budget")
    compared = next(event for event in events(tmp_path) if event["kind"] == "compared")
    assert 0 < compared["base_motion"] < 40
    assert STEPS <= result.steps < STEPS + 64


def test_a_motion_that_never_wins_is_not_corrected(tmp_path):
    result = train(small_learning(NeverWon()), tmp_path, steps=STEPS, recipe=SMALL, threads=1)
    searched_steps = next(event["steps"] for event in events(tmp_path) if event["kind"] == "searched")
    assert searched_steps < 0.7 * STEPS
    assert not (tmp_path / BASE_MOTION).exists()
    assert (result.stopped, "compared" in [event["kind"] for event in events(tmp_path)]) == ("budget", False)
    assert STEPS <= result.steps < STEPS + 64


def test_a_search_is_not_repeated_once_it_has_ended(tmp_path):
    class Killed(Exception):  # noqa: N818 - nothing went wrong
        pass

    def kill(point):
        if (tmp_path / "checkpoint").exists():
            raise Killed

    with pytest.raises(Killed):
        train(small_learning(OneSided()), tmp_path, steps=STEPS, recipe=SMALL, threads=1, listen=kill)
    before = (tmp_path / BASE_MOTION).read_text()
    result = train(small_learning(OneSided()), tmp_path, steps=STEPS, recipe=SMALL, threads=1)
    assert [event["kind"] for event in events(tmp_path)].count("searched") == 1
    assert (result.resumed, (tmp_path / BASE_MOTION).read_text()) == (1, before)


def test_a_budget_too_small_for_a_search_goes_to_learning(tmp_path):
    result = train(small_learning(TwoSided()), tmp_path, steps=512, recipe=SMALL, threads=1)
    assert result.steps == 512
    assert not (tmp_path / BASE_MOTION).exists()


@pytest.mark.parametrize("share", [0.0, 0.7])
def test_wall_time_ends_a_training(tmp_path, share):
    recipe = SMALL.model_copy(update={"search_share": share})
    scene = small_learning(NeverWon())
    result = train(scene, tmp_path, steps=STEPS, recipe=recipe, minutes=0.0001, threads=1)
    assert result.stopped == "time"
    assert 0 < result.steps < STEPS
    assert json.loads((tmp_path / "config.json").read_text())["minutes"] == 0.0001


def test_a_protocol_is_a_recipe_and_options_are_added_to_it():
    assert recipe_of("paper") == PROTOCOLS["paper"] == Recipe()
    assert recipe_of("best", smoothing=0.7) == PROTOCOLS["best"].model_copy(update={"smoothing": 0.7})
    with pytest.raises(UserError, match="from_probe is for protocol"):
        recipe_of("best", from_probe=True)
    with pytest.raises(UserError, match='no protocol "fast"'):
        recipe_of("fast")


def test_a_search_that_finds_nothing_better_leaves_the_rest_of_its_budget(monkeypatch):
    monkeypatch.setattr(motion_policy_search, "fitness_of", lambda outcomes: np.zeros(len(outcomes.time_s)))
    scene, heard, drawn = small_learning(OneSided()), [], iter(range(10**6))
    search_motion_policy(
        scene,
        lambda: scene.task.variation("development", next(drawn)),
        steps=10**9,
        saturation=0.95,
        rng=np.random.default_rng(0),
        threads=1,
        listen=lambda state: heard.append(state) or True,
    )
    assert len(heard) == 1 + 3 * 3
