"""A policy where the scene differs from its model: what is counted, kept and printed."""

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

from test_commands import run_main
from test_goal_training import GOAL, ROOM
from test_training import SMALL

from aidsr.core.artifacts import Evaluation, PerturbedEpisodes, Placement, Robot
from aidsr.core.errors import UserError
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.perturbation import KINDS, PerturbedVariation
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl import training
from aidsr.learn.rl.robustness import perturbed_episodes
from aidsr.learn.rl.trained import evaluate_training
from aidsr.learn.rl.training import train
from aidsr.learn.rl.training_config import TrainingConfig
from aidsr.learn.rl.training_folder import TrainingFolder
from aidsr.sim.assembly import assemble
from aidsr.tasks import goal_task, parse_goal
from scenes import Always, QuickPushing, small_arm, small_learning

BENDING = Always(-0.2, -1.0)


class HardToBend(QuickPushing):
    """Won by bending so far that cable friction decides."""

    time_limit_s, hold_s = 2.0, 0.8

    def is_success(self, readings, state):
        return np.abs(readings["tip_position"][:, 0]) > 0.077


def test_success_is_counted_for_each_kind_and_compared_with_that_without():
    scene = small_learning(HardToBend())
    variations = [scene.task.variation("held_out", index) for index in range(8)]
    outcomes = rollout(Episodes(scene.model, scene.task, scene.actions, variations, threads=1), BENDING)
    facts = {"task": scene.task.name, "level": "standard", "benchmark_version": 0, "checks": ()}
    verdict = Evaluation(episodes=tuple(outcomes.result(index, index) for index in range(8)), **facts)
    assert verdict.success_share == 1.0
    by_kind = {one.kind: one for one in perturbed_episodes(scene, BENDING, verdict, threads=1)}
    assert tuple(by_kind) == KINDS
    assert all((one.episodes, one.nominal_successes) == (8, 8) for one in by_kind.values())
    assert by_kind["delay"].kept_share == 1.0
    assert by_kind["high_cable_friction"].kept_share == 0.0
    assert set() < set(by_kind["stiffness"].succeeded) < set(range(8))
    assert by_kind["stiffness"].success_share == len(by_kind["stiffness"].succeeded) / 8


def test_nothing_can_be_kept_where_nothing_succeeds():
    facts = {"kind": "mass", "summary": "masses off", "episodes": 20, "succeeded": ()}
    assert PerturbedEpisodes(**facts, nominal_successes=0).kept_share is None
    assert PerturbedEpisodes(**facts, nominal_successes=10).kept_share == 0.0


def test_a_perturbed_evaluation_is_asked_for_printed_and_kept(tmp_path, capsys):
    folder = tmp_path / "001"
    scene = assemble(Robot(mjcf=small_arm(), functional_part="tip"), ROOM, Placement(mount="mount", base="fixed")).mjcf
    task = goal_task(parse_goal(GOAL), scene)
    train(TaskScene.of(scene, task), folder, steps=64, recipe=SMALL, threads=1)
    run_main("evaluate", folder, "--threads", "1", "--no-videos", "--episodes", "20", "--perturbed")
    printed = capsys.readouterr().out
    assert "masses of the robot off by up to 20%" in printed
    assert "cable friction 0.3" in printed
    kept = Evaluation.model_validate_json((folder / "evaluation.json").read_bytes())
    assert tuple(one.kind for one in kept.perturbed) == KINDS
    assert [one.episodes for one in kept.perturbed] == [20] * len(KINDS)
    # the same evaluation again, without the perturbations
    again = evaluate_training(folder, episodes=20, threads=1, videos=False)
    assert again.perturbed == kept.perturbed
    assert Evaluation.model_validate_json((folder / "evaluation.json").read_bytes()) == again
    # fewer episodes than those of the verdict that is there
    fuller = again.model_copy(update={"episodes": again.episodes * 2}).model_dump_json()
    (folder / "evaluation.json").write_text(fuller)
    with pytest.raises(UserError, match="has a verdict of 40 episodes, and 20 are fewer; ask for at least 40"):
        evaluate_training(folder, episodes=20, threads=1, videos=False)
    assert (folder / "evaluation.json").read_text() == fuller
    # a verdict of another policy is replaced
    (folder / "evaluation.json").write_text(fuller.replace(again.policy_sha256, "0" * 64))
    assert len(evaluate_training(folder, episodes=20, threads=1, videos=False).episodes) == 20


@pytest.mark.parametrize("randomize", [False, True])
def test_training_episodes_differ_from_the_model_only_where_asked(tmp_path, randomize):
    scene, recipe = small_learning(), SMALL.model_copy(update={"randomize": randomize})
    TrainingFolder(tmp_path).write("scene.xml", scene.mjcf)
    learning = training._Training(
        scene, TrainingFolder(tmp_path), TrainingConfig.of(scene, steps=64, seed=0, recipe=recipe), 1, False
    )
    episodes = learning.env.episodes
    stiffness = {episodes.batch.get_model(row).joint("robot/bend1").stiffness[0] for row in range(episodes.n)}
    assert len(stiffness) == (episodes.n if randomize else 1)
    assert all(isinstance(one, PerturbedVariation) == randomize for one in episodes.variations)
