"""Whether MuJoCo Warp could run a scene, and what it lacks where it could not."""

import mujoco
import pytest

from aidsr.learn.episodes.warp import warp_lacks, warp_sentence
from aidsr.tasks import TASKS, load_task


@pytest.mark.parametrize("name", TASKS)
def test_the_benchmarks_environments_could_run_but_where_shapes_differ(name):
    task = load_task(name)
    model = mujoco.MjModel.from_xml_string(task.environment)
    differ = ("geom_type that differs between simulations",) if name == "grasping/simple_grasping" else ()
    assert warp_lacks(model, task) == differ


def test_the_sentence_names_what_is_lacking():
    task = load_task("simple_grasping")
    model = mujoco.MjModel.from_xml_string(task.environment)
    assert warp_sentence(model, task) == (
        "MuJoCo Warp does not support geom_type that differs between simulations, which this scene uses; "
        "simulate it on processors"
    )
    task = load_task("flat_ground")
    assert warp_sentence(mujoco.MjModel.from_xml_string(task.environment), task).endswith(
        "supports all that this scene uses"
    )


@pytest.mark.parametrize(
    ("changed", "lacks"),
    [
        ({"solver": int(mujoco.mjtSolver.mjSOL_PGS)}, ("mjSOL_PGS",)),
        ({"enableflags": int(mujoco.mjtEnableBit.mjENBL_FWDINV)}, ("mjENBL_FWDINV",)),
        (
            {"noslip_iterations": 3, "integrator": int(mujoco.mjtIntegrator.mjINT_DISCRETE)},
            ("noslip iterations with mjINT_DISCRETE",),
        ),
        ({"noslip_iterations": 3}, ()),
    ],
)
def test_options_that_warp_lacks_are_named(changed, lacks):
    task = load_task("button_pushing")
    model = mujoco.MjModel.from_xml_string(task.environment)
    for field, value in changed.items():
        setattr(model.opt, field, value)
    assert warp_lacks(model, task) == lacks


def test_kinds_of_elements_that_warp_lacks_are_named():
    task = load_task("button_pushing")
    model = mujoco.MjModel.from_xml_string(task.environment)
    model.sensor_type[0] = int(mujoco.mjtSensor.mjSENS_PLUGIN)
    assert warp_lacks(model, task) == ("mjSENS_PLUGIN",)
