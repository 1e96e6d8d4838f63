"""Driven open-loop, each kind of body can do what its job needs: learning has a way to find."""

import math

import mujoco
import numpy as np
import pytest
from jobs import FAMILIES, brief, concept, scene

from aidsr.core.artifacts import Placement
from aidsr.tasks.reaching.pipe_inserting import DEPTH_M, INNER_M, in_pipe
from aidsr.teams.rules import team


class Drive:
    """A scene with a robot of one variant, driven by shares of each winch's greatest pull."""

    def __init__(self, task: str, family: str, variant: str) -> None:
        rules, idea = team(1), concept(task, family, variant)
        robot = rules.coder.write(brief(task), idea)
        placement: Placement = rules.integrator.place(brief(task), idea, robot)
        self.model = scene(task, robot, placement)
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)

    def actuators(self, part: str) -> list[int]:
        return [i for i in range(self.model.nu) if part in self.model.actuator(i).name]

    def pull(self, part: str, share: float) -> None:
        chosen = self.actuators(part)
        self.data.ctrl[chosen] = share * self.model.actuator_ctrlrange[chosen, 1]

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / self.model.opt.timestep)):
            mujoco.mj_step(self.model, self.data)
        assert all(warning.number == 0 for warning in self.data.warning)

    def part(self) -> np.ndarray:
        return self.data.site("robot/functional_part").xpos.copy()


@pytest.mark.parametrize(
    ("family", "variant"), [("arm", "two sections"), ("arm", "four cables"), ("tentacle", "space")]
)
def test_reaching_bodies_bend_to_all_sides(family: str, variant: str) -> None:
    made = FAMILIES[family]
    model = mujoco.MjModel.from_xml_string(made.write(made.read(concept("button_pushing", family, variant))).mjcf)
    model.opt.gravity[:] = (0.0, 0.0, 9.81)  # hanging: the robot's +z points down
    directions = []
    for winch in [i for i in range(model.nu) if "proximal" not in model.actuator(i).name]:
        data = mujoco.MjData(model)
        data.ctrl[winch] = model.actuator_ctrlrange[winch, 1]
        for _ in range(750):
            mujoco.mj_step(model, data)
        axis = data.site("tip").xmat.reshape(3, 3)[:, 2]
        assert math.degrees(math.acos(axis[2])) > 60
        directions.append(math.atan2(data.site("tip").xpos[1], data.site("tip").xpos[0]))
    gaps = np.diff([*sorted(directions), min(directions) + 2 * math.pi])
    assert max(gaps) < math.radians(150)


@pytest.mark.parametrize(
    ("family", "variant"), [("gripper", "three fingers"), ("gripper", "four fingers"), ("tentacle", "wrap")]
)
def test_grasping_bodies_lift_the_object(family: str, variant: str) -> None:
    drive = Drive("simple_grasping", family, variant)
    closing = "close" if family == "gripper" else "_curl"
    lift = drive.model.actuator("carriage_lift").id
    for height in np.linspace(0.0, -0.1, 20):
        drive.data.ctrl[lift] = height
        drive.run(0.04)
    low = float(drive.data.body("object").xpos[2])
    for share in np.linspace(0.1, 1.0, 20):
        drive.pull(closing, share)
        drive.run(0.05)
    for height in np.linspace(-0.1, 0.05, 30):
        drive.data.ctrl[lift] = height
        drive.run(0.05)
    assert float(drive.data.body("object").xpos[2]) - low > 0.10


@pytest.mark.parametrize(
    ("family", "variant", "frequency_hz"),
    [("worm", "wave", 1.0), ("crawler", "four legs, two cables", 1.8), ("ring", "six sectors", 1.2)],
)
def test_free_bodies_translate_under_some_sinusoid(family: str, variant: str, frequency_hz: float) -> None:
    drive = Drive("flat_ground", family, variant)
    winches = drive.actuators("robot/pull")
    most = drive.model.actuator_ctrlrange[winches, 1]
    drive.run(0.5)
    start, best = drive.data.subtree_com[0].copy(), 0.0
    rest = drive.data.qpos.copy()
    for seed in range(4):
        phases = np.random.default_rng(seed).uniform(0, 2 * math.pi, len(winches))
        drive.data.qpos[:], drive.data.qvel[:] = rest, 0.0
        for step in range(75):
            wave = np.sin(2 * math.pi * frequency_hz * 0.04 * step + phases)
            drive.data.ctrl[winches] = most * np.clip(0.3 + 0.7 * wave, 0.0, 1.0)
            drive.run(0.04)
        best = max(best, float(np.linalg.norm(drive.data.subtree_com[0][:2] - start[:2])))
    assert best > 0.04


def test_a_free_body_starts_on_its_feet() -> None:
    for family, variant in (("worm", "inchworm"), ("crawler", "six legs"), ("ring", "four sectors")):
        drive = Drive("flat_ground", family, variant)
        before = drive.data.subtree_com[0].copy()
        drive.run(1.0)
        assert np.linalg.norm(drive.data.subtree_com[0] - before) < 0.012
        assert drive.data.ncon >= 2


PULL = [(0, 0.03, 0), (0.04, 0.03, 0), (0.04, 0.03, 0.35), (0.03, 0.02, 0.5), (0, 0.02, 0.7)]
"""Places of the base forward and up [m], and the share of curling, one after the other."""


@pytest.mark.parametrize("share", [1.0, 0.0])
def test_a_curling_tentacle_opens_the_drawer_and_a_slack_one_does_not(share: float) -> None:
    drive = Drive("drawer_opening", "tentacle", "curl")
    for x, z, curl in PULL:
        drive.pull("_curl", share * curl)
        for _ in range(30):
            for name, goal in (("base_x", x), ("base_z", z)):
                gap = goal - float(drive.data.joint(name).qpos[0])
                drive.data.ctrl[drive.model.actuator(name).id] = np.clip(5 * gap, -0.1, 0.1)
            drive.run(0.05)
    assert (float(drive.data.joint("drawer_2").qpos[0]) > 0.06) == (share > 0.0)


INSERTS = [
    ("tentacle", "space", ("long_000",)),
    ("tentacle", "two stages", ("long_000",)),
    ("arm", "two sections", ("distal_060", "distal_300")),
    ("arm", "three sections", ("distal_080", "distal_320")),
]


@pytest.mark.parametrize("share", [0.7, 0.0])
@pytest.mark.parametrize(("family", "variant", "cables"), INSERTS)
def test_inserting_bodies_are_steered_into_the_branch_and_slack_ones_pass_it(
    family: str, variant: str, cables: tuple[str, ...], share: float
) -> None:
    drive = Drive("pipe_inserting", family, variant)
    mouth, junction_m, branch_rad = drive.data.body("pipe").xpos, np.array([0.145]), np.deg2rad([60.0])
    deepest_m = -1.0
    drive.data.ctrl[drive.model.actuator("feed").id] = 0.05
    for _ in range(100):
        drive.run(0.08)
        for cable in cables if mouth[2] - drive.part()[2] > junction_m[0] else ():
            drive.pull(cable, share)
        place = in_pipe((drive.part() - mouth)[None], junction_m, branch_rad)
        if place.beside_branch_m[0] <= INNER_M:
            deepest_m = max(deepest_m, place.branch_m[0])
    assert (deepest_m > DEPTH_M) == (share > 0.0)


def test_the_arm_presses_the_button_with_its_tip() -> None:
    drive = Drive("button_pushing", "arm", "four cables")
    travel = drive.model.joint("button_slide").qposadr[0]
    pressed, start = [], drive.data.qpos.copy()
    for seed in range(40):
        rng = np.random.default_rng(seed)
        drive.data.qpos[:], drive.data.qvel[:], drive.data.act[:] = start, 0.0, 0.0
        winches = drive.actuators("robot/pull")
        drive.data.ctrl[winches] = drive.model.actuator_ctrlrange[winches, 1] * rng.uniform(0, 1, len(winches))
        drive.run(0.8)
        pressed.append(float(drive.data.qpos[travel]))
    assert max(pressed) >= 0.005
