"""Perturbed episodes: what differs from the model, that it is the same for ever, and that nothing else differs."""

from dataclasses import replace

import numpy as np
import pytest

from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.perturbation import (
    DELAY_S,
    KINDS,
    TOLERANCE,
    Perturbation,
    PerturbedVariation,
    perturbed,
    randomized,
)
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.structure import read_structure
from aidsr.tasks import Change, Variation, load_task
from scenes import QuickPushing, builtin_scene, small_learning

SCENE = small_learning()
STRUCTURE = read_structure(SCENE.model)
TASK = SCENE.task
PLAIN = Variation()
PARAMETERS = {
    "stiffness": {"jnt_stiffness"},
    "damping": {"dof_damping"},
    "friction": {"geom_friction"},
    "mass": {"body_mass", "body_inertia"},
    "cable_force": {"actuator_gainprm"},
}


def with_perturbation(variation: Variation = PLAIN, **numbers) -> PerturbedVariation:
    return PerturbedVariation.of(variation, Perturbation(**numbers))


def begun(*variations: Variation, scene: TaskScene = SCENE) -> Episodes:
    return Episodes(scene.model, scene.task, scene.actions, variations, threads=1)


def changed_fields(episodes: Episodes, row: int = 0) -> set[str]:
    """Written fields of the model; those that MuJoCo derives from them aside."""
    fields = {"jnt_stiffness", "tendon_stiffness", "dof_damping", "tendon_damping", "geom_friction", "body_mass"}
    fields |= {"body_inertia", "actuator_gainprm", "actuator_biasprm", "actuator_forcerange", "geom_size", "body_pos"}
    model = episodes.batch.get_model(row)
    return {name for name in fields if not np.array_equal(getattr(model, name), getattr(SCENE.model, name))}


@pytest.mark.parametrize("kind", KINDS)
def test_a_perturbation_is_the_same_for_ever_and_another_in_each_episode(kind):
    first = [perturbed(TASK, STRUCTURE, kind, "held_out", index) for index in range(3)]
    assert first == [perturbed(TASK, STRUCTURE, kind, "held_out", index) for index in range(3)]
    assert [replace(one, perturbation=Perturbation()).changes for one in first] == [
        TASK.variation("held_out", index).changes for index in range(3)
    ]
    if kind in (*PARAMETERS, "combined"):
        others = perturbed(TASK, STRUCTURE, kind, "development", 0)
        assert len({one.perturbation for one in (*first, others)}) == 4


def test_factors_lie_within_the_tolerance_and_fill_it():
    drawn = [perturbed(TASK, STRUCTURE, "combined", "held_out", index).perturbation for index in range(200)]
    for name in ("stiffness", "damping", "friction", "mass"):
        factors = [getattr(one, name) for one in drawn]
        assert 1 - TOLERANCE <= min(factors) < 0.82
        assert 1.18 < max(factors) <= 1 + TOLERANCE
    assert {len(one.cable_forces) for one in drawn} == {2}
    assert all(one.cable_forces[0] != one.cable_forces[1] for one in drawn)


@pytest.mark.parametrize("kind", PARAMETERS)
def test_a_parameter_is_off_in_the_compiled_model_and_no_other_is(kind):
    variation = perturbed(TASK, STRUCTURE, kind, "held_out", 1)
    plain = begun(TASK.variation("held_out", 1))
    episodes = begun(variation)
    assert changed_fields(episodes) - changed_fields(plain) == PARAMETERS[kind]
    model, own = episodes.batch.get_model(0), plain.batch.get_model(0)
    perturbation = variation.perturbation
    match kind:
        case "stiffness":
            expected = own.jnt_stiffness[list(STRUCTURE.joints)] * perturbation.stiffness
            assert model.jnt_stiffness[list(STRUCTURE.joints)] == pytest.approx(expected)
        case "damping":
            assert model.joint("robot/bend2").damping[0] == pytest.approx(0.02 * perturbation.damping)
        case "friction":
            assert model.geom_friction == pytest.approx(own.geom_friction * perturbation.friction)
        case "mass":
            assert model.body("robot/seg2").mass[0] == pytest.approx(0.01 * perturbation.mass)
            assert model.body_subtreemass[0] != own.body_subtreemass[0]  # MuJoCo's derived constants follow
            assert model.body("button").mass[0] == own.body("button").mass[0]
        case "cable_force":
            gains = [model.actuator(f"robot/pull_{side}").gainprm[0] for side in ("left", "right")]
            assert gains == pytest.approx([-factor for factor in perturbation.cable_forces])


def test_a_perturbation_multiplies_what_the_variation_says():
    friction = Variation((Change("geom_friction", "button_cap", (0.5, 0.005, 0.0001)),))
    model = begun(with_perturbation(friction, friction=1.2)).batch.get_model(0)
    assert model.geom("button_cap").friction[0] == pytest.approx(0.6)


def test_a_reset_restores_what_an_earlier_perturbation_changed():
    plain = TASK.variation("held_out", 1)
    episodes = begun(perturbed(TASK, STRUCTURE, "combined", "held_out", 0), plain)
    assert changed_fields(episodes, 0) > changed_fields(episodes, 1)
    fresh = begun(plain, plain)
    episodes.reset(np.array([0]), [plain])
    assert changed_fields(episodes, 0) == changed_fields(fresh, 0)
    for step in range(5):
        actions = np.random.default_rng(step).uniform(-1, 1, (2, 2))
        assert np.array_equal(episodes.step(actions).observation, fresh.step(actions).observation)


def test_without_a_perturbation_nothing_differs():
    variations = [TASK.variation("held_out", index) for index in range(3)]
    plain, unperturbed = begun(*variations), begun(*(with_perturbation(one) for one in variations))
    for step in range(10):
        actions = np.random.default_rng(step).uniform(-1, 1, (3, 2))
        before, after = plain.step(actions), unperturbed.step(actions)
        assert np.array_equal(before.observation, after.observation)
        assert np.array_equal(before.reward, after.reward)


@pytest.mark.parametrize(("control_dt_s", "late"), [(0.04, 1), (0.02, 2)])
def test_a_delayed_action_arrives_exactly_then(control_dt_s, late):
    scene = small_learning(type("Faster", (QuickPushing,), {"control_dt_s": control_dt_s})())
    variation = scene.task.variation("held_out", 0)
    prompt, delayed = begun(variation, scene=scene), begun(with_perturbation(variation, delay_s=DELAY_S), scene=scene)
    rest = scene.actions.ctrl(scene.actions.rest[None])[0]
    sent = np.random.default_rng(0).uniform(-1, 1, (6, 1, 2))
    controls = []
    for action in sent:
        result = delayed.step(action)
        assert result.observation[0, 14:16] == pytest.approx(action[0])  # a controller knows what it sent
        controls.append(delayed.batch.bind("ctrl")[0, list(scene.actions.actuators)].copy())
    expected = [rest] * late + [scene.actions.ctrl(action)[0] for action in sent[:-late]]
    assert np.array(controls) == pytest.approx(np.array(expected))
    for _ in range(late):  # so its motion is that of actions without delay, later
        prompt.step(scene.actions.rest[None])
    for action in sent[:-late]:
        prompt.step(action)
    assert np.array_equal(prompt.batch.bind("qpos"), delayed.batch.bind("qpos"))


def test_a_reset_forgets_actions_on_their_way():
    variation = with_perturbation(TASK.variation("held_out", 0), delay_s=DELAY_S)
    episodes, fresh = begun(variation, variation), begun(variation, variation)
    episodes.step(np.ones((2, 2)))
    episodes.reset(np.array([0]), [variation])
    after, expected = episodes.step(np.ones((2, 2))), fresh.step(np.ones((2, 2)))
    assert np.array_equal(after.observation[0], expected.observation[0])
    assert not np.array_equal(after.observation[1], expected.observation[1])


def test_a_delay_between_control_steps_is_refused():
    with pytest.raises(ValueError, match=r"delay between control steps: 0\.03 s; use a multiple of 0\.04 s"):
        begun(with_perturbation(delay_s=0.03))


def test_friction_of_cables_slows_only_the_episodes_that_have_it():
    variation = TASK.variation("held_out", 0)
    plain = begun(variation, variation)
    mixed = begun(variation, with_perturbation(variation, cable_friction=0.3))
    bend = np.tile([1.0, -1.0], (2, 1))
    for _ in range(20):
        plain.step(bend)
        mixed.step(bend)
    assert np.array_equal(mixed.batch.bind("qpos")[0], plain.batch.bind("qpos")[0])
    bends = np.abs(mixed.batch.bind("qpos")[:, mixed.model.joint("robot/bend4").qposadr[0]])
    assert bends[1] < 0.9 * bends[0]


def test_a_simulation_that_breaks_down_with_cable_friction_is_reported():
    variation = with_perturbation(TASK.variation("held_out", 0), cable_friction=0.3)
    episodes = begun(variation, variation)
    episodes.batch.bind("qvel")[1] = 1e12
    result = episodes.step(np.ones((2, 2)))
    assert result.diverged.tolist() == [False, True]
    assert np.isfinite(result.observation).all()


def test_training_draws_every_kind_of_perturbation():
    drawn = [randomized(TASK, STRUCTURE, index).perturbation for index in range(60)]
    assert drawn[:3] == [randomized(TASK, STRUCTURE, index).perturbation for index in range(3)]
    assert len({one.stiffness for one in drawn}) == 60
    assert {one.delay_s for one in drawn} == {0.0, DELAY_S}
    frictions = [one.cable_friction for one in drawn]
    assert min(frictions) < 0.05
    assert 0.25 < max(frictions) <= 0.3
    assert drawn[0].stiffness != perturbed(TASK, STRUCTURE, "combined", "held_out", 0).perturbation.stiffness


@pytest.mark.parametrize("task_name", ["simple_grasping", "flat_ground"])
def test_built_in_bodies_run_with_all_of_it(task_name):
    task = load_task(task_name)
    scene = TaskScene.of(builtin_scene(task.name), task)
    structure = read_structure(scene.model)
    episodes = begun(*(perturbed(task, structure, "combined", "held_out", index) for index in range(2)), scene=scene)
    for step in range(25):
        result = episodes.step(np.random.default_rng(step).uniform(-1, 1, (2, scene.actions.size)))
    assert not result.diverged.any()


def test_rollouts_of_perturbed_episodes_do_not_depend_on_threads():
    variations = [perturbed(TASK, STRUCTURE, "combined", "held_out", index) for index in range(4)]

    class Bending:
        def act(self, observation):
            return np.tile([1.0, -1.0], (len(observation), 1))

    one, three = (
        rollout(Episodes(SCENE.model, TASK, SCENE.actions, variations, threads=threads), Bending())
        for threads in (1, 3)
    )
    assert np.array_equal(one.reward, three.reward)
