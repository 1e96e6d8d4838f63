"""The verdict on a policy: held-out episodes, and whether to believe them."""

import copy
import inspect
import json
import re
import shutil
import zipfile
from dataclasses import replace
from functools import partial

import mujoco
import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

import torch
from test_training import SMALL

import aidsr
from aidsr.apps.cli.evaluate import evaluate as evaluate_command
from aidsr.core.artifacts import ActuatorGroup, Evaluation, MeanAction
from aidsr.core.config import VERDICT_EPISODES
from aidsr.core.ends import evaluation_in_words
from aidsr.core.errors import UserError
from aidsr.core.storage_errors import StorageError
from aidsr.learn.episodes import policy_checks
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.episode_stats import RECORDED, EpisodeStats, StatsRecorder
from aidsr.learn.episodes.plausibility import (
    behavior_checks,
    exploit_check,
    penetration_check,
    scope_check,
    structure_check,
    training_check,
)
from aidsr.learn.episodes.policy_checks import rollout_with_stats
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl import evaluation
from aidsr.learn.rl.pictures import curve_picture, varied_mjcf
from aidsr.learn.rl.trained import FinishedTraining, evaluate_training
from aidsr.learn.rl.training import train
from aidsr.learn.rl.training_folder import TrainingResult
from aidsr.runs.trainings import Training
from aidsr.sim.deactivate import without_cables
from aidsr.sim.structure import read_structure
from aidsr.tasks import BENCHMARK_VERSION, Change, Variation, apply_to_simulation, goal_task, load_task, parse_goal
from aidsr.tasks.grasping.dynamic_catching import BALL_KG
from scenes import Always, Breaking, QuickPushing, builtin_scene, small_learning, small_scene

evaluate = partial(evaluation.evaluate, episodes=20)
BENDING, STILL = Always(1.0, -1.0), Always(-1.0, -1.0)


class Restless:
    """Random actions, the same ones every time."""

    def __init__(self) -> None:
        self.rng = np.random.default_rng(4)

    def act(self, observation):
        return self.rng.uniform(-1.0, 1.0, (len(observation), 2))


def named(evaluation: Evaluation) -> dict[str, object]:
    return {check.name: check for check in evaluation.checks}


def behaviour(rolled, scene) -> dict[str, object]:
    return {check.name: check for check in behavior_checks(rolled.outcomes, rolled.stats, read_structure(scene.model))}


def test_a_policy_that_does_the_job_is_valid_and_successful():
    result = TrainingResult(steps=1, wall_s=1.0, episodes=200, diverged_episodes=2, success_share=1.0, stopped="budget")
    told = []
    evaluation, rolled = evaluate(small_learning(), BENDING, threads=1, training=result, listen=told.append)
    assert [point.ended for point in told] == sorted(point.ended for point in told)
    assert (told[-1].ended, told[-1].succeeded, told[-1].episodes) == (20, 20, 20)
    assert 0 < told[0].simulated_s < told[-1].simulated_s <= told[-1].time_limit_s
    assert [check.name for check in evaluation.checks if not check.passed] == []
    assert (evaluation.success_share, evaluation.valid, evaluation.successful) == (1.0, True, True)
    assert [episode.variation for episode in evaluation.episodes] == list(range(20))
    assert {episode.ended for episode in evaluation.episodes} == {"succeeded"}
    assert named(evaluation)["survives_half_time_step"].measured == 1.0
    assert named(evaluation)["survives_other_integrator"].measured == 1.0
    steps = round(evaluation.episodes[0].time_s / 0.04)
    assert rolled.stats.qpos[0].shape == (steps + 1, rolled.models[0].nq)
    assert Evaluation.model_validate_json(evaluation.model_dump_json()) == evaluation


def test_in_other_physics_lost_variations_are_played_again_too(monkeypatch):
    def unlucky(*args, **options):
        rolled = rollout_with_stats(*args, **options)
        rolled.outcomes.success[5:] = False
        return rolled

    monkeypatch.setattr(evaluation, "rollout_with_stats", unlucky)
    verdict, _ = evaluate(small_learning(), BENDING, threads=1)
    assert named(verdict)["survives_half_time_step"].measured == 20 / 5
    assert named(verdict)["survives_other_integrator"].measured == 20 / 5


def test_other_physics_is_half_the_time_step_and_another_integrator_with_all_else_the_same(monkeypatch):
    made = []

    class Noted(Episodes):
        def __init__(self, model, *args, **options):
            super().__init__(model, *args, **options)
            option, control_s = self.model.opt, self.physics_steps * self.model.opt.timestep
            if self.n == 20:
                made.append((option.timestep, option.integrator, round(control_s, 9), self.smoothing))

    scene, variants = small_learning(), {"DISCRETE": "IMPLICITFAST", "IMPLICITFAST": "DISCRETE"}
    monkeypatch.setattr(policy_checks, "Episodes", Noted)
    for own, other in variants.items():
        own, other = (int(getattr(mujoco.mjtIntegrator, f"mjINT_{name}")) for name in (own, other))
        scene.model.opt.integrator = own
        evaluate(scene, BENDING, threads=1, smoothing=0.25)
        step_s = scene.model.opt.timestep
        assert made[:3] == [(step_s, own, 0.04, 0.25), (step_s / 2, own, 0.04, 0.25), (step_s, other, 0.04, 0.25)]
        made.clear()


def test_where_one_integrator_denies_a_success_the_next_decides_and_both_are_told(monkeypatch):
    scene = small_learning()
    slack, same = without_cables(scene.model, read_structure(scene.model)), copy.copy(scene.model)
    monkeypatch.setattr(policy_checks, "with_other_integrators", lambda _model: {"one": slack, "two": same})
    verdict, _ = evaluate(scene, BENDING, threads=1)
    check = named(verdict)["survives_other_integrator"]
    assert (check.passed, check.measured) == (True, 1.0)
    assert check.message == (
        '20 episodes succeed with the integrator "two", 20 without that; 0 episodes succeed with the integrator "one", '
        "20 without that"
    )
    monkeypatch.setattr(policy_checks, "with_other_integrators", lambda _model: {"one": slack, "two": slack})
    verdict, _ = evaluate(scene, BENDING, threads=1)
    assert not named(verdict)["survives_other_integrator"].passed


def test_a_robot_that_stays_still_is_neither():
    evaluation, _ = evaluate(small_learning(), STILL, threads=1)
    assert [check.name for check in evaluation.checks if not check.passed] == ["moves"]
    assert (evaluation.success_share, evaluation.valid, evaluation.successful) == (0.0, False, False)
    assert {episode.ended for episode in evaluation.episodes} == {"out_of_time"}
    assert named(evaluation)["survives_half_time_step"].measured is None


def test_a_job_that_one_action_does_needs_no_policy():
    verdict, _ = evaluate(small_learning(), BENDING, threads=1)
    assert verdict.mean_action == MeanAction(action=(1.0, -1.0), succeeded=20, of=20)
    assert evaluation_in_words(verdict)[-1] == (
        "the constant mean action of the policy wins 20 of 20 episodes that the policy wins (no policy is needed)"
    )
    lost, _ = evaluate(small_learning(), STILL, threads=1)
    assert lost.mean_action is None
    assert not any("mean action" in line for line in evaluation_in_words(lost))


class Bracing:
    """Pulls on both cables, then lets go of one."""

    steps = 0

    def act(self, observation):
        self.steps += 1
        return np.tile([1.0, 1.0 if self.steps % 25 < 8 else -1.0], (len(observation), 1))


@pytest.mark.parametrize("corrects", [False, True])
def test_the_mean_action_is_of_all_that_was_done_in_episodes_that_were_won(corrects):
    class Base:
        def playback(self, n):
            return self

        def at(self, time_s, observation):
            return np.stack([np.ones_like(time_s), np.where(time_s < 0.3, 1.0, -1.0)], axis=-1)

    scene = small_learning()
    scene, policy = (scene.with_base(Base(), 0.3), Always(0.0, 0.0)) if corrects else (scene, Bracing())
    verdict, rolled = evaluate(scene, policy, threads=1)
    assert verdict.success_share == 1.0
    assert verdict.mean_action.action[0] == 1.0
    assert -0.6 < verdict.mean_action.action[1] < 0.6
    assert rolled.mean_actions.shape == (20, 2)
    found = rollout_with_stats(small_learning(), Always(*verdict.mean_action.action), range(20), threads=1)
    assert verdict.mean_action.succeeded == found.outcomes.success.sum()


def test_the_verdict_in_a_file_follows_from_its_evidence():
    evaluation, _ = evaluate(small_learning(), STILL, threads=1)
    written = json.loads(evaluation.model_dump_json())
    assert (written["success_share"], written["valid"], written["successful"]) == (0.0, False, False)
    assert Evaluation.model_validate(written | {"successful": True}) == evaluation
    assert not Evaluation.model_validate(written | {"successful": True}).successful


def test_fewer_than_twenty_episodes_are_no_evaluation():
    with pytest.raises(UserError, match="at least 20"):
        evaluate(small_learning(), STILL, episodes=5)


def test_held_out_variations_are_rolled():
    rolled = rollout_with_stats(small_learning(), STILL, range(3), threads=1)
    assert rolled.variations == tuple(QuickPushing().variation("held_out", index) for index in range(3))
    button = rolled.models[1].body("button").id
    assert rolled.models[1].body_pos[button] == pytest.approx(rolled.variations[1].changes[0].value)


# --- each check fails for what it is there for ---


def test_ordinary_motion_pays_for_its_energy_and_keeps_its_ranges():
    scene = small_learning()
    checks = behaviour(rollout_with_stats(scene, Restless(), range(4), threads=1), scene)
    assert all(check.passed for check in checks.values())
    assert checks["energy_paid_for"].measured < 0.2


def test_energy_from_nothing_is_noticed():
    pushing = TaskScene.of(small_scene(damping=-1e-4), QuickPushing())
    rolled = rollout_with_stats(pushing, Restless(), range(2), threads=1)
    assert not rolled.outcomes.diverged.any()
    checks = behaviour(rolled, pushing)
    assert not checks["energy_paid_for"].passed
    assert rolled.stats.energy_gain_j.max() > 0.0


class Carried:
    """Swings the stage that the environment lends, and leaves the robot at rest."""

    def __init__(self, scene: TaskScene) -> None:
        self.rest, self.steps = scene.actions.rest, 0
        self.stage = [k for k, group in enumerate(scene.actions.groups) if group.actuators[0].startswith("base")]

    def act(self, observation):
        self.steps += 1
        action = np.tile(self.rest, (len(observation), 1))
        action[:, self.stage] = np.sin(self.steps / 5.0)
        return action


def test_only_the_robots_own_work_allows_for_what_contacts_give_back():
    scene = TaskScene.of(small_scene("force_controlled_brushing"), "force_controlled_brushing")
    stats = rollout_with_stats(scene, Carried(scene), range(2), threads=1).stats
    column = scene.model.joint("base_x").qposadr[0]
    assert np.ptp(stats.qpos[0][:, column]) > 0.02
    assert stats.work_j == pytest.approx(0.0)


def test_a_body_held_up_by_compensation_gets_no_energy_from_it():
    around, name, robot = small_scene().partition('name="robot/base"')
    heavy = around + name + robot.replace('mass="0.01"', 'mass="0.1"')
    floating = heavy.replace('<body name="robot/seg', '<body gravcomp="1" name="robot/seg')
    assert floating.count('gravcomp="1" name="robot/seg') == 4
    scene = TaskScene.of(floating, QuickPushing())
    # what lifts the arm while it bends is a sixth of what is allowed
    assert behaviour(rollout_with_stats(scene, BENDING, range(2), threads=1), scene)["energy_paid_for"].measured < 0.01


def test_a_joint_pulled_far_beyond_its_range_is_noticed():
    scene = TaskScene.of(small_scene().replace('range="-0.698132 0.698132"', 'range="-0.01 0.01"'), QuickPushing())
    assert scene.model.jnt_range[scene.model.joint("robot/bend1").id, 1] == 0.01
    strong = TaskScene.of(small_scene(tension=800.0).replace("0.698132", "0.01"), QuickPushing())
    mild = behaviour(rollout_with_stats(scene, BENDING, range(2), threads=1), scene)["within_limits"]
    wild = behaviour(rollout_with_stats(strong, BENDING, range(2), threads=1), strong)["within_limits"]
    assert mild.passed
    assert wild.measured > mild.measured
    assert not wild.passed


def test_a_ball_joint_pulled_far_beyond_its_range_is_noticed():
    """The lowest joint lets the arm turn in every direction, by 0.01 rad."""
    hinge = '<joint name="robot/bend1" '
    text = small_scene()
    start = text.index(hinge)
    ball = f'{hinge}type="ball" limited="true" range="0 0.01" stiffness="0.2" damping="0.02"/>'
    text = text[:start] + ball + text[text.index("/>", start) + 2 :]
    for tension, passes in ((8, True), (800, False)):
        scene = TaskScene.of(text.replace('ctrlrange="0 8"', f'ctrlrange="0 {tension}"'), QuickPushing())
        joint = scene.model.joint("robot/bend1")
        assert joint.type[0] == int(mujoco.mjtJoint.mjJNT_BALL)
        assert scene.model.actuator_ctrlrange[0, 1] == tension
        within = behaviour(rollout_with_stats(scene, BENDING, range(2), threads=1), scene)["within_limits"]
        assert within.measured > 0.0
        assert within.passed is passes


@pytest.mark.parametrize(("episodes", "bad", "passes"), [(20, 1, True), (20, 2, False), (10, 1, False), (40, 2, True)])
def test_one_episode_in_twenty_may_be_a_freak(episodes, bad, passes):
    scene = small_learning()
    rolled = rollout_with_stats(scene, BENDING, range(2), threads=1)
    over = np.where(np.arange(episodes) < bad, 9.0, 0.1)
    stats = replace(rolled.stats, over_limit=over, energy_gain_j=over * 1e6, work_j=np.full(episodes, 1e7))
    checks = behaviour(replace(rolled, stats=stats), scene)
    assert checks["within_limits"].passed is passes
    assert checks["energy_paid_for"].passed is passes


def test_a_simulation_that_breaks_down_is_not_valid():
    scene = small_learning()
    rolled = rollout_with_stats(scene, STILL, range(2), threads=1)
    rolled.outcomes.diverged[1] = True
    assert not behaviour(rolled, scene)["evaluation_stable"].passed


def test_only_the_simulation_that_breaks_down_ends_by_it(monkeypatch):
    monkeypatch.setattr(policy_checks, "Episodes", Breaking)
    rolled = rollout_with_stats(small_learning(), STILL, range(3), threads=1)
    assert rolled.outcomes.diverged.tolist() == [False, True, False]
    ends = [rolled.outcomes.result(row, row).ended for row in range(3)]
    assert ends == ["out_of_time", "diverged", "out_of_time"]
    # what it did in its last control step is no evidence
    assert [len(qpos) for qpos in rolled.stats.qpos] == [26, 3, 26]
    assert rolled.stats.energy_gain_j.max() < 1.0
    assert rolled.stats.moved.max() < 0.02


def test_a_robot_that_passes_through_itself_is_noticed():
    scene = small_learning()
    rolled, structure = rollout_with_stats(scene, STILL, range(1), threads=1), read_structure(scene.model)
    model, qpos = rolled.models[0], rolled.stats.qpos[0].copy()
    model.geom_contype[list(structure.geoms)] = 1
    model.geom_conaffinity[list(structure.geoms)] = 0
    qpos[:, [model.joint(f"robot/bend{index}").qposadr[0] for index in (1, 2, 3, 4)]] = np.pi / 2
    folded = replace(rolled.stats, qpos=(qpos,))
    check = penetration_check([model], folded, structure, indices=range(7, 8), dt_s=0.04)
    assert not check.passed
    assert re.search(r"; robot/\S+ and robot/\S+ in episode 7", check.message)


def test_deep_overlap_is_noticed():
    scene = small_learning()
    data = mujoco.MjData(scene.model)
    place = scene.task.variation("held_out", 0)
    rolled = rollout_with_stats(scene, STILL, range(1), threads=1)
    structure = read_structure(scene.model)
    asked = {"indices": range(7, 27), "dt_s": 0.04}
    fine = penetration_check(rolled.models, rolled.stats, structure, **asked)
    assert fine.passed
    assert "episode 7" not in fine.message
    # the button is put where the arm is
    mujoco.mj_forward(scene.model, data)
    inside = Variation((Change("body_pos", "button", tuple(data.body("robot/seg3").xipos)), *place.changes[1:]))
    apply_to_simulation(inside, model := rolled.models[0], mujoco.MjData(model))
    check = penetration_check([model], rolled.stats, structure, **asked)
    assert not check.passed
    assert check.measured > 1.0
    assert re.search(r"; (button.* and robot/seg3|robot/seg3 and button.*) in episode 7, \S+ s after", check.message)
    # one episode of twenty is left aside, two are not
    fine, positions = rollout_with_stats(scene, STILL, range(1), threads=1).models[0], rolled.stats.qpos[0]
    for deep, passes in ((1, True), (2, False)):
        models = [model] * deep + [fine] * (20 - deep)
        many = replace(rolled.stats, qpos=(positions,) * 20)
        assert penetration_check(models, many, structure, **asked).passed is passes


def test_training_that_breaks_down_in_more_than_one_of_a_hundred_episodes_is_not_valid():
    assert training_check(1000, 10).passed
    assert not training_check(1000, 11).passed
    assert training_check(0, 0).passed


def test_success_that_vanishes_is_an_exploit():
    assert exploit_check("a", "so", 10, 20).passed
    assert not exploit_check("a", "so", 9, 20).passed
    assert exploit_check("a", "so", 0, 0).measured is None
    assert not exploit_check("a", "so", 1, 4).passed
    assert exploit_check("a", "so", 0, 3).passed
    assert "too few to tell" in exploit_check("a", "so", 0, 3).message


def test_a_stiff_rod_with_one_joint_is_no_continuum_robot():
    assert structure_check(read_structure(small_learning().model)).passed
    rigid = small_scene()
    for i in (2, 3, 4):
        start = rigid.index(f'<joint name="robot/bend{i}"')
        rigid = rigid[:start] + rigid[rigid.index("/>", start) + 2 :]
    assert not structure_check(read_structure(mujoco.MjModel.from_xml_string(rigid))).passed

    whole = read_structure(small_learning().model)
    for lacking in ({"tendons": ()}, {"tendon_actuators": ()}, {"roots": (1, 2)}, {"roots": ()}):
        assert not structure_check(replace(whole, **lacking)).passed


# --- what is kept ---


def test_an_evaluated_training_keeps_verdict_and_curve(tmp_path):
    """At the catching task, where twenty episodes cost little because they are over soon."""
    scene = TaskScene.of(small_scene("dynamic_catching"), "dynamic_catching")
    train(scene, tmp_path, steps=128, recipe=SMALL, threads=1)
    finished = FinishedTraining.load(tmp_path)
    assert finished.scene.fingerprint == scene.fingerprint
    assert finished.scene.actions.groups == scene.actions.groups
    seen = set()

    def look(_point):
        seen.add((Training(tmp_path).stage, Training(tmp_path).at_work))

    evaluation = evaluate_training(tmp_path, episodes=20, threads=1, videos=False, listen=look)
    assert seen == {("evaluating", True)}
    assert (Training(tmp_path).stage, Training(tmp_path).at_work) == ("judged", False)
    assert Evaluation.model_validate_json((tmp_path / "evaluation.json").read_text()) == evaluation
    assert named(evaluation)["training_stable"].passed
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((tmp_path / "events.jsonl").read_text().splitlines()[-1])["kind"] == "evaluated"
    rewards = {episode.variation: episode.reward for episode in evaluation.episodes}
    for name, reward in (("best", max(rewards.values())), ("median", sorted(rewards.values())[9])):
        with np.load(tmp_path / f"{name}.npz", allow_pickle=False) as motion:
            variation, lasted_s = int(motion["variation"]), (len(motion["qpos"]) - 1) * float(motion["frame_s"])
            assert rewards[variation] == reward
            assert lasted_s == pytest.approx(evaluation.episodes[variation].time_s, abs=1e-6)
            shown = mujoco.MjModel.from_xml_string(str(motion["mjcf"]))
            assert motion["qpos"].shape[1] == shown.nq
    assert evaluation.scene_sha256 == scene.fingerprint
    assert evaluation.policy_sha256 == finished.policy.fingerprint
    assert {"mujoco", "numpy", "torch", "stable-baselines3"} <= evaluation.versions.keys()
    assert evaluation.commit
    assert evaluation.processor
    # what is no verdict leaves the verdict alone
    before = (tmp_path / "evaluation.json").read_bytes()
    for options, name in (({"level": "hard"}, "hard"), ({"split": "development"}, "development")):
        other = evaluate_training(tmp_path, episodes=20, threads=1, videos=False, **options)
        assert Evaluation.model_validate_json((tmp_path / f"evaluation_{name}.json").read_text()) == other
        assert (other.level, other.split) == (options.get("level", "standard"), options.get("split", "held_out"))
        assert other.episodes != evaluation.episodes
    assert (tmp_path / "evaluation.json").read_bytes() == before


def test_a_verdict_has_a_hundred_episodes_everywhere():
    for function in (evaluation.evaluate, evaluate_training, aidsr.evaluate, evaluate_command):
        assert inspect.signature(function).parameters["episodes"].default == VERDICT_EPISODES == 100


def test_the_same_policy_has_the_same_hash_in_any_file(barely_trained, tmp_path):
    shutil.copytree(barely_trained, tmp_path / "same")
    with zipfile.ZipFile(barely_trained / "policy.zip") as archive:
        weights = archive.read("policy.pth")
    with zipfile.ZipFile(tmp_path / "same" / "policy.zip", "w") as archive:
        archive.writestr("policy.pth", weights)
    policy, same = (FinishedTraining.load(path).policy for path in (barely_trained, tmp_path / "same"))
    assert policy.fingerprint == same.fingerprint
    with torch.no_grad():
        same.network.log_std[0] += 1e-3
    assert policy.fingerprint != same.fingerprint


def test_a_robot_out_of_scope_is_not_valid():
    scene = small_learning()
    assert scope_check(scene.model, read_structure(scene.model)).passed
    motor = '<motor name="robot/m" joint="robot/bend1" ctrlrange="-1 1"/></actuator>'
    motorized = mujoco.MjModel.from_xml_string(small_scene().replace("</actuator>", motor))
    check = scope_check(motorized, read_structure(motorized))
    assert not check.passed
    assert "motorized_joint" in check.message


def test_a_verdict_means_that_the_rest_is_there(barely_trained, tmp_path):
    shutil.copytree(barely_trained, tmp_path / "judged")
    (tmp_path / "judged" / "median.npz").mkdir()  # so that it cannot be written
    with pytest.raises(StorageError, match=r"median\.npz"):
        evaluate_training(tmp_path / "judged", episodes=20, threads=1, videos=False)
    assert (tmp_path / "judged" / "best.npz").exists()
    assert not (tmp_path / "judged" / "evaluation.json").exists()


def test_a_policy_is_trained_and_judged_with_its_smoothing(tmp_path):
    scene = TaskScene.of(small_scene("dynamic_catching"), "dynamic_catching")
    for smoothing in (0.0, 0.7):
        recipe = SMALL.model_copy(update={"smoothing": smoothing})
        train(scene, tmp_path / str(smoothing), steps=128, recipe=recipe, threads=1)
    rough, smooth = (FinishedTraining.load(tmp_path / name).policy for name in ("0.0", "0.7"))
    seen = np.random.default_rng(0).normal(size=(5, rough.normalisation.mean.size))
    assert not np.array_equal(rough.act(seen), smooth.act(seen))
    judged = evaluate_training(tmp_path / "0.7", episodes=20, threads=1, videos=False).episodes
    without, with_it = (evaluate(scene, smooth, threads=1, smoothing=share)[0].episodes for share in (0.0, 0.7))
    assert judged == with_it != without


def test_an_unfinished_training_cannot_be_judged(tmp_path):
    with pytest.raises(UserError, match=r"config\.json"):
        FinishedTraining.load(tmp_path)


@pytest.fixture(scope="module")
def barely_trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("barely") / "001"
    scene = TaskScene.of(builtin_scene("dynamic_catching", 0), "dynamic_catching", groups=[])
    names = [name for group in scene.actions.groups for name in group.actuators]
    assert scene.actions.size < len(names)
    apart = [ActuatorGroup(name=name, actuators=(name,)) for name in names if name.startswith("robot/")]
    train(TaskScene.of(scene.mjcf, scene.task, groups=apart), folder, steps=64, recipe=SMALL, threads=1)
    return folder


def test_actuators_that_act_alone_as_the_design_says_do_so_when_judged(barely_trained):
    finished = FinishedTraining.load(barely_trained)
    assert finished.config.groups_from == finished.scene.actions.groups_from == "design"
    assert finished.scene.actions.groups == finished.config.groups


def test_a_policy_of_another_version_of_the_benchmark_is_not_judged(barely_trained, tmp_path):
    shutil.copytree(barely_trained, tmp_path / "old")
    config = json.loads((tmp_path / "old" / "config.json").read_text())
    (tmp_path / "old" / "config.json").write_text(json.dumps(config | {"benchmark_version": 1}))
    with pytest.raises(UserError, match=f"is of version 1 of the benchmark, not {BENCHMARK_VERSION}; train it again"):
        FinishedTraining.load(tmp_path / "old")


def test_a_policy_is_not_judged_in_a_scene_that_was_changed(barely_trained, tmp_path):
    shutil.copytree(barely_trained, tmp_path / "changed")
    scene = tmp_path / "changed" / "scene.xml"
    scene.write_text(scene.read_text().replace("</mujoco>", "<!-- --></mujoco>"))
    with pytest.raises(UserError, match="has changed since the training"):
        FinishedTraining.load(tmp_path / "changed")


def test_a_curve_without_points_is_drawn_empty(tmp_path):
    (tmp_path / "curve.csv").write_text("steps,success_share,progress,reward\n")
    assert curve_picture(tmp_path / "curve.csv").startswith(b"\x89PNG")


@pytest.mark.parametrize("name", ["reaching/button_pushing", "grasping/simple_grasping", "locomotion/gap"])
def test_a_picture_of_an_episode_shows_what_was_varied(name):
    task = load_task(name)
    variation = task.variation("held_out", 3)
    shown = mujoco.MjModel.from_xml_string(varied_mjcf(task.environment, variation))
    varied = mujoco.MjModel.from_xml_string(task.environment)
    apply_to_simulation(variation, varied, mujoco.MjData(varied))
    for field in ("body_pos", "body_quat", "geom_pos", "geom_type"):
        assert getattr(shown, field) == pytest.approx(getattr(varied, field), abs=1e-6)
    one_number = varied.geom_type == int(mujoco.mjtGeom.mjGEOM_SPHERE)
    assert shown.geom_size[~one_number, 0] == pytest.approx(varied.geom_size[~one_number, 0])


def displaced(scene: TaskScene, joint: int, by: float) -> EpisodeStats:
    """Return what is seen where the first coordinate of a joint is put somewhere else after one control step."""
    variations = [scene.task.variation("held_out", 0)]
    episodes = Episodes(scene.model, scene.task, scene.actions, variations, threads=1, record=RECORDED)
    recorder = StatsRecorder(episodes)
    result = episodes.step(scene.actions.rest[None])
    episodes.batch.bind("qpos")[0, scene.model.jnt_qposadr[joint]] += by
    episodes.batch.forward()
    recorder.update(result)
    return recorder.stats()


def test_motion_is_that_of_the_parts_against_what_holds_them_and_of_a_free_robot_as_a_whole():
    held = TaskScene.of(small_scene("force_controlled_brushing"), "force_controlled_brushing")
    stage = held.model.joint("base_x").id
    assert displaced(held, stage, 0.1).moved == pytest.approx(displaced(held, stage, 0.0).moved)
    free = TaskScene.of(builtin_scene("flat_ground"), "flat_ground")
    structure = read_structure(free.model)
    root = free.model.body_jntadr[structure.free_roots[0]]
    length_m = structure.characteristic_length_m
    assert displaced(free, root, 0.5 * length_m).moved[0] == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("kind", ["slide", "hinge"])
def test_joints_may_go_beyond_their_ranges_by_so_much(kind):
    guide = '<joint name="robot/guide" type="slide" axis="0 0 1" limited="true" range="-0.01 0" stiffness="1e4"/>'
    hinge = '<joint name="robot/bend1"'
    scene = TaskScene.of(small_scene().replace(hinge, guide + hinge), QuickPushing())
    length_m = read_structure(scene.model).characteristic_length_m
    name, allowed = {"slide": ("guide", 0.05 * length_m), "hinge": ("bend1", np.deg2rad(30.0))}[kind]
    joint = scene.model.joint(f"robot/{name}")
    for share in (0.5, 1.5):
        over = displaced(scene, joint.id, joint.range[1] + share * allowed).over_limit[0]
        assert over == pytest.approx(share, abs=0.1)


def test_a_picture_of_an_episode_shows_a_target_in_the_world_where_it_was_put():
    room = '<mujoco><worldbody><site name="spot" pos="0.1 0 0.3"/></worldbody></mujoco>'
    task = goal_task(parse_goal('kind = "reach"\ntarget = "spot"\nvary_m = [0.1, 0.1, 0.1]'), room)
    variation = task.variation("held_out", 0)
    shown = mujoco.MjModel.from_xml_string(varied_mjcf(room, variation))
    assert shown.site("spot").pos == pytest.approx(variation.changes[0].value, abs=1e-6)


def test_what_the_environment_throws_gains_no_energy_that_nobody_paid_for():
    scene = TaskScene.of(builtin_scene("dynamic_catching"), "dynamic_catching")
    rolled = rollout_with_stats(scene, STILL, range(4), threads=1)
    speeds_m_s = np.array([np.linalg.norm(variation.parameters["throw_m_s"]) for variation in rolled.variations])
    thrown_j = BALL_KG / 2 * speeds_m_s**2
    assert (rolled.stats.energy_gain_j < 0.1 * thrown_j).all()


def test_motion_is_measured_from_the_root_of_a_held_robot():
    rolled = rollout_with_stats(small_learning(), STILL, range(1), threads=1)
    assert isinstance(rolled.stats, EpisodeStats)
    assert rolled.stats.moved[0] < 0.02
    assert rollout_with_stats(small_learning(), BENDING, range(1), threads=1).stats.moved[0] > 0.1
