"""The same episodes as a VecEnv of Stable-Baselines3 and as environments of Gymnasium."""

import sys

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

import gymnasium
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_of_sb3

from aidsr.core.artifacts import ActuatorGroup
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.overlap_meter import OverlapMeter
from aidsr.learn.rl.single_env import TaskEnv, environment_id, register_environments
from aidsr.learn.rl.vector_env import BatchedVecEnv
from aidsr.tasks import load_task, task_names
from scenes import Breaking, QuickPushing, builtin_scene, small_learning, small_scene

BUTTON = "aidsr/ButtonPushing-v0"


def vector_env(n=4, task=None, of=Episodes, hold_steps=1, **options) -> BatchedVecEnv:
    scene = small_learning(task).with_hold(hold_steps)
    rng = np.random.default_rng(0)

    def following():
        return scene.task.variation("development", int(rng.integers(1000)))

    episodes = of(scene.model, scene.task, scene.actions, [following() for _ in range(n)], threads=1)
    return BatchedVecEnv(episodes, following, **options)


def test_a_time_limit_is_a_truncation_with_the_last_sight_of_the_old_episode():
    env = vector_env()
    env.reset()
    still = np.full((4, 2), -1.0)
    for _ in range(24):
        last, _, dones, infos = env.step(still)
        assert not dones.any()
        assert infos == [{}] * 4
    first, rewards, dones, infos = env.step(still)
    assert dones.all()
    for index, info in enumerate(infos):
        assert info["TimeLimit.truncated"]
        assert not info["is_success"]
        assert info["episode"]["l"] == 25
        assert np.allclose(info["terminal_observation"], last[index], atol=0.05)
        assert not np.allclose(info["terminal_observation"][16:19], first[index][16:19])
    assert rewards.dtype == np.float32
    assert env.episodes.running.all()


def test_the_last_sight_is_that_of_the_last_step():
    env = vector_env(2)
    env.reset()
    alone = Episodes(env.episodes.model, env.episodes.task, env.episodes.actions, env.episodes.variations, threads=1)
    bends = [alone.model.joint(f"robot/bend{i}").qposadr[0] for i in (1, 2, 3, 4)]
    swinging = np.tile([1.0, -1.0], (2, 1))
    dones = np.zeros(2, dtype=np.bool_)
    while not dones.any():
        before = alone.batch.bind("qpos")[:, bends].copy()
        alone.step(swinging)
        _, _, dones, infos = env.step(swinging)
    now = alone.batch.bind("qpos")[:, bends]
    assert np.abs(now - before).max() > 0.01, "the arm still moves"
    assert dones.all()
    assert np.allclose([info["terminal_observation"][:4] for info in infos], now, atol=1e-6)


def test_a_held_action_is_one_step_with_all_its_rewards():
    held, each = vector_env(3, hold_steps=4), vector_env(3)
    held.reset(), each.reset()
    action, ended = np.tile([1.0, -1.0], (3, 1)), np.zeros(3, dtype=bool)
    returns = np.zeros(3)
    while not ended.any():
        seen, rewards, ended, infos = held.step(action)
        parts = []
        for _ in range(4):
            parts.append(each.step(action))
            if parts[-1][2].any():
                break
        assert ended.tolist() == parts[-1][2].tolist()
        assert np.allclose(rewards, np.sum([part[1] for part in parts], axis=0), atol=1e-6)
        returns += rewards
    assert ended.all()
    assert len(parts) < 4, "they end while an action is held"
    assert np.allclose(seen, parts[-1][0], atol=1e-6)
    for index, (mine, other) in enumerate(zip(infos, parts[-1][3], strict=True)):
        assert mine["episode"]["r"] == pytest.approx(returns[index])
        assert mine["episode"]["l"] == other["episode"]["l"]
        assert np.allclose(mine["terminal_observation"], other["terminal_observation"])


def test_success_in_the_last_moment_is_no_truncation():
    lengths = []
    for limit_s in (1.0, None):
        env = vector_env(1)
        env.reset()
        env.episodes.time_limit_s[:] = limit_s or lengths[0] * env.episodes.task.control_dt_s
        dones = [False]
        while not dones[0]:
            _, _, dones, infos = env.step(np.array([[1.0, -1.0]]))
        lengths.append(infos[0]["episode"]["l"])
        assert infos[0]["is_success"]
        assert not infos[0]["TimeLimit.truncated"]
    assert lengths[0] == lengths[1] < 25


def test_success_is_no_truncation_and_returns_add_up():
    env = vector_env(2)
    env.reset()
    total = np.zeros(2)
    for _ in range(25):
        _, rewards, dones, infos = env.step(np.tile([1.0, -1.0], (2, 1)))
        total += rewards
        if dones.any():
            break
    assert dones.all()
    assert not any(info["TimeLimit.truncated"] for info in infos)
    assert all(info["is_success"] for info in infos)
    assert [info["episode"]["r"] for info in infos] == pytest.approx(total, rel=1e-5)


def test_deep_overlap_costs_reward_and_is_no_success(monkeypatch):
    clean = vector_env(2)
    overlapping = vector_env(2, overlap_penalty=0.5)

    def measure(meter, which):
        depth = np.where(which, [0.79, 0.95], 0.0)
        meter.deepest = np.array([0.79, 1.2])
        return depth

    monkeypatch.setattr(OverlapMeter, "measure", measure)
    clean.reset(), overlapping.reset()
    ended = [False]
    while not ended[0]:
        _, rewards, ended, _ = clean.step(np.tile([1.0, -1.0], (2, 1)))
        _, penalized, done, infos = overlapping.step(np.tile([1.0, -1.0], (2, 1)))
        assert penalized == pytest.approx(rewards - [0.0, 0.5 * 0.75], abs=1e-6)
        assert done.tolist() == ended.tolist()
    assert [info["is_success"] for info in infos] == [True, False]


class LongHeld(QuickPushing):
    """Success in which nothing is gained takes as long as patience would otherwise last."""

    hold_s = 0.225


@pytest.mark.parametrize(("task", "patience_s"), [(None, 0.45), (LongHeld(), 0.1)])
def test_an_episode_in_which_nothing_is_gained_is_cut_short_as_at_its_time_limit(task, patience_s):
    env = vector_env(2, task, patience_s=patience_s)
    env.reset()
    # the first stays where it is, the second presses the button and succeeds
    for _ in range(25):
        _, _, dones, infos = env.step(np.array([[-1.0, -1.0], [1.0, -1.0]]))
        if dones[0]:
            break
    assert infos[0]["TimeLimit.truncated"]
    assert not infos[0]["is_success"]
    # the first step shows where it stands, 12 of 0.04 s are 0.45 s and more, and the next is the last
    assert infos[0]["episode"]["l"] == 14


def test_a_simulation_that_breaks_down_ends_its_episode_and_no_other():
    env = vector_env(3, of=Breaking)
    env.reset()
    for _ in range(3):
        _, _, dones, infos = env.step(np.full((3, 2), -1.0))
    assert dones.tolist() == [False, True, False]
    assert infos[1]["diverged"]
    assert not infos[1]["TimeLimit.truncated"]
    assert np.isfinite(infos[1]["terminal_observation"]).all()


def test_first_episodes_can_be_made_to_end_at_different_times():
    env = vector_env(5)
    env.reset()
    env.desynchronize(np.random.default_rng(1))
    ends = []
    for step in range(1, 26):
        dones = env.step(np.full((5, 2), -1.0))[2]
        ends += [step] * int(dones.sum())
    assert ends == [5, 10, 15, 20, 25]


def test_what_simulations_share_cannot_be_set_for_some():
    env = vector_env(3)
    assert env.get_attr("render_mode") == [None] * 3
    assert env.env_is_wrapped(object) == [False] * 3
    with pytest.raises(NotImplementedError):
        env.set_attr("render_mode", "human")
    with pytest.raises(NotImplementedError):
        env.env_method("render")


def test_every_task_is_registered():
    assert environment_id("reaching/button_pushing", task_names()) == "aidsr/ButtonPushing-v0"
    for name in task_names():
        assert environment_id(name, task_names()) in gymnasium.registry


def test_a_task_of_the_same_name_as_another_has_an_id_of_its_own(tmp_path, monkeypatch):
    code = "from aidsr.tasks.reaching.button_pushing import ButtonPushing\n"
    code += "class Doorbell(ButtonPushing):\n    name = 'home/button_pushing'\n"
    (tmp_path / "aidsr_doorbell.py").write_text(code)
    (tmp_path / "aidsr_doorbell.xml").write_text(load_task("button_pushing").environment)
    info = tmp_path / "aidsr_doorbell-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: aidsr-doorbell\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[aidsr.tasks]\nhome/button_pushing = aidsr_doorbell:Doorbell\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert environment_id("reaching/button_pushing", task_names()) == "aidsr/ButtonPushing-v0"
    name = environment_id("home/button_pushing", task_names())
    assert name == "aidsr/Home.ButtonPushing-v0"
    register_environments()
    try:
        tasks = [gymnasium.make(each, scene=small_scene()).unwrapped.scene.task.name for each in (name, BUTTON)]
        assert tasks == ["home/button_pushing", "reaching/button_pushing"]
    finally:
        gymnasium.registry.pop(name)
        sys.modules.pop("aidsr_doorbell", None)


@pytest.mark.parametrize(
    ("name", "pick"),
    [
        ("reaching/button_pushing", 1),
        ("grasping/simple_grasping", 1),
        ("locomotion/gap", 0),
        ("reaching/pipe_inserting", 0),
    ],
)
def test_environments_of_built_in_robots_pass_the_checks(name, pick):
    env = gymnasium.make(environment_id(name, task_names()), scene=builtin_scene(name, pick))
    check_env(env.unwrapped)
    check_env_of_sb3(env.unwrapped)


def test_one_environment_goes_as_the_batch_does():
    scene = small_learning("button_pushing")
    env = TaskEnv("button_pushing", small_scene())
    observation, info = env.reset(options={"variation": 7})
    assert info == {"variation": 7}
    episodes = Episodes(scene.model, scene.task, scene.actions, [scene.task.variation("development", 7)], threads=1)
    assert np.array_equal(observation, episodes.observation[0])
    action = np.array([0.5, -1.0], dtype=np.float32)
    observation, reward, terminated, truncated, info = env.step(action)
    result = episodes.step(action[None])
    assert np.array_equal(observation, result.observation[0])
    assert (reward, terminated, truncated) == (result.reward[0], False, False)
    assert info["progress"] == result.progress[0]


@pytest.mark.parametrize(("action", "ends"), [((-1.0, -1.0), (False, True)), ((1.0, -1.0), (True, False))])
def test_success_terminates_an_episode_and_the_time_limit_truncates_it(action, ends):
    env = TaskEnv(QuickPushing(), small_scene())
    env.reset(seed=0)
    found = [env.step(np.array(action, dtype=np.float32))]
    while not any(found[-1][2:4]):
        found.append(env.step(np.array(action, dtype=np.float32)))
    assert found[-1][2:4] == ends
    assert found[-1][4]["is_success"] == ends[0]
    assert not any(info["is_success"] for *_, info in found[:-1])


def test_what_gymnasium_is_asked_for_is_passed_on():
    both = ActuatorGroup(name="both", actuators=("pull_left", "pull_right"))

    def made(**options) -> TaskEnv:
        scene = small_scene("dynamic_catching")
        return gymnasium.make("aidsr/DynamicCatching-v0", scene=scene, disable_env_checker=True, **options).unwrapped

    plain, asked = made(groups=[both]), made(groups=[both], grouping="off", level="hard", split="held_out")
    assert (plain.action_space.shape, asked.action_space.shape) == ((1,), (2,))
    assert (plain.scene.task.level, asked.scene.task.level) == ("standard", "hard")
    for env, split in ((plain, "development"), (asked, "held_out")):
        env.reset(options={"variation": 3})
        assert env.episodes.variations == [env.scene.task.variation(split, 3)]
    smooth = made(smoothing=0.75)
    smooth.reset(seed=0)
    assert np.allclose(smooth.step(np.ones(2, dtype=np.float32))[0][16:18], 0.75 * -1.0 + 0.25)


def test_a_seed_decides_which_variations_come():
    env = TaskEnv("button_pushing", small_scene())
    drawn = [[env.reset(seed=seed)[1]["variation"], env.reset()[1]["variation"]] for seed in (3, 3, 4)]
    assert drawn[0] == drawn[1] != drawn[2]
    assert drawn[0][0] != drawn[0][1]
