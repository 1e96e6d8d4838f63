"""The target of a goal as a ghost in the view."""

import math
from typing import Any

import mujoco
import numpy as np
import pytest

from aidsr.apps.web.view3d.parts import list_parts
from aidsr.apps.web.view3d.target import Target
from aidsr.examples import examples
from aidsr.tasks import TASKS, load_task
from aidsr.tasks.goals.reading import parse_goal

WORLD = """<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 .1"/>
    <site name="hook" pos="0.1 0.2 0.3"/>
    <body name="box" pos="0.3 0 0.05"><freejoint/><geom name="cube" type="box" size=".02 .02 .02"/></body>
    <body name="drawer" pos="0 0.4 0.1"><joint name="slide" type="slide" axis="0 1 0"/>
      <geom name="front" type="box" size=".05 .01 .03"/>
      <body name="handle" pos="0 -0.02 0"><geom name="grip" size=".01"/></body></body>
    <body name="lid" pos="-0.3 0 0.1"><joint name="hinge" axis="0 1 0"/><geom name="plate" type="box" size=".1 .05 .005" pos="-.1 0 0"/></body>
  </worldbody>
</mujoco>"""  # noqa: E501

ROBOT = '<body name="robot/base" pos="0 0 2"><geom size="0.01"/></body></worldbody>'


def shapes(goal: str, world: str = WORLD) -> list[dict[str, Any]]:
    model = mujoco.MjModel.from_xml_string(world.replace("</worldbody>", ROBOT))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return Target(model, data, list_parts(model, data), 0.5).shapes(parse_goal(goal))


def places(goal: str) -> dict[str, list[float]]:
    return {shape["name"]: pytest.approx(shape["pose"][:3], abs=1e-5) for shape in shapes(goal)}  # type: ignore[misc]


def test_bodies_stand_where_they_have_to_come_to() -> None:
    assert places('kind = "lift"\ntarget = "box"\nby_m = 0.1') == {"cube": [0.3, 0, 0.15]}
    pulled = places('kind = "travel"\ntarget = "handle"\ndistance_m = 0.08\ndirection = [0, -2, 0]')
    assert pulled == {"front": [0, 0.32, 0.1], "grip": [0, 0.3, 0.1]}
    (plate,) = shapes('kind = "turn"\njoint = "hinge"\nby_deg = 90')
    assert plate["pose"][:3] == pytest.approx([-0.3, 0, 0.2], abs=1e-5)
    (opened,) = shapes('kind = "lift"\ntarget = "lid"\nby_m = 0.05')
    assert opened["pose"][2] - 0.1 == pytest.approx(0.05, abs=0.002), "by the least angle that raises its middle so far"
    assert math.degrees(math.asin((opened["pose"][2] - 0.1) / 0.1)) == pytest.approx(30, abs=1)


def test_points_regions_and_paths_are_drawn_as_they_are_measured() -> None:
    (ball,) = shapes('kind = "reach"\ntarget = "hook"\nwithin_m = 0.03')
    assert (ball["shape"], ball["size"][0], ball["pose"][:3]) == ("sphere", 0.03, [0.1, 0.2, 0.3])
    _, arrow = shapes('kind = "pose"\ntarget = "hook"\ndirection = [0, 0, -1]')
    assert arrow["pose"][2] > 0.3, "it points down, from above, to the target"
    (box,) = shapes('kind = "bring"\ntargets = ["box"]\nregion = { at = "drawer", size_m = [0.1, 0.2, 0.3] }')
    assert (box["shape"], box["size"], box["pose"][:3]) == ("box", [0.05, 0.1, 0.15], [0, 0.4, 0.1])
    line = shapes('kind = "follow"\npath_m = [[0, 0, 0], [0.2, 0, 0], [0.2, 0, 0.1]]')
    assert [piece["size"][2] for piece in line] == pytest.approx([0.1, 0.05])
    np.testing.assert_allclose(np.reshape(line[0]["pose"][3:], (3, 3))[:, 2], [1, 0, 0], atol=1e-9)
    staged = (
        'kind = "stages"\n[[stages]]\nkind = "touch"\ntarget = "handle"\n[[stages]]\nkind = "reach"\ntarget = "hook"'
    )
    assert [shape["name"] for shape in shapes(staged)] == ["grip", ""]


def test_a_scene_without_what_the_goal_names_has_no_ghost() -> None:
    assert shapes('kind = "reach"\ntarget = "elsewhere"') == []
    assert shapes('kind = "lift"\ntarget = "elsewhere"') == []
    assert shapes('kind = "turn"\njoint = "elsewhere"\nby_deg = 9') == []


@pytest.mark.parametrize("name", [name for name, each in examples().items() if each.goal])
def test_every_example_has_a_target_to_be_seen(name: str) -> None:
    example = examples()[name]
    assert shapes(example.goal, example.environment)


WITHOUT = ("grasping/zero_gravity_grasping", "manipulation/crank_turning")
"""A ball is kept wherever it drifts; which way the crank turns is told to the policy and stands in no scene."""


def marked(task: str) -> list[dict[str, Any]]:
    asked = load_task(task)
    model = mujoco.MjModel.from_xml_string(asked.environment.replace("</worldbody>", ROBOT))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    finder = Target(model, data, list_parts(model, data), 0.5)
    return [shape for mark in asked.target for shape in finder.marked(mark)]


@pytest.mark.parametrize("task", TASKS)
def test_every_task_of_the_benchmark_with_a_target_marks_it(task: str) -> None:
    asked = load_task(task)
    assert bool(asked.target) == (task not in WITHOUT)
    assert bool(marked(task)) == bool(asked.target), "each mark names something of the environment"


def test_marks_of_tasks_are_where_success_is_measured() -> None:
    (cube,) = marked("grasping/simple_grasping")
    assert cube["pose"][:3] == pytest.approx([0, 0, 0.435 + 0.10], abs=1e-5)
    cap = marked("reaching/button_pushing")[0]
    unmoved = next(shape for shape in facts_of("reaching/button_pushing") if shape["name"] == "button_cap")
    assert math.dist(cap["pose"][:3], unmoved["pose"][:3]) == pytest.approx(0.005, abs=1e-5)
    (ball,) = marked("reaching/pipe_inserting")
    # from the middle of the mouth down to the junction and 0.10 m out, 60 degrees from straight down
    junction_m = 0.185 - 0.08 * math.cos(math.radians(60))
    along = [0.10 * math.sin(math.radians(60)), 0.0, 0.4 - junction_m - 0.10 * math.cos(math.radians(60))]
    assert ball["pose"][:3] == pytest.approx(along, abs=1e-3)
    (exit_,) = marked("locomotion/tunnel")
    assert exit_["pose"][:3] == pytest.approx([0.35 + 0.60 + 0.03, 0, 0.05], abs=1e-5)
    fronts = [shape for shape in marked("manipulation/drawer_opening") if shape["name"].endswith("_front")]
    assert [shape["pose"][0] for shape in fronts] == pytest.approx([0.25 + 0.037 - 0.06] * 3, abs=1e-5)


def facts_of(task: str) -> list[dict[str, Any]]:
    model = mujoco.MjModel.from_xml_string(load_task(task).environment.replace("</worldbody>", ROBOT))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return list_parts(model, data).facts
