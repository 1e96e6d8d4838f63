"""What holds for every task of the benchmark. A new task is tested by being in the list."""

import re
from importlib import resources

import mujoco
import numpy as np
import pytest
from lxml import etree
from mujoco.batch import Batch
from stick import Episode, scene

from aidsr.mjcf.read import read_mjcf
from aidsr.tasks import TASKS, Task, apply_to_batch, apply_to_simulation, load_task

NAMES = tuple(TASKS)
BOTH_LEVELS = [(name, level) for name in NAMES for level in ("standard", "hard")]
SPLITS = ("development", "held_out")

HARD = {
    "reaching/button_pushing": {"preload_n": 5.0},
    "reaching/surface_adapting": {"share_on_surface": 0.7},
    "reaching/pipe_inserting": {"wall_n": 2.0},
    "grasping/simple_grasping": {"shake_n": 1.0},
    "grasping/zero_gravity_grasping": {"drift_m_s": 0.1},
    "grasping/delicate_grasping": {"contact_n": 1.0},
    "grasping/dynamic_catching": {"slowest_m_s": 2.5, "fastest_m_s": 2.5},
    "locomotion/flat_ground": {"goal_m": 3.0, "goal_lengths": 8.0},
    "locomotion/stairs": {"rise_m": 0.03},
    "locomotion/obstacles": {"reach_m": 0.07},
    "locomotion/gap": {"narrowest_m": 0.15, "widest_m": 0.15},
    "locomotion/tunnel": {"height_m": 0.07},
    "manipulation/drawer_opening": {"friction_n": 1.5},
    "reaching/around_corners": {"overlap_m": 0.035},
    "grasping/ball_from_bowl": {"lightest_kg": 0.10, "heaviest_kg": 0.15},
    "locomotion/incline": {"slope_deg": 25.0},
    "manipulation/crank_turning": {"torque_nm": 0.08, "turn_deg": 540.0},
    "manipulation/force_controlled_brushing": {"cells_a_side": 10, "coverage": 0.9},
}
"""What is different at level hard."""


@pytest.fixture(params=NAMES)
def task(request) -> Task:
    return load_task(request.param)


@pytest.fixture(params=BOTH_LEVELS, ids=["-".join(pair) for pair in BOTH_LEVELS])
def levelled(request) -> Task:
    return load_task(*request.param)


def test_the_environment_passes_the_safe_loader_and_compiles(levelled):
    assert read_mjcf(levelled.environment).notes == ()
    model = mujoco.MjModel.from_xml_string(levelled.environment)
    assert model.opt.timestep == 0.002
    assert model.opt.integrator == int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)


def test_the_environment_holds_its_contact_numbers_against_any_robot(levelled):
    model = mujoco.MjModel.from_xml_string(levelled.environment)
    for geom in range(model.ngeom):
        if model.geom_contype[geom] or model.geom_conaffinity[geom]:
            assert model.geom_priority[geom] == 1
            assert model.geom_friction[geom, 0] == pytest.approx(0.9)
            assert tuple(model.geom_solref[geom]) == pytest.approx((0.004, 1.0))


def test_the_standard_environment_is_the_file(task):
    text = task.environment
    assert text.startswith("<!--")
    category, name = task.name.split("/")
    assert text == (resources.files("aidsr.tasks") / category / f"{name}.xml").read_text(encoding="utf-8")


def test_the_hard_level_changes_only_the_numbers_in_brackets(task):
    hard = load_task(task.name, "hard")
    changed = {key: value for key, value in vars(hard).items() if value != vars(task)[key] and key != "level"}
    assert changed == HARD[task.name]
    ours, theirs = (
        list(etree.fromstring(text.encode()).iter(etree.Element)) for text in (task.environment, hard.environment)
    )
    edited = {
        element.get("name") for element, other in zip(ours, theirs, strict=True) if element.attrib != other.attrib
    }
    assert edited <= {place.partition("/")[2] for place in hard.edits}


def test_every_required_name_exists_and_survives_assembly(task):
    for text in (task.environment, scene(task, "free" if task.base == "free" else "fixed")):
        names = {element.get("name") for element in etree.fromstring(text.encode()).iter(etree.Element)}
        assert set(task.required_names) <= names
        assert set(task.policy_actuators) <= names


def test_the_objective_says_what_in_one_or_two_sentences(levelled):
    text = levelled.objective
    sentences = re.findall(r"[.!?](?:\s|$)", text)
    assert len(sentences) in (1, 2)
    assert text.isascii()
    assert re.search(r"\d", text), "an objective has sizes"
    mechanism = r"\b(tendon|segment|finger|gripper|suction|hook|leg|limb|tentacle|continuum|motor|cable|arm|snake|worm)"
    assert not re.search(mechanism, text, re.IGNORECASE)


def test_a_brief_carries_the_job(task):
    brief = task.brief()
    assert (brief.task, brief.base, brief.objective) == (task.name, task.base, task.objective)
    assert [mount.name for mount in brief.summary.mounts] == ["mount"]
    assert bool(brief.summary.mounts[0].moved_by) == (task.base == "moving")


def test_variations_repeat_and_differ_and_the_splits_share_none(levelled):
    drawn = {split: [levelled.variation(split, index) for index in range(20)] for split in SPLITS}
    assert drawn == {split: [levelled.variation(split, index) for index in range(20)] for split in SPLITS}
    texts = [repr(variation) for variations in drawn.values() for variation in variations]
    assert len(set(texts)) == 40


def test_a_batch_takes_a_variation_as_a_single_simulation_does(task):
    environment = task.environment
    batch = Batch(mujoco.MjModel.from_xml_string(environment), 4, 1)
    variations = [task.variation("development", index) for index in range(4)]
    apply_to_batch(variations, batch, [0, 1, 2, 3])
    # an episode that ends alone and begins with another variation
    variations[2] = task.variation("held_out", 0)
    apply_to_batch([variations[2]], batch, [2])
    batch.step(nstep=50)
    for index, variation in enumerate(variations):
        model = mujoco.MjModel.from_xml_string(environment)
        data = mujoco.MjData(model)
        apply_to_simulation(variation, model, data)
        mujoco.mj_step(model, data, nstep=50)
        assert np.array_equal(batch.bind("qpos")[index], data.qpos)


def test_a_varied_model_is_the_one_its_text_would_compile_to(task):
    """Bounding volumes and constants follow the fields that a variation writes."""
    model = mujoco.MjModel.from_xml_string(task.environment)
    apply_to_simulation(task.variation("development", 3), model, mujoco.MjData(model))
    derived = ("geom_rbound", "geom_aabb", "dof_M0", "dof_invweight0")
    written = {name: getattr(model, name).copy() for name in derived}
    spec = mujoco.MjSpec.from_string(task.environment)
    for change in task.variation("development", 3).changes:
        _write(spec, change)
    compiled = spec.compile()
    for name in derived:
        assert written[name] == pytest.approx(getattr(compiled, name), rel=1e-4, abs=1e-7), name


def test_a_varied_model_misses_no_contact(task):
    """The tree of bounding volumes has to follow as well: contacts are the same with and without it."""
    spec = mujoco.MjSpec.from_string(task.environment)
    probe = spec.worldbody.add_body(name="probe")
    probe.add_freejoint()
    for shift in (-0.03, 0.0, 0.03):
        probe.add_geom(size=(0.02, 0.0, 0.0), pos=(shift, 0.0, 0.0))
    model = spec.compile()
    data = mujoco.MjData(model)
    probe_geoms = np.flatnonzero(model.geom_bodyid == model.body("probe").id)
    rng = np.random.default_rng(7)
    touching = 0
    for index in range(8):
        apply_to_simulation(task.variation("development", index), model, data)
        solid = np.flatnonzero((model.geom_contype > 0) & (model.geom_type != int(mujoco.mjtGeom.mjGEOM_PLANE)))
        near = data.geom_xpos[solid].copy() if len(solid) > 3 else np.zeros((1, 3))
        for _ in range(25):
            data.qpos[model.joint(model.body("probe").jntadr[0]).qposadr[0] :][:3] = rng.choice(near) + rng.normal(
                0, 0.02, 3
            )
            counts = []
            for flags in (0, int(mujoco.mjtDisableBit.mjDSBL_MIDPHASE)):
                model.opt.disableflags = flags
                mujoco.mj_forward(model, data)
                # only the probe's: what stands exactly on something touches it or not by a rounding error
                counts.append(int(np.isin(data.contact.geom, probe_geoms).any(axis=1).sum()))
            assert counts[0] == counts[1]
            touching += counts[0]
    assert touching > 0


def test_observations_have_the_shape_that_the_features_say(levelled):
    width = sum(feature.size for feature in levelled.features)
    for split in SPLITS:
        episode = Episode(levelled, split=split)
        for _ in range(3):
            episode.step()
            observed = levelled.observe(episode.look(), episode.state.task_state)
            assert observed.shape == (1, width)
            assert np.isfinite(observed).all()


def test_doing_nothing_does_not_succeed(task):
    episode = Episode(task)
    episode.run(task.time_limit_s)
    assert episode.data.time >= task.time_limit_s - 1e-6 or episode.score.failure[0]
    assert not episode.won
    assert 0.0 <= min(episode.progress) <= max(episode.progress) < 0.6


def test_doing_nothing_does_not_succeed_in_a_held_out_episode(levelled):
    episode = Episode(levelled, split="held_out")
    episode.run(6.0)
    assert not episode.won


def test_the_same_seed_gives_the_same_trajectory(task):
    courses = []
    for _ in range(2):
        episode = Episode(task, index=2)
        for _ in range(10):
            episode.step()
        courses.append((episode.data.qpos.copy(), tuple(episode.progress)))
    assert np.array_equal(courses[0][0], courses[1][0])
    assert courses[0][1] == courses[1][1]


def _write(spec: mujoco.MjSpec, change) -> None:
    """Write a change into the text form of a model."""
    kind, _, attribute = change.field.partition("_")
    if kind in ("qpos", "qvel"):
        return
    element = getattr(spec, "joint" if kind == "dof" else kind)(change.name)
    if change.field == "geom_type":
        element.type = mujoco.mjtGeom(int(change.value[0]))
    elif change.field in ("body_mass", "body_inertia"):
        element.explicitinertial = True
        setattr(element, attribute, change.value[0] if attribute == "mass" else change.value)
        element.ipos, element.iquat = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)
    else:
        values = change.value if len(change.value) > 1 else change.value[0]
        setattr(element, attribute, values)
