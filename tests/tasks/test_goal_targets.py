"""What a goal is about: the body that is meant, where it is measured, and sensors that measure something else."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from stick import Episode
from table import TABLE

from aidsr.core.artifacts import Placement, Robot
from aidsr.core.errors import MjcfError, UserError
from aidsr.learn.episodes.scene import TaskScene
from aidsr.sim.assembly import assemble
from aidsr.tasks import goal_task, parse_goal
from scenes import small_arm

GOALS = {
    "reach": 'kind = "reach"\ntarget = "hook"',
    "lift": 'kind = "lift"\ntarget = "ball"',
    "push": 'kind = "travel"\ntarget = "flag"\ndistance_m = 0.1',
    "walk": 'kind = "travel"\ndistance_m = 0.4',
    "touch": 'kind = "touch"\ntarget = "post"',
}


def made(text, *bodies):
    """The task of a goal in the table's environment with more in it."""
    return goal_task(parse_goal(text), with_more(TABLE, *bodies))


def with_more(mjcf, *elements):
    return mjcf.replace("</worldbody>", "".join(elements) + "</worldbody>")


LID = """
<body name="lid" pos="0.5 0 0.2">
  <joint name="lid" axis="0 -1 0"/>
  <geom name="lid" type="box" size="0.05 0.05 0.005" pos="0.05 0 0"/>
  <body name="rim" pos="0.1 0 0"><geom name="rim" size="0.01"/></body>
</body>"""
WHEEL = """
<body name="wheel" pos="0.5 0 0.2">
  <joint name="wheel" axis="0 1 0"/>
  <geom name="wheel" type="cylinder" size="0.05 0.01" euler="90 0 0"/>
  <body name="crank" pos="0.04 0 0"><geom name="crank" size="0.01"/></body>
</body>"""


@pytest.mark.parametrize(("target", "arm_m"), [("lid", 0.05), ("rim", 0.1)])
def test_a_lid_on_a_hinge_is_lifted_as_it_opens(target, arm_m):
    task = made(f'kind = "lift"\ntarget = "{target}"\nby_m = 0.04', LID)
    for angle, enough in ((0.95, True), (0.3, False)):
        episode = Episode(task)
        episode.data.joint("lid").qpos = angle
        mujoco.mj_forward(episode.model, episode.data)
        rise = (episode.look()["goal_position"] - episode.state.task_state["start"])[0, 2]
        assert rise == pytest.approx(arm_m * np.sin(angle))
        assert task.is_success(episode.look(), episode.state.task_state)[0] == enough


def test_a_body_that_only_turns_on_the_spot_is_refused_and_a_part_beside_its_axis_is_not():
    with pytest.raises(UserError, match=r"turns about its own centre of mass.* such as a part of it"):
        made('kind = "travel"\ntarget = "wheel"\ndistance_m = 0.01', WHEEL)
    assert (
        made('kind = "travel"\ntarget = "crank"\ndistance_m = 0.01\ndirection = [0, 0, 1]', WHEEL).goal.target
        == "crank"
    )


CUP = '<body name="cup" pos="0.5 0 0.2">{joint}<geom name="cup" size="0.03"/></body><site name="cup" pos="0 0.5 0.6"/>'


@pytest.mark.parametrize("kind", ['kind = "lift"', 'kind = "travel"\ndistance_m = 1', 'kind = "touch"'])
def test_a_body_is_meant_even_where_a_site_of_the_world_has_its_name(kind):
    cup = CUP.format(joint="<freejoint/>")
    task = made(f'{kind}\ntarget = "cup"\nvary_m = [0.1, 0, 0]', cup)
    episode = Episode(task)
    (change,) = episode.variation.changes
    assert (change.field, change.of_body) == ("qpos", True)
    at = episode.data.body("cup").xpos
    assert episode.look()["goal_offset"][0] == pytest.approx(episode.tip_m - at)
    if task.name == "goal/move":
        assert episode.look()["goal_position"][0] == pytest.approx(at)
        with pytest.raises(UserError, match="cannot move"):
            made(f'{kind}\ntarget = "cup"', CUP.format(joint=""))


def test_reaching_means_the_site_where_both_have_the_name():
    episode = Episode(made('kind = "reach"\ntarget = "cup"', CUP.format(joint="")))
    assert episode.look()["goal_offset"][0] == pytest.approx(episode.tip_m - (0.0, 0.5, 0.6))


def placed(mjcf=TABLE, sensors=()):
    """The small arm in an environment."""
    arm = Robot(mjcf=small_arm(), functional_part="tip")
    return assemble(arm, mjcf, Placement(mount="mount", base="fixed"), sensors).mjcf


FOREIGN = {
    "of another goal": (
        "lift",
        lambda: placed(sensors=made('kind = "travel"\ntarget = "cart"\ndistance_m = 0.1').sensors),
    ),
    "of the user": (
        "walk",
        lambda: placed().replace("<sensor>", '<sensor><subtreecom name="com_position" body="cart"/>'),
    ),
    "of another part": ("touch", lambda: placed(sensors=made(f'{GOALS["touch"]}\npart = "robot"').sensors)),
}


@pytest.mark.parametrize(("goal", "scene"), FOREIGN.values(), ids=FOREIGN)
def test_a_sensor_that_measures_something_else_is_refused(goal, scene):
    task, text = made(GOALS[goal]), scene()
    with pytest.raises(MjcfError, match=r"goal_|com_position.*measures something else; rename or delete it"):
        TaskScene.of(text, task)


@pytest.mark.parametrize("goal", GOALS)
def test_a_goals_own_sensors_are_found_again(goal):
    task = made(GOALS[goal])
    measured = TaskScene.of(placed(), task)
    assert TaskScene.of(measured.mjcf, replace(task, mjcf=measured.mjcf)).fingerprint == measured.fingerprint


def test_only_a_sensor_has_the_name_of_a_sensor():
    more = '<site name="goal_offset"/>', '<body name="goal_position"><geom size="0.01"/></body>'
    model = TaskScene.of(placed(with_more(TABLE, *more)), made(GOALS["lift"], *more)).model
    assert [model.sensor(name).dim[0] for name in ("goal_offset", "goal_position")] == [3, 3]


def test_an_environment_whose_sensor_has_a_name_that_is_needed_is_refused_before_anything_is_designed():
    taken = '</worldbody><sensor><subtreecom name="com_position" body="cart"/></sensor>'
    with pytest.raises(UserError, match=r'already has a sensor "com_position".* rename it'):
        goal_task(parse_goal(GOALS["walk"]), TABLE.replace("</worldbody>", taken))
    assert goal_task(parse_goal(GOALS["lift"]), TABLE.replace("</worldbody>", taken)).name == "goal/move"
