"""How an action of a policy becomes controls."""

from typing import get_args

import numpy as np
import pytest

from aidsr.core.artifacts import ActuatorGroup
from aidsr.core.errors import UserError
from aidsr.learn.episodes.actions import map_actions, recorded_actions
from aidsr.learn.episodes.scene import TaskScene
from aidsr.mjcf.compile import compile_mjcf
from aidsr.sim.assembly import assemble
from aidsr.tasks import TASKS, Level, load_task
from aidsr.teams.rules import team
from scenes import builtin_scene, small_arm, small_learning, small_scene


def test_an_action_of_minus_one_to_one_spans_the_control_range():
    actions = small_learning().actions
    assert actions.size == 2
    assert np.allclose(actions.ctrl(np.array([[-1.0, 1.0], [0.0, 0.5], [-7.0, 7.0]])), [[0, 8], [4, 6], [0, 8]])


def test_an_episode_rests_where_controls_are_nearest_to_zero():
    assert np.allclose(small_learning().actions.rest, [-1.0, -1.0])
    pipe = load_task("pipe_inserting")
    actions = map_actions(compile_mjcf(builtin_scene("pipe_inserting")), pipe)
    assert actions.rest[-1] == pytest.approx(0.0)


def test_the_base_that_the_policy_drives_comes_last_and_scripted_ones_never():
    actions = map_actions(compile_mjcf(builtin_scene("pipe_inserting")), load_task("pipe_inserting"))
    assert actions.groups[-1].actuators == ("feed",)
    assert (actions.low[-1], actions.high[-1]) == (-0.05, 0.05)
    gripper = map_actions(compile_mjcf(builtin_scene("simple_grasping", 1)), load_task("simple_grasping"))
    assert all(name.startswith("robot/") for group in gripper.groups for name in group.actuators)


def test_symmetric_fingers_act_together_where_nobody_says_otherwise():
    task = load_task("simple_grasping")
    model = compile_mjcf(builtin_scene(task.name, 1))
    together, apart = map_actions(model, task), map_actions(model, task, grouping="off")
    assert (together.groups_from, apart.groups_from) == ("symmetry", "none")
    assert together.size < apart.size == len(apart.actuators) == len(together.actuators)
    ctrl = together.ctrl(np.linspace(-1.0, 1.0, together.size)[None])[0]
    for k, group in enumerate(together.groups):
        members = [value for value, follows in zip(ctrl, together.follows, strict=True) if follows == k]
        assert len(members) == len(group.actuators) > 1
        assert np.ptp(members) == pytest.approx(0.0)


def test_symmetric_legs_of_a_free_robot_stay_apart():
    task = load_task("flat_ground")
    actions = map_actions(compile_mjcf(builtin_scene(task.name)), task)
    assert actions.groups_from == "none"
    assert actions.size == len(actions.actuators)


def test_declared_groups_are_taken_with_or_without_the_prefix():
    group = ActuatorGroup(name="both", actuators=("pull_left", "robot/pull_right"))
    actions = small_learning(groups=[group]).actions
    assert actions.groups_from == "design"
    assert [one.name for one in actions.groups] == ["both"]
    assert np.allclose(actions.ctrl(np.array([[0.5]])), [[6.0, 6.0]])
    assert small_learning(groups=[group], grouping="off").actions.size == 2


def alone(model) -> list[ActuatorGroup]:
    """Each actuator of a robot as a group of its own."""
    names = [model.actuator(i).name for i in range(model.nu)]
    return [ActuatorGroup(name=f"only {name}", actuators=(name,)) for name in names if name.startswith("robot/")]


@pytest.mark.parametrize("way", ["symmetry", "alone", "off"])
def test_actions_are_made_again_from_their_record_whoever_grouped_them(way):
    task = load_task("simple_grasping")
    model = compile_mjcf(builtin_scene(task.name, 1))
    groups = alone(model) if way == "alone" else []
    actions = map_actions(model, task, groups, "off" if way == "off" else "auto")
    again = recorded_actions(model, actions.groups, actions.groups_from)
    assert (again.groups, again.groups_from) == (actions.groups, actions.groups_from)
    assert (again.actuators, again.follows) == (actions.actuators, actions.follows)
    assert np.array_equal(again.low, actions.low)
    assert np.array_equal(again.high, actions.high)


def test_a_record_of_another_robot_is_refused():
    record = map_actions(compile_mjcf(builtin_scene("simple_grasping", 1)), load_task("simple_grasping")).groups
    with pytest.raises(UserError, match="it has robot/pull_left, robot/pull_right"):
        small_learning().with_actions(record, "design")


@pytest.mark.parametrize(
    ("members", "said"),
    [(("pull_left", "pull_up"), "pull_up"), (("pull_left", "pull_left"), "in another group")],
)
def test_groups_that_do_not_fit_are_refused(members, said):
    with pytest.raises(UserError, match=said):
        small_learning(groups=[ActuatorGroup(name="odd", actuators=members)])


def test_an_actuator_without_a_range_cannot_be_driven():
    boundless = '<general name="turn" joint="bend1" ctrllimited="false"/>'
    scene = small_scene(third=boundless)
    assert boundless.split()[1] in small_arm(third=boundless)
    with pytest.raises(UserError, match="robot/turn"):
        TaskScene.of(scene, "button_pushing")


def test_a_scene_of_another_task_is_refused_with_what_it_lacks():
    with pytest.raises(UserError, match="object_push"):
        TaskScene.of(small_scene(), "simple_grasping")


def test_a_scene_of_another_level_is_refused_with_what_differs():
    assert TaskScene.of(small_scene(), "button_pushing").task.level == "standard"
    with pytest.raises(UserError, match=r"level hard: joint button_slide has springref -0\.0025, not -0\.0833333"):
        TaskScene.of(small_scene(), "button_pushing", level="hard")


@pytest.mark.parametrize("level", get_args(Level))
@pytest.mark.parametrize("name", [name for name in TASKS if load_task(name).edits])
def test_a_scene_of_its_own_level_is_taken(name, level):
    """Assembly writes the environment anew; its measures are read from that."""
    task = load_task(name, level)
    brief, roles = task.brief(), team(1)
    concept = roles.designer.propose(brief, 1)[0]
    robot = roles.coder.write(brief, concept)
    scene = assemble(robot, brief.environment, roles.integrator.place(brief, concept, robot), task.sensors)
    assert TaskScene.of(scene.mjcf, name, level=level).task == task
