"""Whether the verdict finds that cables and a soft body do the work, and that nothing else does."""

from dataclasses import dataclass

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="needs the extra rl")

from aidsr.core.artifacts import Placement, Robot
from aidsr.core.formatting import format_check
from aidsr.learn.episodes.plausibility import height_check, necessity_check, part_check, start_check
from aidsr.learn.episodes.policy_checks import body_checks, rollout_with_stats
from aidsr.learn.episodes.scene import TaskScene
from aidsr.mjcf.compile import compile_mjcf
from aidsr.sim.assembly import assemble
from aidsr.sim.structure import read_structure
from aidsr.tasks import Task, Variation, load_task
from aidsr.tasks.grasping import dynamic_catching
from aidsr.tasks.locomotion.base import turned_lane
from aidsr.tasks.locomotion.flat_ground import FlatGround
from scenes import Always, QuickPushing, small_arm, small_learning, small_scene

NEEDS = ("needs_cables", "needs_soft_body", "works_without_other_actuators")


def verdicts(scene: TaskScene, policy, episodes: int = 4) -> tuple[int, tuple[bool, ...]]:
    """Return how many episodes succeed, and which of the three checks hold."""
    rolled = rollout_with_stats(scene, policy, range(episodes), threads=1)
    checks = body_checks(scene, policy, rolled, threads=1)
    assert tuple(check.name for check in checks) == NEEDS
    return int(rolled.outcomes.success.sum()), tuple(check.passed for check in checks)


def at(task: Task, mjcf: str, functional_part: str, base: str) -> TaskScene:
    environment = load_task(task.name).environment
    robot = Robot(mjcf=mjcf, functional_part=functional_part)
    placement = Placement(mount="mount", base=base)
    return TaskScene.of(assemble(robot, environment, placement, task.sensors).mjcf, task)


def test_an_arm_that_its_cables_bend_passes():
    assert verdicts(small_learning(), Always(1.0, -1.0)) == (4, (True, True, True))


def with_sled(damping: float = 1.0, spring: str = "") -> str:
    """The small arm on a sled of its own, with a motor that drives it sideways."""
    motor = '<motor name="robot/drive" joint="robot/sled" gear="4" ctrlrange="-1 1"/>'
    sled = f'<joint name="robot/sled" type="slide" axis="1 0 0" damping="{damping}" {spring}/>'
    base = '<body name="robot/base"'
    text = small_scene()
    start = text.index(">", text.index(base)) + 1
    return (text[:start] + sled + text[start:]).replace("</actuator>", motor + "</actuator>")


def test_a_motor_that_does_the_work_fails_all_three():
    scene = TaskScene.of(with_sled(), QuickPushing())
    assert verdicts(scene, Always(-1.0, -1.0, 1.0)) == (4, (False, False, False))


def test_a_motor_at_rest_takes_nothing_from_an_arm_that_its_cables_bend():
    """Where it stands, the sled is held: it must not run away under the arm."""
    scene = TaskScene.of(with_sled(damping=0.0), QuickPushing())
    assert verdicts(scene, Always(1.0, -1.0, 0.0)) == (4, (True, True, True))


def test_a_spring_that_does_the_work_fails_the_first_two():
    scene = TaskScene.of(with_sled(spring='stiffness="50" springref="0.1"'), QuickPushing())
    assert verdicts(scene, Always(-1.0, -1.0, 0.0))[1][:2] == (False, False)


def test_a_cable_on_a_rigid_sled_needs_no_soft_body():
    text = with_sled().replace(
        '<motor name="robot/drive" joint="robot/sled" gear="4"',
        '<general name="robot/drive" tendon="robot/rope" gainprm="-4"',
    )
    rope = '<fixed name="robot/rope"><joint joint="robot/sled" coef="-1"/></fixed>'
    scene = TaskScene.of(text.replace("</tendon>", rope + "</tendon>"), QuickPushing())
    assert verdicts(scene, Always(-1.0, -1.0, 1.0)) == (4, (True, False, True))


TAIL = """
<body name="tail1" pos="{at}"><joint name="t1" axis="0 1 0" stiffness="{stiffness}" damping="{damping}"/>
  <geom type="capsule" size="0.006" fromto="0 0 0 {step}" mass="0.005"/><site name="c1" pos="{beside}"/>
  <body name="tail2" pos="{step}"><joint name="t2" axis="0 1 0" stiffness="{stiffness}" damping="{damping}"/>
    <geom type="capsule" size="0.006" fromto="0 0 0 {step}" mass="0.005"/><site name="c2" pos="{beside}"/>
    <body name="tail3" pos="{step}"><joint name="t3" axis="0 1 0" stiffness="{stiffness}" damping="{damping}"/>
      <geom type="capsule" size="0.006" fromto="0 0 0 {step}" mass="0.005"/><site name="c3" pos="{beside}"/>{inside}
</body></body></body>"""
PATH = "".join(f'<site site="c{i}"/>' for i in range(4))
CABLE = f'<tendon><spatial name="cable">{PATH}</spatial></tendon>'
PULL = '<general name="pull" tendon="cable" ctrlrange="0 5" gainprm="-1"/>'


def rover() -> str:
    """Four driven wheels, and a tail with a cable."""
    places = {"fl": "0.05 0.06", "fr": "0.05 -0.06", "bl": "-0.05 0.06", "br": "-0.05 -0.06"}
    wheels = "".join(
        f'<body name="{name}" pos="{place} 0.03"><joint name="{name}" axis="0 1 0" damping="0.001"/>'
        '<geom type="cylinder" size="0.03 0.01" euler="90 0 0" mass="0.05"/></body>'
        for name, place in places.items()
    )
    drives = "".join(
        f'<velocity name="{name}" joint="{name}" kv="0.05" ctrlrange="-20 20" forcerange="-1 1"/>' for name in places
    )
    tail = TAIL.format(
        at="-0.07 0 0.05", step="-0.03 0 0", beside="-0.03 0 0.01", stiffness=0.1, damping=0.01, inside=""
    )
    return f"""<mujoco><compiler angle="degree"/><worldbody><body name="chassis"><freejoint/>
<geom type="box" size="0.07 0.04 0.015" pos="0 0 0.05" mass="0.3"/><site name="c0" pos="-0.06 0 0.065"/>{wheels}{tail}
</body></worldbody>{CABLE}<actuator>{drives}{PULL}</actuator></mujoco>"""


def basket() -> str:
    """A cup on three joints with a cable; it waits for the ball."""
    angles = np.arange(8) * np.pi / 4
    walls = "".join(
        f'<geom type="box" size="0.004 0.034 0.03" pos="{0.08 * np.cos(a):.4f} {0.08 * np.sin(a):.4f} 0.04" '
        f'euler="0 0 {np.degrees(a):.0f}" mass="0.005"/>'
        for a in angles
    )
    floor = '<geom type="cylinder" size="0.08 0.004" pos="0 0 0.01" mass="0.02"/>'
    cup = f'{floor}{walls}<site name="middle" pos="0 0 0.05"/>'
    neck = TAIL.format(at="0 0 0.01", step="0 0 0.02", beside="0.01 0 0.02", stiffness=5, damping=0.5, inside=cup)
    return f"""<mujoco><compiler angle="degree"/><worldbody><body name="base">
<geom type="cylinder" size="0.02 0.005" mass="0.05"/><site name="c0" pos="0.01 0 0.01"/>{neck}
</body></worldbody>{CABLE}<actuator>{PULL}</actuator></mujoco>"""


@dataclass(frozen=True)
class StraightAhead(FlatGround):
    """Flat ground with the lane in front of a robot that cannot steer."""

    time_limit_s = 6.0

    @property
    def environment(self):
        return load_task("flat_ground").environment

    def sample_variation(self, rng):
        return Variation((turned_lane(0.0),))


def test_wheels_with_a_tail_fail_all_three():
    scene = at(StraightAhead(), rover(), "chassis", "free")
    assert verdicts(scene, Always(1.0, 1.0, 1.0, 1.0, -1.0)) == (4, (False, False, False))


def test_a_basket_that_waits_needs_neither_cables_nor_a_soft_body(monkeypatch):
    # it loses the ball where the mount turns over, and does not let go
    monkeypatch.setattr(dynamic_catching, "GONE_M", 1e-6)
    monkeypatch.setattr(dynamic_catching, "TURN_RAD", 1e-6)
    monkeypatch.setattr(dynamic_catching, "TURNED_RAD", -1.0)
    scene = at(load_task("dynamic_catching"), basket(), "middle", "fixed")
    won, held = verdicts(scene, Always(-1.0), episodes=6)
    assert won >= 4
    assert held == (False, False, True)


def test_at_most_a_tenth_of_the_successes_may_be_left():
    assert necessity_check("a", "so", 2, 20).passed
    assert not necessity_check("a", "so", 3, 20).passed
    assert not necessity_check("a", "so", 1, 4).passed
    few = necessity_check("a", "so", 3, 3)
    assert (few.passed, few.measured) == (True, None)


@pytest.mark.parametrize(("ahead_m", "passed"), [(0.0, True), (0.3, False)])
def test_a_free_robot_starts_at_its_mount(ahead_m, passed):
    robot = Robot(mjcf=rover(), functional_part="chassis")
    placement = Placement(mount="mount", base="free", position_m=(ahead_m, 0.0, 0.0))
    task = load_task("flat_ground")
    model = compile_mjcf(assemble(robot, task.environment, placement, task.sensors).mjcf)
    check = start_check(model, read_structure(model), "free")
    assert (check.name, check.passed) == ("starts_at_mount", passed)
    assert format_check(check).endswith(" of the robot's length (at most 0.5)")


@pytest.mark.parametrize(("below_m", "passed"), [(0.0, True), (0.3, False)])
def test_a_held_robot_begins_at_its_mount(below_m, passed):
    robot = Robot(mjcf=small_arm(), functional_part="tip")
    placement = Placement(mount="mount", base="fixed", position_m=(0.0, 0.0, below_m))
    task = load_task("pipe_inserting")
    model = compile_mjcf(assemble(robot, task.environment, placement, task.sensors).mjcf)
    assert start_check(model, read_structure(model), "moving").passed == passed


@pytest.mark.parametrize(
    ("name", "placed", "words"),
    [("obstacles", "fixed", "held by its surroundings"), ("button_pushing", "free", "free, and")],
)
def test_a_robot_is_held_as_its_task_asks(name, placed, words):
    robot = Robot(mjcf=small_arm(), functional_part="tip")
    task = load_task(name)
    model = compile_mjcf(assemble(robot, task.environment, Placement(mount="mount", base=placed), task.sensors).mjcf)
    check = start_check(model, read_structure(model), task.base)
    assert (check.name, check.passed, check.measured) == ("starts_at_mount", False, None)
    assert words in check.message
    assert start_check(model, read_structure(model), "any").passed


def test_a_robot_may_start_anywhere_where_there_is_no_mount():
    model = compile_mjcf(small_arm())
    check = start_check(model, read_structure(model), "any")
    assert (check.passed, check.measured) == (True, 0.0)


@pytest.mark.parametrize(
    ("name", "part", "passed"),
    [("button_pushing", "tip", True), ("button_pushing", "base", False), ("surface_adapting", "base", True)],
)
def test_a_hub_that_carries_all_is_no_functional_part_where_only_its_touch_counts(name, part, passed):
    task, robot = load_task(name), Robot(mjcf=small_arm(), functional_part=part)
    placement = Placement(mount="mount", base="fixed")
    model = compile_mjcf(assemble(robot, task.environment, placement, task.sensors).mjcf)
    assert part_check(model, read_structure(model), task.sensors).passed == passed


@pytest.mark.parametrize(("raised_m", "passed"), [(0.0, True), (0.6, False)])
def test_a_robot_that_travels_starts_low(raised_m, passed):
    mast = f'<geom type="capsule" size="0.005" mass="0.01" fromto="0 0 0 0 0 {raised_m + 0.01}"/>'
    text = rover().replace("<freejoint/>", f"<freejoint/>{mast}", 1)
    assert text != rover()
    task = load_task("flat_ground")
    robot = Robot(mjcf=text, functional_part="chassis")
    model = compile_mjcf(assemble(robot, task.environment, Placement(mount="mount", base="free"), task.sensors).mjcf)
    check = height_check(model, read_structure(model))
    assert (check.name, check.passed) == ("starts_low", passed)
