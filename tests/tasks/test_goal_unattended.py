"""An environment is played without a robot: what is inside of something, is stopped, or moves by itself."""

import pytest

from aidsr.core.errors import UserError
from aidsr.examples import examples
from aidsr.tasks import goal_task, parse_goal
from aidsr.tasks.goals.unattended import remarks

LEVER = """<mujoco><option timestep="0.002" integrator="implicitfast" cone="elliptic"/>
<default><geom priority="1" {contact}/></default><worldbody>
<body name="lever" pos="0 0 0.3"><joint name="pin" axis="0 0 1" range="-100 100" damping="0.01" frictionloss="{held}"/>
  <geom name="lever" type="capsule" fromto="0 0 0 0.1 0 0" size="0.008" mass="0.05"/></body>
<geom name="pipe" type="cylinder" size="0.02 0.1" pos="{pipe}"/></worldbody></mujoco>"""
STIFF, SOFT = 'solref="0.004 1"', 'solref="0.5 1" solimp="0 0.1 0.1"'
ASIDE = "0.02 0.09 0.3"


def lever(contact=STIFF, pipe=ASIDE, held=0.02, pin=""):
    text = LEVER.format(contact=contact, pipe=pipe, held=held)
    return text.replace('<joint name="pin"', f'<joint name="pin" {pin}')


def turn(by_deg, mjcf, **keys):
    more = "".join(f"\n{key} = {value}" for key, value in keys.items())
    return goal_task(parse_goal(f'kind = "turn"\njoint = "pin"\nby_deg = {by_deg}{more}'), mjcf)


def test_a_lever_that_meets_a_pipe_is_refused_and_the_other_way_is_not():
    with pytest.raises(UserError, match=r'"lever" cannot go all the way: it meets pipe after (59|60|61) of 85 deg'):
        turn(85, lever())
    assert remarks(turn(50, lever()).unattended) == ()
    assert remarks(turn(-85, lever()).unattended) == ()


def test_what_a_press_gets_through_is_told_and_not_refused():
    (said,) = remarks(turn(85, lever(SOFT)).unattended)
    assert said.startswith("lever meets pipe after 60 of 85 deg; 5 N press it on")


def test_a_tolerance_that_ends_before_the_obstacle_is_met():
    assert remarks(turn(85, lever(), within_deg=30).unattended) == ()


def test_a_target_inside_of_something_is_refused():
    with pytest.raises(UserError, match=r'"lever" stands \d+(\.\d+)? mm inside of pipe at the start'):
        turn(-85, lever(pipe="0.06 0.01 0.3"))


def test_what_stands_in_the_way_in_some_variations_is_told():
    said = remarks(turn(55, lever(), vary_m=[0.0, 0.03, 0.0]).unattended)
    assert len(said) >= 1
    assert all(" of 4 variations that were tried." in each for each in said)


def test_what_moves_by_itself_is_told():
    sprung = lever(held=0, pin='stiffness="0.05" springref="40"').replace('springref="40"', 'springref="40" ref="0"')
    (said,) = remarks(turn(50, sprung).unattended)
    assert said.startswith("Lever goes ")
    assert "its hinge turns by " in said


def test_a_slide_is_swept_by_the_way_of_its_body():
    panel = """<mujoco><option timestep="0.002"/><default><geom priority="1" solref="0.004 1"/></default><worldbody>
      <body name="switch" pos="0 0 0.3"><joint name="press" type="slide" axis="1 0 0" range="0 0.02" damping="1"/>
        <geom name="switch" type="box" size="0.006 0.01 0.01" mass="0.02"/></body>
      <geom name="back" type="box" size="0.005 0.05 0.05" pos="0.015 0 0.3"/></worldbody></mujoco>"""
    text = 'kind = "travel"\ntarget = "switch"\ndistance_m = {}\ndirection = [1, 0, 0]'
    with pytest.raises(UserError, match=r"it meets back after 4(\.\d+)? of 10 mm"):
        goal_task(parse_goal(text.format(0.01)), panel)
    assert remarks(goal_task(parse_goal(text.format(0.003)), panel).unattended) == ()


def test_an_environment_that_breaks_down_by_itself_is_refused():
    wild = lever(held=0, pin='stiffness="-500" springref="1"')
    with pytest.raises(UserError, match=r"the environment breaks down by itself after 0\.\d+ s"):
        turn(-50, wild.replace('range="-100 100" ', ""))


@pytest.mark.parametrize("name", examples())
def test_every_example_rests_and_has_its_way_clear(name):
    example = examples()[name]
    assert remarks(goal_task(parse_goal(example.goal), example.environment).unattended) == ()


BLOCK = """<mujoco><worldbody><geom name="floor" type="plane" size="2 2 0.1"/>
<body name="block" pos="0.25 0 0.3">{joint}<geom name="case" type="box" size="0.05 0.06 0.07" mass="1"/></body>
{site}</worldbody></mujoco>"""
IN_THE_BLOCK = '<site name="spot" pos="0.25 0 0.3"/>'


def reach(base, mjcf, within_m=0.02):
    return goal_task(parse_goal(f'kind = "reach"\ntarget = "spot"\nbase = "{base}"\nwithin_m = {within_m}'), mjcf)


@pytest.mark.parametrize("base", ["fixed", "free"])
def test_a_point_inside_of_something_solid_is_refused_before_anything_is_designed(base):
    with pytest.raises(UserError, match=r'"spot" cannot be reached: it lies 50 mm inside of case, which is solid'):
        reach(base, BLOCK.format(joint="", site=IN_THE_BLOCK))


def test_a_corner_of_a_path_inside_of_something_fixed_is_refused_where_the_functional_part_follows():
    goal = 'kind = "follow"\npath_m = [[0.1, 0, 0.3], {}]\nwithin_m = {}'
    fixed = BLOCK.format(joint="", site="")
    with pytest.raises(UserError, match=r"its point \(0.25, 0, 0.3\) m lies 50 mm inside of case, which is solid"):
        goal_task(parse_goal(goal.format([0.25, 0, 0.3], 0.02)), fixed)
    assert goal_task(parse_goal(goal.format([0.21, 0, 0.3], 0.02)), fixed)
    assert goal_task(parse_goal(goal.format([0.25, 0, 0.3], 0.06)), fixed)
    free = BLOCK.format(joint="<freejoint/>", site="")
    assert goal_task(parse_goal(goal.format([0.25, 0, 0.3], 0.02)), free), "it may be pushed aside"


def test_a_shape_of_the_world_without_a_name_is_told_by_its_number():
    wall = '<mujoco><worldbody><geom type="box" size="0.05 0.06 0.07" pos="0.25 0 0.3"/>{}</worldbody></mujoco>'
    with pytest.raises(UserError, match="it lies 50 mm inside of geom 0 of the world, which is solid"):
        reach("fixed", wall.format(IN_THE_BLOCK))


def test_a_point_under_the_surface_by_less_than_is_near_enough_is_not():
    at_the_face = IN_THE_BLOCK.replace("0.25", "0.21")
    assert reach("free", BLOCK.format(joint="", site=at_the_face))
    assert reach("free", BLOCK.format(joint="", site=IN_THE_BLOCK), within_m=0.06)


def test_a_point_in_what_may_be_pushed_aside_is_not():
    assert reach("free", BLOCK.format(joint="<freejoint/>", site=IN_THE_BLOCK))


def test_the_middle_of_what_can_move_is_reached_by_a_hand_that_closes_around_it_where_it_is_small():
    goal = parse_goal('kind = "reach"\ntarget = "block"')
    loose = BLOCK.format(joint="<freejoint/>", site="")
    assert goal_task(goal, loose)
    with pytest.raises(UserError, match=r'"block" cannot be reached: it lies 100 mm inside of case'):
        goal_task(goal, loose.replace("0.05 0.06 0.07", "0.1 0.11 0.12"))
