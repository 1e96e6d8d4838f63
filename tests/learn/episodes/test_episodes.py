"""Many episodes side by side: each as if alone, and each with an end of its own."""

import numpy as np
import pytest

from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.divergence import max_body_speeds
from aidsr.tasks import load_task
from scenes import Always, QuickPushing, builtin_scene, small_learning


def begun(n=3, *, task=None, threads=1, first=0, **options) -> Episodes:
    scene = small_learning(task)
    variations = [scene.task.variation("development", first + index) for index in range(n)]
    return Episodes(scene.model, scene.task, scene.actions, variations, threads=threads, **options)


def played(episodes, seed=0, steps=10):
    """Step with random actions, the same ones for the same simulation."""
    moments = []
    for step in range(steps):
        rows = [np.random.default_rng([seed, step, i]).uniform(-1, 1, 2) for i in range(episodes.n)]
        moments.append(episodes.step(np.array(rows)))
    return moments


def test_a_batch_goes_as_each_simulation_would_alone():
    together = played(begun(3))
    for index in range(3):
        alone = begun(1, first=index)
        for step, result in enumerate(together):
            action = np.random.default_rng([0, step, index]).uniform(-1, 1, 2)
            mine = alone.step(action[None])
            assert np.array_equal(mine.observation[0], result.observation[index])
            assert mine.reward[0] == result.reward[index]


def test_threads_change_nothing():
    one, three = played(begun(5)), played(begun(5, threads=3))
    assert all(np.array_equal(a.observation, b.observation) for a, b in zip(one, three, strict=True))


def test_an_action_is_held_from_the_beginning_of_each_episode():
    scene = small_learning().with_hold(3)
    variations = [scene.task.variation("development", index) for index in range(2)]
    episodes = Episodes(scene.model, scene.task, scene.actions, variations, threads=1)
    done = []
    for step in range(8):
        if step == 4:
            episodes.reset(np.array([1]), [variations[1]])
        episodes.step(np.full((2, 2), step / 10.0))
        done.append(episodes.observation[:, 14].round(3).tolist())
    assert np.allclose(np.transpose(done), [[0, 0, 0, 0.3, 0.3, 0.3, 0.6, 0.6], [0, 0, 0, 0.3, 0.4, 0.4, 0.4, 0.7]])


def test_actions_may_correct_a_motion():
    """The motion goes on while its correction is held, by the clock of each episode."""

    class Ramp:
        def playback(self, n):
            return self

        def at(self, time_s, observation):
            return np.stack([time_s, -time_s], axis=-1)

    scene = small_learning().with_hold(2).with_base(Ramp(), 0.5)
    variations = [scene.task.variation("development", index) for index in range(2)]
    episodes = Episodes(scene.model, scene.task, scene.actions, variations, threads=1)
    done = []
    for step in range(3):
        if step == 2:
            episodes.reset(np.array([1]), [variations[1]])
        episodes.step(np.array([[0.2, 0.0], [0.2, -1.0]]) if step != 1 else np.ones((2, 2)))
        done.append(episodes.observation[:, 14:16].round(3).tolist())
    first, second = np.swapaxes(done, 0, 1)
    assert np.allclose(first, [[0.1, 0.0], [0.14, -0.04], [0.18, -0.08]])
    assert np.allclose(second, [[0.1, -0.5], [0.14, -0.54], [0.1, -0.5]])


def test_what_is_observed():
    """Joints 4 + 4, tendons 2 + 2, forces 2, last action 2, features 9."""
    episodes = begun(2)
    assert episodes.observation.shape == (2, 25)
    assert episodes.observation.dtype == np.float32
    assert np.allclose(episodes.observation[:, 14:16], -1.0)
    episodes.step(np.array([[0.25, -0.5], [1.0, 2.0]]))
    assert np.allclose(episodes.observation[:, 14:16], [[0.25, -0.5], [1.0, 1.0]])
    joints = episodes.batch.bind("qpos")[:, [episodes.model.joint(f"robot/bend{i}").qposadr[0] for i in (1, 2, 3, 4)]]
    assert np.allclose(episodes.observation[:, :4], joints)


def test_a_moving_base_is_part_of_the_body():
    task = load_task("pipe_inserting")
    scene = TaskScene.of(builtin_scene(task.name), task)
    episodes = Episodes(scene.model, task, scene.actions, [task.variation("development", 0)], threads=1)
    action = np.zeros((1, scene.actions.size))
    action[0, -1] = 1.0
    before = episodes.observation[0, 0]
    for _ in range(10):
        episodes.step(action)
    assert episodes.observation[0, 0] - before == pytest.approx(0.05 * 0.4, rel=0.3)


def test_a_scripted_base_follows_its_timetable():
    task = load_task("simple_grasping")
    scene = TaskScene.of(builtin_scene(task.name, 1), task)
    episodes = Episodes(scene.model, task, scene.actions, [task.variation("development", 0)], threads=1)
    for _ in range(40):
        episodes.step(np.full((1, scene.actions.size), -1.0))
    assert episodes.batch.joint("carriage_lift").qpos[0, 0] == pytest.approx(-0.10, abs=0.005)


def test_variations_differ_between_simulations():
    buttons = [begun(4).variations[i].changes[0].value for i in range(4)]
    assert len(set(buttons)) == 4
    features = begun(4).observation[:, 16:19]
    assert np.unique(features.round(4), axis=0).shape[0] == 4


def test_idle_episodes_end_by_the_time_limit_alone():
    episodes = begun(2)
    course = rollout(episodes, Always(-1.0, -1.0))
    assert np.allclose(course.time_s, 1.0)
    assert not (course.success | course.failure | course.diverged).any()
    assert not episodes.running.any()


def test_success_must_be_held_and_ends_the_episode_with_a_bonus():
    moments = []
    course = rollout(begun(2), Always(1.0, -1.0), moments.append)
    assert course.success.all()
    assert (course.time_s < 0.5).all()
    assert moments[-1].reward.min() > 4.0
    assert moments[-1].terminated.all()
    assert not moments[-1].truncated.any()


def test_success_in_the_last_moment_is_not_out_of_time():
    won_at_s = rollout(begun(1), Always(1.0, -1.0)).time_s
    episodes, moments = begun(1), []
    episodes.time_limit_s[:] = won_at_s
    assert rollout(episodes, Always(1.0, -1.0), moments.append).time_s == won_at_s
    assert (moments[-1].success[0], moments[-1].truncated[0]) == (True, False)


def test_an_ended_episode_stands_still_until_it_is_begun_anew():
    episodes = begun(2)
    episodes.time_limit_s[0] = 0.08
    played(episodes, steps=2)
    assert episodes.running.tolist() == [False, True]
    stood = episodes.batch.bind("qpos")[0].copy()
    result = played(episodes, steps=1)[0]
    assert np.array_equal(episodes.batch.bind("qpos")[0], stood)
    assert (result.reward[0], result.progress[0], result.done[0]) == (0.0, 0.0, False)
    went_on = episodes.observation[1].copy()
    seen = episodes.reset(np.array([0]), [episodes.task.variation("development", 9)])
    assert np.array_equal(seen[1], went_on)
    assert np.array_equal(seen[0], begun(1, first=9).observation[0])
    assert episodes.time_limit_s[0] == 1.0


def test_a_simulation_that_breaks_down_ends_alone():
    episodes = begun(3)
    played(episodes, steps=2)
    seen = episodes.observation[1].copy()
    episodes.batch.bind("qvel")[1] = 1e9
    result = episodes.step(np.zeros((3, 2)))
    assert result.diverged.tolist() == [False, True, False]
    assert result.done.tolist() == [False, True, False]
    assert result.reward[1] == 0.0
    assert np.array_equal(result.observation[1], seen)
    assert np.isfinite(result.observation).all()
    episodes.reset(np.array([1]), [episodes.task.variation("development", 1)])
    assert episodes.running.all()
    assert not played(episodes, steps=2)[-1].diverged.any()


def test_too_fast_is_broken_down_too():
    episodes = begun(2)
    episodes.batch.bind("qvel")[0, episodes.model.joint("robot/bend1").dofadr[0]] = 4000.0
    assert episodes.step(np.zeros((2, 2))).diverged[0]


def test_speeds_are_those_of_the_bodies():
    episodes = begun(1)
    played(episodes, steps=3)
    before = episodes.batch.bind("xipos").copy()
    episodes.batch.step(nstep=1)
    moved = np.linalg.norm(episodes.batch.bind("xipos") - before, axis=2)[0]
    timestep_s = episodes.model.opt.timestep
    episodes.batch.step(nstep=1)
    again = np.linalg.norm(episodes.batch.bind("xipos") - before, axis=2)[0] - moved
    assert max_body_speeds(episodes.batch)[0] == pytest.approx(again.max() / timestep_s, rel=0.05)


def test_smoothing_keeps_a_share_of_the_last_action():
    episodes = begun(1, smoothing=0.75)
    episodes.step(np.ones((1, 2)))
    assert np.allclose(episodes.observation[0, 14:16], 0.75 * -1.0 + 0.25)
    with pytest.raises(ValueError, match="smoothing"):
        begun(1, smoothing=1.0)


def test_recorded_fields_are_those_of_every_physics_step():
    episodes = begun(2, record=("energy", "qvel"))
    played(episodes, steps=1)
    assert episodes.recorded["qvel"].shape == (2, 20, episodes.model.nv)
    assert np.array_equal(episodes.recorded["qvel"][:, -1], episodes.batch.bind("qvel"))
    assert episodes.stepped.tolist() == [0, 1]


def test_the_quick_task_is_the_button_task():
    assert QuickPushing().name == "reaching/button_pushing"
