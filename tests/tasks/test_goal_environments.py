"""Environments with many joints, carried shapes, a carried mount or odd time steps, and bodies that go to and fro."""

import pytest

from aidsr.core.errors import UserError
from aidsr.sim.mechanism import farthest_m
from aidsr.tasks import goal_task, parse_goal


def made(goal, mjcf):
    return goal_task(parse_goal(goal), mjcf)


def chain(joints):
    """A straight chain of slides along x, each with 10 mm of way, of which the last body is to be moved."""
    inner = '<geom size="0.01"/>'
    for number in reversed(range(joints)):
        slide = f'<joint name="x{number}" type="slide" axis="1 0 0" range="0 0.01" damping="1"/>'
        geom = '<geom size="0.01" mass="0.01" contype="0" conaffinity="0"/>'
        inner = f'<body name="link{number}">{slide}{geom}{inner}</body>'
    return f'<mujoco><option gravity="0 0 0"/><worldbody><site name="mount" pos="0 0 1"/>{inner}</worldbody></mujoco>'


@pytest.mark.parametrize("joints", [1, 2, 3, 4, 5, 6, 9, 10, 12])
def test_a_body_gets_as_far_as_all_of_its_joints_together(joints):
    mjcf = chain(joints)
    assert farthest_m(mjcf, f"link{joints - 1}", (1.0, 0.0, 0.0)) == pytest.approx(0.01 * joints)
    assert made(f'kind = "travel"\ntarget = "link{joints - 1}"\ndistance_m = {0.01 * joints}', mjcf)


def test_of_more_joints_than_can_be_sampled_nothing_is_refused():
    assert farthest_m(chain(20), "link19", (1.0, 0.0, 0.0)) == float("inf")


SHELL = """
<mujoco>
  <worldbody>
    <site name="mount" pos="0 0 0.5"/>
    <body name="knob" pos="0.2 0 0.3">
      <joint name="stem" axis="0 0 1" damping="0.01"/><geom size="0.005" mass="0.01" contype="0" conaffinity="0"/>
      <body name="axle"><body name="shell"><geom size="0.02" mass="0.05"/></body></body>
    </body>
  </worldbody>
</mujoco>"""


@pytest.mark.parametrize(
    "goal",
    [
        'kind = "touch"\ntarget = "knob"',
        'kind = "turn"\njoint = "stem"\nby_deg = 30\ntarget = "knob"',
        'kind = "reach"\ntarget = "shell"\n[[limits]]\nkind = "force"\non = "knob"\nat_most_n = 1',
    ],
)
def test_a_target_whose_shape_is_that_of_a_carried_body_is_refused_and_that_body_is_named(goal):
    with pytest.raises(UserError, match=r'"knob" has no solid shape of its own.*name its body "shell"'):
        made(goal, SHELL)
    made(goal.replace('"knob"', '"shell"'), SHELL)


def test_what_a_joint_turns_is_touched_at_its_first_solid_body():
    assert made('kind = "turn"\njoint = "stem"\nby_deg = 30', SHELL).goal.target == "shell"
    assert (
        made('kind = "turn"\njoint = "stem"\nby_deg = 30', SHELL.replace('contype="0" conaffinity="0"', "")).goal.target
        == "knob"
    )


BENCH = """
<mujoco>
  <worldbody>
    <body name="bench"><geom type="box" size="0.3 0.3 0.02" pos="0 0 -0.02"/>
      <site name="mount" pos="0 0 0.5" euler="180 0 0"/>
      <body name="bell" pos="0.1 0 0.03"><geom name="bell" size="0.02"/></body>
    </body>
  </worldbody>
</mujoco>"""


def test_a_target_that_stands_with_the_mount_on_one_body_is_not_varied():
    varied = 'kind = "touch"\ntarget = "bell"\nvary_m = [0.02, 0, 0]'
    with pytest.raises(UserError, match=r'vary_m: "bench" carries the mount too, .*put "bell" on a body of its own'):
        made(varied, BENCH)
    made(varied.replace("vary_m", "base = 'free'\nvary_m"), BENCH)
    apart = BENCH.replace('<body name="bell"', '</body><body name="bell"').replace("</body>\n    </body>", "</body>")
    assert [place.name for place in made(varied, apart).places] == ["bell"]


TO_AND_FRO = """
kind = "stages"
time_limit_s = 20
[[stages]]
kind = "bring"
targets = ["cart"]
[stages.region]
center_m = [0.1, 0, 0.03]
size_m = [0.02, 0.02, 0.02]
[[stages]]
kind = "bring"
targets = ["cart"]
[stages.region]
center_m = [0, 0, 0.03]
size_m = [0.02, 0.02, 0.02]
"""
RAIL = """
<mujoco>
  <worldbody>
    <site name="mount" pos="0 0 0.5" euler="180 0 0"/>
    <body name="cart" pos="0 0 0.03">
      <joint name="rail" type="slide" axis="1 0 0" range="-0.2 0.2" damping="1"/><geom size="0.02" mass="0.1"/>
    </body>
  </worldbody>
</mujoco>"""


def test_only_the_first_stage_can_be_met_at_the_start():
    assert made(TO_AND_FRO, RAIL)
    there = TO_AND_FRO.replace("[0.1, 0, 0.03]", "[0.0, 0, 0.03]")
    with pytest.raises(UserError, match="the goal is met before anything moves: cart"):
        made(there, RAIL)


STEP = '<option timestep="{}"/>'
REACH = 'kind = "lift"\ntarget = "ball"'
ROOM = """
<mujoco>{}
  <worldbody>
    <geom type="plane" size="1 1 1"/><site name="mount" pos="0 0 0.5" euler="180 0 0"/>
    <body name="ball" pos="0 0 0.02"><freejoint/><geom size="0.02"/></body>
  </worldbody>
</mujoco>"""


@pytest.mark.parametrize("step_s", [0.005, 0.0025, 0.002, 0.0016, 0.00133333, 0.001])
def test_time_steps_that_divide_the_control_step(step_s):
    assert made(REACH, ROOM.format(STEP.format(step_s)))


@pytest.mark.parametrize(("step_s", "cure"), [(0.003, "0.002"), (0.0015, "0.001"), (0.0022, "0.002")])
def test_a_time_step_that_does_not_divide_the_control_step_is_refused(step_s, cure):
    said = f"the time step {step_s:g} s does not divide the control step of 0.04 s; use {cure}"
    with pytest.raises(UserError, match=said):
        made(REACH, ROOM.format(STEP.format(step_s)))
