"""Training: the same seed gives the same policy, is taken up where it stopped, and ends when success is saturated."""

import csv
import io
import json
import shutil
import subprocess
import sys
import zipfile
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

import torch

from aidsr.core.errors import UserError
from aidsr.learn.rl import training
from aidsr.learn.rl.exploration import Exploration
from aidsr.learn.rl.policy import Normalisation, TrainedPolicy
from aidsr.learn.rl.recipe import Recipe
from aidsr.learn.rl.trained import FinishedTraining
from aidsr.learn.rl.training import DEVELOPMENT, train
from aidsr.learn.rl.training_config import TrainingConfig
from aidsr.learn.rl.training_folder import FolderInUseError, TrainingFolder, TrainingResult, folder_for
from scenes import Breaking, QuickPushing, small_learning

SMALL = Recipe(simulations=8, rollout_steps=8, batch_size=32, epochs=2, hidden_sizes=(16, 16))
STEPS = 512


def trained(folder, *, task=None, steps=STEPS, seed=0, recipe=SMALL, threads=1, **options) -> TrainingResult:
    scene = small_learning(task)
    return train(scene, folder, steps=steps, seed=seed, recipe=recipe, threads=threads, **options)


def policy_of(folder) -> TrainedPolicy:
    return TrainedPolicy.load(folder, SMALL, 2)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished") / "001"
    trained(folder)
    return folder


class Given(QuickPushing):
    """Won by being there."""

    def is_success(self, readings, state):
        return readings.time_s > 0.0


class GivenTogether(Given):
    """Won by being there, as often as eight simulations run side by side; notes which variations are drawn."""

    drawn: ClassVar[list[tuple[str, int]]] = []

    def is_success(self, readings, state):
        return np.full(readings.n, readings.n == SMALL.simulations)

    def variation(self, split, index):
        self.drawn.append((split, index))
        return super().variation(split, index)


class NeverWon(QuickPushing):
    """Nothing succeeds."""

    def is_success(self, readings, state):
        return np.zeros(readings.n, dtype=bool)


class Killed(Exception):  # noqa: N818 - nothing went wrong
    """Ends a training as a kill does: nothing more is saved."""


def at(steps, ending):
    """Return a listener that ends a training with the first point of its curve from so many steps on."""

    def listen(point):
        if point.steps >= steps:
            raise ending

    return listen


def same_policy(one: TrainedPolicy, other: TrainedPolicy) -> bool:
    seen = np.random.default_rng(0).normal(size=(5, one.normalisation.mean.size))
    return np.array_equal(one.act(seen), other.act(seen))


def kept(folder) -> tuple[dict, dict]:
    """Return the parameters of a policy and the state of its optimizer."""
    with zipfile.ZipFile(folder / "policy.zip") as saved:
        parts = [saved.read(f"{name}.pth") for name in ("policy", "policy.optimizer")]
    return tuple(torch.load(io.BytesIO(part), weights_only=True) for part in parts)


def rows_of(folder) -> list[int]:
    return [int(row["steps"]) for row in csv.DictReader((folder / "curve.csv").read_text().splitlines())]


def events(folder) -> list[dict]:
    return [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]


def test_a_training_leaves_what_its_folder_promises(finished):
    promised = {line.split("|")[1].strip() for line in TrainingFolder.__doc__.splitlines() if line.count("|") == 3}
    made = {path.name for path in finished.iterdir()}
    assert made <= promised
    assert made >= {
        "config.json",
        "scene.xml",
        "events.jsonl",
        "curve.csv",
        "policy.zip",
        "normalisation.json",
        "training.json",
    }
    assert "checkpoint" not in made
    config = TrainingConfig.model_validate_json((finished / "config.json").read_text())
    assert (config.task, config.seed, config.recipe) == ("reaching/button_pushing", 0, SMALL)
    assert config.versions["mujoco"]
    assert [event["kind"] for event in events(finished)][0 :: len(events(finished)) - 1] == ["started", "finished"]


def test_the_curve_tells_how_it_went(finished):
    rows = list(csv.DictReader((finished / "curve.csv").read_text().splitlines()))
    steps = rows_of(finished)
    assert steps == sorted(set(steps))
    assert steps[-1] == STEPS
    result = TrainingResult.model_validate_json((finished / "training.json").read_text())
    assert int(rows[-1]["episodes"]) == result.episodes > 8
    assert result.stopped == "budget"
    assert result.diverged_episodes == 0


def test_the_same_seed_gives_the_same_policy_whatever_the_threads(finished, tmp_path):
    trained(tmp_path / "again", threads=3)
    trained(tmp_path / "other", seed=1)
    assert same_policy(policy_of(finished), policy_of(tmp_path / "again"))
    assert not same_policy(policy_of(finished), policy_of(tmp_path / "other"))


def test_a_finished_training_is_not_trained_again(finished):
    before = (finished / "policy.zip").read_bytes()
    heard = []
    assert trained(finished, listen=heard.append).steps == STEPS
    assert heard == []
    assert (finished / "policy.zip").read_bytes() == before


def test_another_training_in_the_same_folder_is_refused(finished):
    with pytest.raises(UserError, match="differs in seed"):
        trained(finished, seed=5)


def test_a_folder_is_trained_in_by_one_process_at_a_time(tmp_path):
    """Also while it goes on; a kill gives it back, as the operating system does with what a process has locked."""
    refused = []

    def second(point):
        with pytest.raises(
            FolderInUseError, match=r"another process trains, judges or films in .*; wait for it or end it"
        ):
            trained(tmp_path)
        refused.append(point.steps)
        if point.steps >= STEPS // 2:
            raise KeyboardInterrupt

    for _ in range(2):
        with pytest.raises(KeyboardInterrupt):
            trained(tmp_path, listen=second)
    assert len(refused) > 2
    kinds = [event["kind"] for event in events(tmp_path)]
    assert (kinds.count("started"), kinds.count("resumed")) == (1, 1)
    code = (
        "import os, sys, pathlib; from aidsr.learn.rl.training_folder import TrainingFolder;"
        "held = TrainingFolder(pathlib.Path(sys.argv[1])).locked(); held.__enter__(); os.kill(os.getpid(), 9)"
    )
    assert subprocess.run([sys.executable, "-c", code, tmp_path], check=False).returncode == -9
    assert trained(tmp_path).resumed == 2
    with TrainingFolder(tmp_path).locked():  # what is finished is told all the same
        assert trained(tmp_path).resumed == 2


def test_an_interrupted_training_goes_on_where_it_stopped(tmp_path):
    home, scene = tmp_path / "training", small_learning()
    asked = TrainingConfig.of(scene, steps=STEPS, seed=0, recipe=SMALL)
    folder = folder_for(home, asked)
    assert folder == home / "001"
    with pytest.raises(KeyboardInterrupt):
        trained(folder, listen=at(STEPS // 2, KeyboardInterrupt))
    assert (folder / "checkpoint" / "policy.zip").exists()
    assert folder_for(home, asked) == folder
    assert folder_for(home, asked.model_copy(update={"seed": 1})) == home / "002"
    heard = []
    result = trained(folder, listen=heard.append)
    assert result.steps == STEPS
    assert heard[0].steps > STEPS // 2
    assert heard[0].episodes > 0
    kinds = [event["kind"] for event in events(folder)]
    assert kinds[0] == "started"
    assert "resumed" in kinds
    assert folder_for(home, asked) == folder
    assert folder_for(home, asked, again=True) == home / "002"


def test_a_training_of_an_earlier_version_is_none_of_the_same(finished, tmp_path):
    asked = json.loads((finished / "config.json").read_text())
    del asked["groups_from"]
    TrainingFolder(tmp_path / "001").write_json("config.json", asked)
    todays = TrainingConfig.of(small_learning(), steps=STEPS, seed=0, recipe=SMALL)
    assert folder_for(tmp_path, todays) == tmp_path / "002"
    for going_on in (lambda: trained(tmp_path / "001"), lambda: FinishedTraining.load(tmp_path / "001")):
        with pytest.raises(
            UserError, match=r"config\.json .* \(groups_from: Field required\); remove .* or train again"
        ):
            going_on()
    shutil.copytree(finished, tmp_path / "003")
    (tmp_path / "003" / "training.json").write_text("{")
    with pytest.raises(UserError, match=r"training\.json .* \(the whole file: Invalid JSON"):
        FinishedTraining.load(tmp_path / "003")


def test_what_was_learned_before_an_interruption_is_kept(tmp_path):
    """The policy, its optimizer's steps and the statistics of what it saw go on; they do not begin anew."""
    with pytest.raises(KeyboardInterrupt):
        trained(tmp_path / "one", listen=at(STEPS // 2, KeyboardInterrupt))
    half = Normalisation.from_json((tmp_path / "one" / "checkpoint" / "normalisation.json").read_text())
    trained(tmp_path / "one")
    whole = policy_of(tmp_path / "one").normalisation
    assert half.count > STEPS // 2
    assert whole.count > half.count + STEPS // 4
    assert Normalisation.from_json(whole.to_json()).count == whole.count


def test_a_training_goes_on_with_the_very_policy_it_stopped_with(tmp_path, monkeypatch):
    with pytest.raises(KeyboardInterrupt):
        trained(tmp_path, listen=at(STEPS // 2, KeyboardInterrupt))
    policy, optimizer = kept(tmp_path / "checkpoint")
    monkeypatch.setattr("stable_baselines3.PPO.learn", lambda model, *_, **__: model)
    trained(tmp_path)
    policy_now, optimizer_now = kept(tmp_path)
    torch.testing.assert_close(policy_now, policy, rtol=0.0, atol=0.0)
    assert optimizer["state"]
    torch.testing.assert_close(optimizer_now["state"], optimizer["state"], rtol=0.0, atol=0.0)
    assert optimizer["param_groups"][0]["lr"] == pytest.approx(SMALL.learning_rate_when(0.5))


@pytest.mark.parametrize(("killed_at", "resumed"), [(128, 0), (512, 1)])  # before and after the first checkpoint
def test_the_curve_of_a_killed_training_does_not_run_backwards(tmp_path, killed_at, resumed):
    """Rows are written more often than checkpoints, so a kill leaves some that come again."""
    with pytest.raises(Killed):
        trained(tmp_path, steps=6_400, listen=at(killed_at, Killed))
    assert rows_of(tmp_path)[-1] == killed_at
    with (tmp_path / "curve.csv").open("a") as file:
        file.write("13")  # and perhaps the beginning of one
    with pytest.raises(Killed):
        trained(tmp_path, steps=6_400, listen=at(704, Killed))
    assert rows_of(tmp_path) == list(range(64, 705, 64))
    history = json.loads((tmp_path / "checkpoint" / "history.json").read_text())
    assert (history["steps"], history["resumed"]) == (640, resumed)


def test_a_training_says_how_often_it_was_taken_up_again(finished, tmp_path):
    assert TrainingResult.model_validate_json((finished / "training.json").read_text()).resumed == 0
    for ending_at in (128, 256):
        with pytest.raises(KeyboardInterrupt):
            trained(tmp_path, listen=at(ending_at, KeyboardInterrupt))
    assert trained(tmp_path).resumed == 2
    before = json.loads((finished / "training.json").read_text())
    del before["resumed"]
    assert TrainingResult.model_validate(before).resumed == 0


def test_a_kill_while_a_checkpoint_is_replaced_costs_no_checkpoint(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        trained(tmp_path, listen=at(STEPS // 2, KeyboardInterrupt))
    (tmp_path / "checkpoint").rename(tmp_path / ".checkpoint.old")
    heard = []
    trained(tmp_path, listen=heard.append)
    assert heard[0].steps > STEPS // 2
    assert not (tmp_path / ".checkpoint.old").exists()


def test_training_ends_when_success_is_saturated(tmp_path):
    result = trained(tmp_path / "001", task=Given(), steps=20_000)
    assert result.stopped == "saturated"
    assert result.steps < 5_000
    assert result.success_share > 0.9
    assert events(tmp_path / "001")[-1]["kind"] == "finished"


def test_success_that_comes_only_while_learning_ends_no_training(tmp_path):
    """The policy is tested anew, without noise and at variations that are not those of a verdict."""
    GivenTogether.drawn.clear()
    result = trained(tmp_path, task=GivenTogether(), steps=1024)
    assert (result.stopped, result.success_share) == ("budget", 1.0)
    tested = [event["success_share"] for event in events(tmp_path) if event["kind"] == "tested"]
    assert set(tested) == {0.0}
    splits, indices = zip(*GivenTogether.drawn, strict=True)
    assert set(splits) == {"development"}
    assert 0 <= min(indices) <= max(indices) < DEVELOPMENT
    assert len(set(indices)) > 100


def test_first_episodes_end_at_different_times_and_patience_ends_what_gains_nothing(tmp_path):
    assert trained(tmp_path / "first", task=NeverWon(), steps=128).episodes >= 4  # of 25 steps, after 16
    hasty = SMALL.model_copy(update={"patience_s": 0.1})
    patient, cut = (trained(tmp_path / str(of.patience_s), task=NeverWon(), recipe=of) for of in (SMALL, hasty))
    assert cut.episodes > patient.episodes


def test_episodes_in_which_the_simulation_breaks_down_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(training, "Episodes", Breaking)
    assert trained(tmp_path).diverged_episodes == 1


def test_the_policy_that_is_kept_is_the_one_that_was_tested(tmp_path):
    ended, stopped = tmp_path / "ended", tmp_path / "stopped"
    result = trained(ended, task=Given(), steps=6_400)
    tests = [event for event in events(ended) if event["kind"] == "tested"]
    assert [event["steps"] for event in tests] == [result.steps]
    assert rows_of(ended)[-1] == result.steps
    with pytest.raises(KeyboardInterrupt):
        trained(stopped, task=Given(), steps=6_400, listen=at(result.steps, KeyboardInterrupt))
    assert same_policy(policy_of(ended), policy_of(stopped / "checkpoint"))
    assert policy_of(ended).normalisation.count == policy_of(stopped / "checkpoint").normalisation.count


def test_a_checkpoint_has_learned_from_all_steps_that_it_counts(tmp_path):
    even = SMALL.model_copy(update={"final_learning_rate": SMALL.learning_rate, "settling": 0.0})
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    trained(whole, steps=256, recipe=even)
    with pytest.raises(Killed):
        trained(killed, steps=1280, recipe=even, listen=at(320, Killed))
    assert json.loads((killed / "checkpoint" / "history.json").read_text())["steps"] == 256
    assert same_policy(policy_of(whole), policy_of(killed / "checkpoint"))


@pytest.mark.parametrize(("left", "rate"), [(1.0, 1e-3), (0.5, 5.5e-4), (0.0, 1e-4), (-0.7, 1e-4)])
def test_the_learning_rate_falls_to_a_tenth_and_no_further(left, rate):
    """A budget ends within a rollout, and the last update comes after it."""
    assert Recipe().learning_rate_when(left) == pytest.approx(rate)


@pytest.mark.parametrize(
    ("steps_done", "bonus", "largest"),
    [(0, 0.01, 9.0), (700, 0.01, 9.0), (850, 0.0, np.sqrt(3.0 * 0.2)), (1000, 0.0, 0.2)],
)
def test_a_policy_explores_freely_and_settles_at_the_end(steps_done, bonus, largest):
    exploration = Exploration(Recipe(settling=0.3, settling_noise_std=3.0, final_noise_std=0.2, entropy_bonus=0.01))
    log_std = torch.log(torch.tensor([9.0, 0.1]))
    exploration.model = SimpleNamespace(ent_coef=None, policy=SimpleNamespace(log_std=log_std))
    exploration.num_timesteps, exploration.locals = steps_done, {"total_timesteps": 1000}
    exploration.on_rollout_start()
    assert exploration.model.ent_coef == bonus
    assert log_std.exp().numpy() == pytest.approx([largest, 0.1], rel=1e-5)


def test_noise_is_taken_from_a_policy_that_is_trained(tmp_path):
    eager = {"learning_rate": 0.02, "final_learning_rate": 0.02, "entropy_bonus": 1.0}
    for settling, settled in ((0.5, True), (0.0, False)):
        recipe = SMALL.model_copy(update=eager | {"settling": settling})
        trained(tmp_path / str(settling), steps=1024, recipe=recipe)
        policy = TrainedPolicy.load(tmp_path / str(settling), recipe, 2)
        std = np.exp(policy.network.log_std.detach().numpy())
        # the last rollout begins a sixteenth of the budget before its end, and one update follows it
        assert bool((std < 0.4).all()) is settled
        assert bool((std > 0.8).all()) is not settled


def test_learning_gets_better(tmp_path):
    points = []
    recipe = Recipe(simulations=32, epochs=5)
    trained(tmp_path / "001", steps=6_000, recipe=recipe, listen=points.append)
    first = next(point for point in points if point.episodes >= 64)
    assert points[-1].success_share > first.success_share + 0.2 or points[-1].success_share > 0.9


def test_only_numbers_are_read_from_a_policy_file(finished, tmp_path):
    """What such a file may hold beside them would be run as Python by others who load it."""
    (tmp_path / "normalisation.json").write_bytes((finished / "normalisation.json").read_bytes())
    with zipfile.ZipFile(finished / "policy.zip") as old, zipfile.ZipFile(tmp_path / "policy.zip", "w") as new:
        new.writestr("data", b"no pickle at all")
        new.writestr("policy.pth", old.read("policy.pth"))
    seen = np.ones((1, policy_of(finished).normalisation.mean.size))
    assert np.array_equal(policy_of(tmp_path).act(seen), policy_of(finished).act(seen))


def test_a_policy_that_learns_no_more_has_no_optimizer(finished):
    """For which torch would load its compiler, each time a policy is judged, replayed or exported."""
    assert not isinstance(policy_of(finished).network.optimizer, torch.optim.Optimizer)


def test_the_policy_of_another_robot_is_refused(finished, tmp_path):
    with pytest.raises(UserError, match="other actuators"):
        TrainedPolicy.load(finished, SMALL, 3)
    with pytest.raises(UserError, match="no trained policy in"):
        TrainedPolicy.load(tmp_path, SMALL, 2)
