"""What is known of a goal and its environment before any body is tried."""

import pytest

from aidsr.examples import examples
from aidsr.tasks import goal_task, parse_goal
from aidsr.teams.fitting.check import check_task
from aidsr.teams.fitting.facts import environment_facts, goal_facts

BELL = """<mujoco><option timestep="0.002"/><worldbody>
  <geom name="floor" type="plane" size="1 1 0.1"/>
  {mount}
  <body name="bell" pos="{pos}"><geom name="bell" size="{size}"/></body></worldbody></mujoco>"""
MOUNT = '<site name="mount" pos="0 0 0.5" euler="180 0 0"/>'
TOUCH = 'kind = "touch"\ntarget = "bell"\n'


def bell(mount=MOUNT, pos="0.13 0 0.28", size="0.03"):
    return BELL.format(mount=mount, pos=pos, size=size)


def facts_of(environment, goal=TOUCH):
    return goal_facts(goal_task(parse_goal(goal), environment))


@pytest.mark.parametrize("name", examples())
def test_no_example_has_a_fault(name):
    facts = facts_of(examples()[name].environment, examples()[name].goal)
    assert facts.faults == ()
    assert any(line.startswith("Mount: ") for line in facts.fact_lines)


def test_a_scene_in_millimetres_is_not_tried():
    tall = '<site name="mount" pos="0 0 500" euler="180 0 0"/>'
    task = goal_task(parse_goal(TOUCH), bell(tall, "130 0 280", "30"))
    steps = []
    found = check_task(task, listen=steps.append)
    assert found.problems == (
        "bell is 256 m from the mount, and the longest built-in body is 0.7 m: are these millimetres? Lengths are in "
        "metres.",
    )
    assert "choosing a reference robot" not in steps
    assert (found.reference, found.blind, found.probe) == ("", None, None)


def test_a_region_in_millimetres_is_found_as_well():
    ring = bell().replace('<body name="bell" pos="0.13 0 0.28">', '<body name="bell" pos="0.13 0 0.28"><freejoint/>')
    goal = 'kind = "bring"\ntargets = ["bell"]\nregion = {{ center_m = [{}], radius_m = 0.05 }}\n'
    (fault,) = facts_of(ring, goal.format("160, 0, 30")).faults
    assert fault.startswith("the ball of radius 0.05 m about (160, 0, 30) m is 163 m from the mount")
    assert facts_of(ring, goal.format("0.16, 0, 0.03")).faults == ()


@pytest.mark.parametrize(
    ("mount", "goal"),
    [
        (MOUNT, TOUCH + 'base = "free"\n'),
        ("", TOUCH + 'base = "free"\n'),
        (
            '<body name="cart"><joint name="rail" type="slide" axis="1 0 0"/><geom size="0.01" mass="9"/>'
            '<site name="mount"/></body>',
            TOUCH,
        ),
    ],
)
def test_what_travels_may_have_a_long_way(mount, goal):
    assert facts_of(bell(mount, "100 0 0.28"), goal).faults == ()


@pytest.mark.parametrize(
    ("mount", "said"),
    [
        ('<site name="monut" pos="0 0 0.5"/>', 'no site is named "mount"; did you mean "monut"?'),
        ('<site name="Mount" pos="0 0 0.5"/>', 'no site is named "mount"; did you mean "Mount"?'),
        (
            '<body name="mount" pos="0 0 0.5"/>',
            'no site is named "mount": "mount" is a body, and a robot attaches to a site; write '
            '<site name="mount"/> into this body.',
        ),
        (
            '<geom name="mount_left" pos="0 0 0.5" size="0.01"/>',
            'no site is named "mount": "mount_left" is a geom, and a robot attaches to a site; write '
            '<site name="mount" pos="…"/> in its place.',
        ),
    ],
)
def test_a_mount_that_is_no_mount_is_the_first_problem(mount, said):
    steps = []
    found = check_task(goal_task(parse_goal(TOUCH), bell(mount)), listen=steps.append)
    assert found.problems == (said,)
    assert steps == []


def test_without_any_mount_robots_start_at_the_origin():
    assert facts_of(bell("")).faults == ()
    assert any('Mount: none; robots start at the origin, "world"' in line for line in facts_of(bell("")).fact_lines)


def test_the_tolerance_of_overlaps_is_said():
    (said,) = (line for line in facts_of(bell()).fact_lines if line.startswith("Without a robot"))
    assert said == (
        "Without a robot: no target overlaps anything by more than 1 mm and a fifth of the thinner part, or moves by "
        "more than 2 mm in 1 s, and no joint that is to move is stopped on its way."
    )


def test_an_environment_without_a_goal_is_described():
    facts = environment_facts(bell())
    assert facts.faults == ()
    assert "Mount: mount at (0, 0, 0.5) m, pointing along (0, 0, -1)" in facts.lines
    assert "Body: bell at (0.13, 0, 0.28) m, cannot move" in facts.lines
    assert environment_facts(bell('<site name="monut"/>')).faults[0].startswith('no site is named "mount"')


def test_a_body_that_turns_about_its_own_centre_moves():
    (said,) = (
        line for line in environment_facts(examples()["knob"].environment).lines if line.startswith("Body: knob")
    )
    assert "moves (" in said
    assert "hinge about" in said
