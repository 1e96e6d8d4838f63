"""What a policy knows of its own body, number by number."""

import mujoco
import numpy as np
import pytest

from aidsr.core.artifacts import Placement, Robot
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.assembly import assemble
from aidsr.tasks import load_task
from scenes import small_arm

TENSION_N = 8.0
ACTIONS = np.array([[0.5, -0.8], [-0.6, 0.9]])
HINGE = '<joint name="bend1" axis="0 1 0" stiffness="0.2" damping="0.02" range="-40 40"/>'
BALL = '<joint name="bend1" type="ball" stiffness="0.2" damping="0.02"/>'


@pytest.fixture(params=["hinges", "with a ball joint"])
def crawling(request) -> Episodes:
    """Two small arms that lie about free, each pulling its tendons otherwise, with everything under way."""
    task = load_task("flat_ground")
    arm = small_arm(TENSION_N)
    assert HINGE in arm
    robot = Robot(mjcf=arm if request.param == "hinges" else arm.replace(HINGE, BALL), functional_part="tip")
    placement = Placement(mount="mount", base="free", position_m=(0.0, 0.0, 0.05))
    scene = TaskScene.of(assemble(robot, task.environment, placement, task.sensors).mjcf, task)
    variations = [task.variation("development", index) for index in (0, 1)]
    episodes = Episodes(scene.model, task, scene.actions, variations, threads=1)
    for _ in range(4):
        episodes.step(ACTIONS)
    return episodes


def alone(episodes: Episodes, index: int) -> mujoco.MjData:
    """One of the simulations by itself."""
    data = mujoco.MjData(episodes.model)
    for field in ("qpos", "qvel", "ctrl"):
        getattr(data, field)[:] = episodes.batch.bind(field)[index]
    mujoco.mj_forward(episodes.model, data)
    return data


@pytest.mark.parametrize("index", [0, 1])
def test_a_free_robot_knows_its_whole_pose_its_tendons_and_its_forces(crawling, index):
    data = alone(crawling, index)
    free = int(crawling.model.body("robot/base").jntadr[0])
    joints = [data.joint(joint) for joint in (free, *(f"robot/bend{i}" for i in (1, 2, 3, 4)))]
    tendons = [data.tendon(f"robot/{side}") for side in ("left", "right")]
    expected = [
        (np.hstack([joint.qpos for joint in joints]), 1e-6),
        (np.hstack([joint.qvel for joint in joints]), 1e-6),
        # those of tendons are from the beginning of the last physics step
        (np.hstack([tendon.length for tendon in tendons]), 1e-3),
        (np.hstack([tendon.velocity for tendon in tendons]), 0.01),
        (-TENSION_N * (ACTIONS[index] + 1.0) / 2.0, 1e-6),
    ]
    ends = np.cumsum([len(numbers) for numbers, _ in expected])
    for (numbers, within), seen in zip(expected, np.split(crawling.observation[index], ends)[:-1], strict=True):
        assert seen == pytest.approx(numbers, abs=within)
        assert np.abs(numbers).max() > 2 * within
    assert len(crawling.observation[index]) == ends[-1] + 2 + 8
