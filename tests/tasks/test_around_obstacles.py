"""The obstacles can be won: a crawler of the built-in rules gets around them by a trot that it steers."""

import mujoco
import numpy as np

from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.assembly import assemble
from aidsr.tasks import load_task
from aidsr.teams.rules import team

FREQUENCY_HZ, BACK_LAG_RAD = 2.0, np.deg2rad(163.0)
"""Of the trot, found by trying 120 at random for 4 s on a development episode."""
TURNING = 1.5
"""How much slower the legs of one side step for each radian that the robot looks the other way."""


def crawler_scene() -> TaskScene:
    task, rules = load_task("obstacles"), team(0)
    brief = task.brief()
    (idea,) = (each for each in rules.designer.propose(brief, 4) if "four legs, two cables" in each.name)
    robot = rules.coder.write(brief, idea)
    placement = rules.integrator.place(brief, idea, robot)
    return TaskScene.of(assemble(robot, task.environment, placement, task.sensors).mjcf, task, grouping="off")


class Trot:
    """Diagonal legs step together; where the way leads to one side, the legs of that side step less or backwards."""

    def __init__(self, episodes: Episodes) -> None:
        names = [group.name.removeprefix("robot/pull_") for group in episodes.actions.groups]
        diagonal = [name.startswith(("left_front", "right_rear")) for name in names]
        self.phase_rad = np.where(diagonal, 0.0, np.pi)
        self.back = np.array([name.endswith("_back") for name in names])
        self.left = np.array([name.startswith("left") for name in names])
        self.episodes, self.steps = episodes, 0
        self.turns_m = np.array([v.parameters["turns_m"] for v in episodes.variations]).reshape(episodes.n, -1, 2)
        model = episodes.model
        self.pose = int(model.jnt_qposadr[np.flatnonzero(model.jnt_type == int(mujoco.mjtJoint.mjJNT_FREE))[0]])

    def act(self) -> np.ndarray:
        pose = self.episodes.batch.bind("qpos")[:, self.pose : self.pose + 7]
        x, y, _, w, i, j, k = pose.T
        yaw_rad = np.arctan2(2 * (w * k + i * j), 1 - 2 * (j**2 + k**2))
        goal_m = np.tile((1.4, 0.0), (len(pose), 1))
        for number in (1, 0):
            turn_m = self.turns_m[:, number]
            goal_m = np.where((x < turn_m[:, 0])[:, None], turn_m, goal_m)
        wanted_rad = np.arctan2(goal_m[:, 1] - y, np.maximum(goal_m[:, 0] - x, 0.06))
        turn = np.clip(TURNING * (wanted_rad - yaw_rad), -1.5, 1.5)[:, None]
        stride = 1.0 - np.maximum(np.where(self.left, turn, -turn), 0.0)
        lag_rad = np.where(self.back, np.where(stride >= 0, BACK_LAG_RAD, -BACK_LAG_RAD), 0.0)
        time_s = self.steps * self.episodes.task.control_dt_s
        self.steps += 1
        return np.abs(stride) * np.sin(2 * np.pi * FREQUENCY_HZ * time_s + self.phase_rad + lag_rad)


def test_a_crawler_that_steers_gets_around_the_obstacles_on_either_side():
    scene = crawler_scene()
    drawn = [scene.task.variation("held_out", index) for index in range(4)]
    sides = {np.sign(variation.parameters["turns_m"][1]) for variation in drawn}
    assert sides == {-1.0, 1.0}
    episodes = Episodes(scene.model, scene.task, scene.actions, drawn, threads=1)
    trot, won = Trot(episodes), np.zeros(len(drawn), dtype=bool)
    for _ in range(500):
        won |= episodes.step(trot.act()).success
    assert won.all()
