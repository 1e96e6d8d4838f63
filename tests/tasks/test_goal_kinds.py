"""Goals that turn, bring, follow, point and come in an order: where each is met, that its progress rises all the way,
and what is refused because it cannot be met."""

import mujoco
import numpy as np
import pytest
from sights import slots, touches
from stick import Episode

from aidsr.core.errors import UserError
from aidsr.tasks import Readings, Variation, goal_task, parse_goal
from aidsr.tasks.readings import Outline
from aidsr.tasks.scoring import reset, score

ROOM = """
<mujoco>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 0.05" priority="1"/>
    <site name="hook" pos="0.2 0.1 0.3"/>
    <site name="bin" pos="0.3 0 0.05"/>
    <site name="a" pos="0 0 0.3"/><site name="b" pos="0.1 0 0.3"/><site name="c" pos="0.1 0.1 0.3"/>
    <body name="carriage" pos="0 0 0.5" gravcomp="1">
      <joint name="x" type="slide" axis="1 0 0" range="-0.2 0.2" damping="5"/>
      <joint name="y" type="slide" axis="0 1 0" range="-0.2 0.2" damping="5"/>
      <geom name="carriage" type="box" size="0.02 0.02 0.02" mass="2"/>
      <site name="mount" pos="0 0 -0.02" euler="180 0 0"/>
    </body>
    <body name="valve" pos="0.2 0 0.2">
      <joint name="stem" axis="0 0 1" range="0 95" damping="0.01"/>
      <geom name="hub" size="0.01" mass="0.05" priority="1"/>
      <body name="lever" pos="0.05 0 0"><geom name="lever" type="box" size="0.05 0.006 0.006" mass="0.02"/></body>
    </body>
    <body name="drawer" pos="0 0.3 0.1">
      <joint name="rail" type="slide" axis="0 -1 0" range="0 0.1"/>
      <geom name="drawer" type="box" size="0.03 0.03 0.03" mass="0.1" priority="1"/>
    </body>
    <body name="pellet_1" pos="0 -0.1 0.01"><freejoint/><geom name="p1" size="0.01" mass="0.005" priority="1"/></body>
    <body name="pellet_2" pos="0 -0.2 0.01"><freejoint/><geom name="p2" size="0.01" mass="0.005" priority="1"/></body>
    <body name="pellet_3" pos="0 -0.3 0.01"><freejoint/><geom name="p3" size="0.01" mass="0.005" priority="1"/></body>
    <body name="ghost" pos="0.4 0.4 0.1"><geom name="ghost" size="0.02" contype="0" conaffinity="0"/></body>
  </worldbody>
  <actuator>
    <position name="drive_x" joint="x" kp="500" ctrlrange="-0.2 0.2"/>
    <position name="drive_y" joint="y" kp="500"/>
    <motor name="crank" joint="stem" ctrlrange="-1 1"/>
  </actuator>
</mujoco>"""


def made(text, mjcf=ROOM):
    return goal_task(parse_goal(text), mjcf)


def read(time_s=0.0, outline=None, **sensors):
    """One simulation's newest sensors, (k,) each."""
    samples = {name: np.atleast_2d(np.asarray(value, dtype=float))[None] for name, value in sensors.items()}
    return Readings(samples, np.full(1, time_s), 0.3, 0.002, outline=outline)


def played(task, course):
    """The progress along a course of readings, and whether the goal is met at its end."""
    state, risen = task.reset_state(course[0]), []
    for seen in course:
        state = task.update_state(seen, state)
        risen.append(float(task.progress(seen, state)[0]))
    return risen, bool(task.is_success(course[-1], state)[0])


def rises(progress, dip=1e-9):
    assert min(np.diff(progress)) >= -dip, progress
    assert progress[-1] == pytest.approx(1.0, abs=0.01)
    assert progress[0] < 0.5
    assert len(set(np.round(progress, 6))) > len(progress) / 2, "it stands still most of the way"
    return True


def turned(angle_deg, gap_m):
    return read(goal_offset=(gap_m, 0, 0), goal_gap=[gap_m], goal_angle=[np.deg2rad(angle_deg)])


TURN = 'kind = "turn"\njoint = "stem"\nby_deg = 90'


def test_a_valve_is_turned_from_where_it_is():
    task = made(TURN)
    coming = [turned(0, gap) for gap in np.linspace(0.3, 0, 8)]
    progress, met = played(task, coming + [turned(angle, 0.0) for angle in np.linspace(10, 90, 9)])
    assert rises(progress)
    assert met
    assert not played(task, [*coming, turned(89.9, 0.0)])[1]
    assert not played(task, [*coming, turned(-90, 0.0)])[1]
    assert task.goal.target == "valve"
    told = task.judging()["Success"]
    assert (
        told
        == "The joint stem is turned at least 90 deg about its axis by the right hand (thumb along the axis, fingers "
        "the way it turns) from where it was at the start. Held for 0.5 s."
    )


def test_a_valve_that_must_stop_at_an_angle_is_not_turned_too_far():
    task = made(TURN.replace("90", "45") + "\nwithin_deg = 5")
    assert played(task, [turned(0, 0.0), turned(41, 0.0)])[1]
    progress, met = played(task, [turned(0, 0.0), turned(45, 0.0), turned(70, 0.0)])
    assert not met
    assert progress[-1] < progress[-2]


def test_the_angle_is_that_of_the_joint_in_the_scene():
    task = made(TURN)
    episode = Episode(task)
    episode.data.joint("stem").qpos = np.deg2rad(91)
    mujoco.mj_forward(episode.model, episode.data)
    seen = episode.look()
    assert task.is_success(seen, episode.state.task_state)[0]
    assert task.observe(seen, episode.state.task_state)[0, 4] == pytest.approx(91 / 90)
    assert task.observe(seen, episode.state.task_state).shape[1] == sum(one.size for one in task.features)


def pellets(tip_m, *places_m):
    bodies = {f"goal_body{index}": place for index, place in enumerate(places_m)}
    return read(goal_tip=tip_m, goal_region=(0.3, 0, 0.05), **bodies)


AT_START = ((0, -0.1, 0.01), (0, -0.2, 0.01), (0, -0.3, 0.01))
THERE = (0.3, 0.0, 0.05)
BRING = 'kind = "bring"\ntargets = ["pellet_*"]\ncount = {}\nregion = {{ at = "bin", radius_m = 0.05 }}'


def carried():
    """Each pellet is fetched and carried, one after the other; the last is left there."""
    now, course, tip = list(AT_START), [], np.array([0.0, 0.2, 0.3])
    for index, begin in enumerate(AT_START):
        course += [pellets(tip + share * (np.array(begin) - tip), *now) for share in np.linspace(0, 1, 6)]
        for share in np.linspace(0.1, 1, 8):
            tip = np.array(begin) + share * (np.array(THERE) - begin)
            now[index] = tuple(tip)
            course.append(pellets(tip, *now))
    return course


def test_all_of_several_bodies_are_brought_and_each_counts_as_it_comes():
    task, course = made(BRING.format('"all"')), carried()
    progress, met = played(task, course)
    assert met
    assert rises(progress, dip=0.002), "deeper in the region than it has to be is farther from the next"
    assert progress[13] == pytest.approx(1 / 3, abs=0.12)
    assert not played(task, course[:-9])[1]


def test_a_number_of_bodies_is_enough():
    assert played(made(BRING.format(2)), carried()[:28])[1]
    assert not played(made(BRING.format(2)), carried()[:20])[1]


def test_each_may_come_and_go():
    course = [pellets(THERE, *(THERE if index == now else AT_START[index] for index in range(3))) for now in range(3)]
    course = [pellets(THERE, *AT_START), *course]
    assert played(made(BRING.format('"each"')), course)[1]
    assert not played(made(BRING.format('"all"')), course)[1]
    assert played(made(BRING.format('"each"')), course)[0][-1] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("region", "inside", "outside"),
    [
        ("{ center_m = [0.3, 0, 0.05], size_m = [0.2, 0.1, 0.1] }", (0.399, 0.049, 0.001), (0.3, 0.051, 0.05)),
        ("{ center_m = [0.3, 0, 0.05], radius_m = 0.1 }", (0.36, 0.06, 0.05), (0.38, 0.07, 0.05)),
    ],
)
def test_a_region_is_a_box_or_a_ball(region, inside, outside):
    task = made(f'kind = "bring"\ntargets = ["pellet_1"]\nregion = {region}')
    ends = [read(goal_tip=(0, 0, 0), goal_body0=place) for place in (AT_START[0], inside, outside)]
    assert [played(task, [ends[0], end])[1] for end in ends] == [False, True, False]


def at(tip_m):
    return read(goal_tip=tip_m)


CORNERS = np.array([[0, 0, 0.3], [0.1, 0, 0.3], [0.1, 0.1, 0.3]])
FOLLOW = 'kind = "follow"\nsites = ["a", "b", "c"]\nwithin_m = 0.01'


def along(first=0.0, last=2.0, steps=41):
    return [
        at([np.interp(s, [0, 1, 2], CORNERS[:, axis]) for axis in range(3)]) for s in np.linspace(first, last, steps)
    ]


def test_a_path_is_followed_from_its_beginning_to_its_end():
    task = made(FOLLOW)
    coming = [at(np.array([0, 0, 0.3]) + np.array([-0.2, 0.1, 0.0]) * share) for share in np.linspace(1, 0, 8)]
    progress, met = played(task, coming + along())
    assert met
    assert rises(progress)
    assert not played(task, coming + along(last=1.8))[1]


def test_a_path_that_is_cut_short_or_left_is_not_followed():
    task = made(FOLLOW)
    assert not played(task, [at(CORNERS[0]), at(CORNERS[2])])[1], "the corner was cut"
    assert not played(task, along(1.0, 2.0))[1], "it was joined half way"
    aside = [at(np.array([0.05, -0.03, 0.3]))] * 5
    progress, met = played(task, [*along(0, 0.5, 11), *aside, *along(0.5, 2.0, 31)])
    assert not met, "it was left, so it has to be followed again from its beginning"
    assert progress[12] < 0.3 < progress[10]
    assert played(task, [*along(0, 0.5, 11), *aside, *along()])[1]
    beside = [at(np.array([0.05, -0.0099, 0.3]))] * 5
    assert played(task, [*along(0, 0.5, 11), *beside, *along(0.5, 0.3, 5), *along(0.3, 2.0, 35)])[1], "and to go back"


def posed(tip_m, turn):
    return read(goal_offset=np.subtract(tip_m, (0.2, 0.1, 0.3)), goal_turn=turn)


POSE = 'kind = "pose"\ntarget = "hook"\ndirection = [1, 0, 0]\nwithin_deg = 10'


def about_y(angle_deg):
    half = np.deg2rad(angle_deg) / 2
    return np.cos(half), 0.0, np.sin(half), 0.0


def test_the_functional_part_is_there_and_points_as_wanted():
    task, there = made(POSE), (0.2, 0.1, 0.3)
    coming = [posed(np.array(there) - (0.3 * share, 0, 0), about_y(0)) for share in np.linspace(1, 0, 8)]
    progress, met = played(task, coming + [posed(there, about_y(angle)) for angle in np.linspace(0, 90, 10)])
    assert met
    assert rises(progress)
    assert played(task, [posed(there, about_y(81))])[1]
    assert not played(task, [posed(there, about_y(79))])[1]
    assert not played(task, [posed((0.2, 0.1, 0.33), about_y(90))])[1]
    assert not played(task, [posed(there, about_y(-90))])[1]
    # the quaternion is that of the working point in the scene: the stick hangs down, its z axis with it
    episode = Episode(task)
    observed = task.observe(episode.look(), episode.state.task_state)[0]
    assert observed[3:6] == pytest.approx((0, 0, -1), abs=1e-6)


STAGES = """
kind = "stages"
hold_s = 0.08
[[stages]]
kind = "turn"
joint = "stem"
by_deg = 45
hold_s = 0.12
by_s = 4
[[stages]]
kind = "reach"
target = "hook"
"""


def staged(angle_deg, hook_m, time_s=0.0):
    return read(
        time_s,
        goal1_offset=(0, 0, 0),
        goal1_gap=[0.0],
        goal1_angle=[np.deg2rad(angle_deg)],
        goal2_offset=(hook_m, 0, 0),
    )


def test_stages_count_in_their_order_and_are_held_in_between():
    task = made(STAGES)
    assert not played(task, [staged(0, 0.0)] * 5)[1], "the second does not count before the first"
    turning = [staged(angle, 0.5) for angle in np.linspace(0, 45, 6)]
    coming = [staged(45, away) for away in np.linspace(0.5, 0.0, 6)]
    progress, met = played(task, [*turning, *[staged(45, 0.5)] * 2, *coming])
    assert met
    assert rises(progress)
    assert not played(task, [*turning, *coming[-1:]])[1], "the first was not held for 0.12 s"
    assert played(task, [*turning, *[staged(45, 0.5)] * 2, *[staged(0, 0.0)] * 2])[1], "the first may pass again"
    width = sum(feature.size for feature in task.features)
    assert task.observe(turning[0], task.reset_state(turning[0])).shape == (1, width)
    assert task.stage_reached(0.5) == "stage 1 of 2 over, not yet stage 2 of 2 over"


def test_a_stage_that_is_met_and_not_yet_held_is_not_told_as_over():
    task = made(STAGES)
    progress, _ = played(task, [staged(angle, 0.5) for angle in (0, 20, 45, 45)])
    assert 0.45 < progress[-1] < 0.5
    told = "stage 1 of 2 met, to be held for 0.12 s, not yet stage 1 of 2 over"
    assert task.stage_reached(progress[-1]) == told


def test_a_stage_is_held_for_longer_than_most_goals_last_where_the_whole_does():
    goal = parse_goal("time_limit_s = 30\n" + STAGES.replace("hold_s = 0.12", "hold_s = 12"))
    assert goal.stages[0].hold_s == 12
    assert type(goal).model_validate(goal.model_dump()) == goal
    with pytest.raises(UserError, match=r"hold_s \(12 s\) must be shorter than time_limit_s \(11 s\)"):
        parse_goal("time_limit_s = 11\n" + STAGES.replace("hold_s = 0.12", "hold_s = 12"))


def test_a_stage_that_is_late_loses_the_episode():
    task = made(STAGES)
    state = reset(task, staged(0, 0.5))
    for time_s, lost in ((3.9, False), (4.1, True)):
        assert score(task, state, staged(0, 0.5, time_s), np.zeros((1, 1)))[1].failure.tolist() == [lost]
    for _ in range(4):
        state, _ = score(task, state, staged(45, 0.5, 3.0), np.zeros((1, 1)))
    assert not score(task, state, staged(45, 0.5, 4.1), np.zeros((1, 1)))[1].failure[0]
    assert task.judging()["Lost at once"] == "Stage 1 is not over after 4 s."


def test_the_sensors_of_stages_are_in_a_scene_and_none_twice():
    text = STAGES + '[[stages]]\nkind = "travel"\ndistance_m = 0.1\n[[stages]]\nkind = "travel"\ndistance_m = 0.2\n'
    episode = Episode(made(text))
    assert episode.look()["com_position"].shape == (1, 3)
    episode.run(0.2)
    assert not episode.won


KEEP_OUT = '[[limits]]\nkind = "keep_out"\ncenter_m = [0, 0, 0.3]\nsize_m = [0.1, 0.1, 0.1]\n'
LIMITED = 'kind = "reach"\ntarget = "hook"\nhold_s = 0\n'


@pytest.mark.parametrize(
    ("limit", "good", "bad", "words"),
    [
        (
            KEEP_OUT,
            {"outline": (0.0, 0.0, 0.38)},
            {"outline": (0.0, 0.0, 0.34)},
            "Any part of the robot in the box of 0.1 x 0.1 x 0.1 m about (0, 0, 0.3) m.",
        ),
        (
            KEEP_OUT + 'what = "pellet_1"\n',
            {"limit1_position": (0, 0.06, 0.3)},
            {"limit1_position": (0, 0.04, 0.3)},
            "pellet_1 in the box of 0.1 x 0.1 x 0.1 m about (0, 0, 0.3) m.",
        ),
        (
            '[[limits]]\nkind = "speed"\nof = "robot"\nat_most_m_s = 0.5\n',
            {"limit1_velocity": (0.3, 0.3, 0.0)},
            {"limit1_velocity": (0.4, 0.4, 0.0)},
            "More than 0.5 m/s of the robot's centre of mass.",
        ),
        (
            '[[limits]]\nkind = "force"\non = "valve"\nat_most_n = 2\n',
            {"limit1_contacts": touches(0.9, 1.0)[0]},
            {"limit1_contacts": touches(1.1, 1.0)[0]},
            "More than 2 N by the robot on valve, all contacts together.",
        ),
        (
            '[[limits]]\nkind = "force"\non = "valve"\nat_most_n = 2\n',
            {"limit1_contacts": slots((0.9, (1.0, 0.0, 0.0)), (0.9, (-1.0, 0.0, 0.0)), count=8)[0]},
            {"limit1_contacts": slots((50.0, (1.0, 0.0, 0.0)), (50.0, (-1.0, 0.0, 0.0)), count=8)[0]},
            "More than 2 N by the robot on valve, all contacts together.",
        ),
    ],
    ids=["robot out", "pellet out", "slowly", "gently", "not squeezed"],
)
def test_a_limit_that_is_passed_for_long_costs_success(limit, good, bad, words):
    task = made(LIMITED + limit)
    outline = lambda at: Outline(np.array([[at]]), np.array([0.01]), np.array([1.0]))  # noqa: E731

    def seen(of):
        of = dict(of)
        return read(goal_offset=(0, 0, 0), outline=outline(of.pop("outline", (1.0, 1.0, 1.0))), **of)

    assert task.violation(seen(good))[0] == 0.0
    assert 0.0 < task.violation(seen(bad))[0] <= 1.0
    assert words in task.judging()["Penalty"]
    assert played(task, [seen(bad)] * 5 + [seen(good)])[1], "0.2 s are tolerated"
    assert not played(task, [seen(bad)] * 6 + [seen(good)])[1]


def test_the_whole_robot_is_kept_out_of_a_region_in_the_scene():
    # the stick hangs from 0.48 m down to 0.36 m
    for center_m, inside in ((0.4, True), (0.25, False)):
        limit = f'[[limits]]\nkind = "keep_out"\ncenter_m = [0, 0, {center_m}]\nsize_m = [0.1, 0.1, 0.1]\n'
        episode = Episode(made(LIMITED + limit))
        episode.step()
        assert (episode.score.violation[0] > 0) == inside


MOVING = 'kind = "reach"\ntarget = "hook"\nbase = "moving"\n'


def test_a_timetable_drives_the_mount_and_the_brief_says_so():
    table = '[[mount.timetable]]\nactuator = "drive_x"\npoints = [[0, 0], [1, 0.15]]\n'
    task = made(MOVING + table)
    told = task.judging()["Who moves the mount"]
    assert told == "A timetable drives drive_x: 0 at 0 s, 0.15 at 1 s."
    episode = Episode(task)
    episode.run(1.5)
    assert episode.data.joint("x").qpos[0] == pytest.approx(0.15, abs=0.02)
    assert task.policy_actuators == ()


def test_a_policy_drives_the_mount_and_the_brief_says_so():
    from aidsr.core.artifacts import Placement, Robot
    from aidsr.learn.episodes.scene import TaskScene
    from aidsr.sim.assembly import assemble
    from scenes import small_arm

    task = made(MOVING + '[mount]\npolicy = ["drive_x"]\n')
    assert task.judging()["Who moves the mount"] == "The policy drives drive_x beside the robot's own actuators."
    arm = Robot(mjcf=small_arm(), functional_part="tip")
    scene = assemble(arm, ROOM, Placement(mount="mount", base="fixed"), task.sensors).mjcf
    assert TaskScene.of(scene, task).actions.groups[-1].actuators == ("drive_x",)


SLOW_TRAVEL = """[[stages]]
kind = "travel"
distance_m = 1
[[limits]]
kind = "speed"
of = "robot"
at_most_m_s = 0.05
"""
LIFT_THE_LEVER = 'kind = "lift"\ntarget = "lever"'
PULL = 'kind = "travel"\ntarget = "drawer"\ndistance_m = {}\ndirection = [0, -1, 0]'
CANNOT = {
    LIFT_THE_LEVER: '"lever" cannot get 0.05 m up: its joints (stem) let its centre of mass go at most 0 m that way',
    PULL.format(
        0.5
    ): '"drawer" cannot get 0.5 m along 0 -1 0: its joints (rail) let its centre of mass go at most 0.1 m',
    PULL.format(0.05).replace("-1", "1"): "at most 0 m that way",
    TURN.replace("90", "120"): 'the joint "stem" cannot be turned by 120 deg: its range ends after 95 deg that way',
    TURN.replace("90", "-10"): "its range ends after 0 deg",
    TURN.replace("stem", "rail"): 'the joint "rail" is a slide, which has no angle to turn; use a travel goal',
    TURN.replace(
        "stem", "stern"
    ): 'unknown joint "stern": a turn goal needs a hinge of the environment; did you mean "stem"',
    TURN + '\ntarget = "drawer"': 'unknown target "drawer": the joint "stem" must carry it; it has valve, lever',
    TURN.replace("90", "0"): "by_deg must not be 0",
    'kind = "touch"\ntarget = "ghost"': '"ghost" cannot be touched: it has no solid shape',
    BRING.format(4): "count is 4, and there are only 3 targets: pellet_1, pellet_2, pellet_3",
    BRING.format(1).replace("pellet_*", "pill_*"): 'unknown target "pill_*"',
    BRING.format('"all"').replace('["pellet_*"]', '["ghost"]'): 'the body "ghost" cannot move',
    BRING.format(1).replace('at = "bin"', "center_m = [0, -0.1, 0]"): (
        "the goal is met before anything moves: pellet_1 begin in the ball"
    ),
    BRING.format(1).replace(
        ", radius_m = 0.05", ""
    ): "region: a region requires either `size_m`, of a box, or `radius_m`",
    BRING.format(1).replace('at = "bin", ', ""): "region: a region requires either `center_m`, a point, or `at`",
    BRING.format(1).replace("radius_m", "radius"): 'unknown key "region.radius" (did you mean "radius_m"?)',
    BRING.format(1).replace("targets =", "target ="): (
        'unknown key "target"; rename it to "targets", a list: targets = [\'pellet_*\']'
    ),
    BRING.format(1).replace('targets = ["pellet_*"]', 'target = "pellet_1"'): 'targets = ["pellet_1"]',
    BRING.format(1).replace("targets =", "targts ="): "this kind has hold_s,",
    BRING.format(1).replace('["pellet_*"]', '"pellet_*"'): "targets: it must be a list, in brackets; found 'pellet_*'",
    'target = "drawer"\n' + STAGES: 'unknown key "target"; a stage has a target, not the whole goal',
    'kind = "touch"\ntarget = "floor"': '"floor" is a geom, not a body; put it into a <body name="floor">',
    'kind = "reach"\ntarget = "hub"': '"hub" is a geom, not a body; name its body, "valve"',
    BRING.format(1).replace("pellet_*", "floor"): '"floor" is a geom, not a body',
    LIMITED + '[[limits]]\nkind = "force"\non = "floor"\nat_most_n = 1': (
        'limits 1: "floor" is a geom, not a body; put it into a <body name="floor">'
    ),
    FOLLOW.replace('"c"', '"d"'): 'unknown site "d"',
    'kind = "follow"\nsites = ["a"]': "a path needs two points or more",
    'kind = "follow"\npath_m = [[0, 0, 0], [0, 0]]': "path_m: 2 numbers instead of three",
    'kind = "follow"\npath_m = [[0, 0, 0], [0, 0, 0]]': "path_m has the same point twice in a row",
    POSE.replace("[1, 0, 0]", "[0, 0, 0]"): "direction: no direction: [0.0, 0.0, 0.0]",
    'kind = "stages"': 'missing key "stages"',
    'kind = "stages"\n[[stages]]\nkind = "reach"\ntarget = "hook"': "stages: tuple should have at least 2 items",
    STAGES.replace('"reach"', '"reaching"'): "stages 2 has an unknown kind 'reaching' (did you mean \"reach\"?)",
    STAGES.replace("by_deg", "by_degs"): 'unknown key "stages.1.by_degs" (did you mean "by_deg"?)',
    STAGES + "hold_s = 0.2": "the last stage is held as long as the whole; write its hold_s before [[stages]]",
    LIMITED + "by_s = 3": "by_s belongs to a stage; the whole ends after time_limit_s",
    TURN + "\nwithin_deg = 90": "within_deg (90 deg) must be less than by_deg (90 deg)",
    FOLLOW.replace('"b"', '"a"'): 'the sites "a" and "a" of the path are at the same point; leave one out',
    FOLLOW.replace("0.01", "0.0009"): "a path of 0.2 m that is followed within 0.0009 m is too long",
    STAGES.replace("by_s = 4", "") + SLOW_TRAVEL: "1 m at no more than 0.05 m/s take 20 s",
    STAGES + "base = 'fixed'": "base belongs to the whole goal, not to a stage; write it before [[stages]]",
    STAGES + "by_s = 3": "by_s must rise from stage to stage",
    STAGES.replace("45", "120"): 'the joint "stem" cannot be turned by 120 deg',
    "hold_s = 0.1\n" + LIMITED.replace("hold_s = 0\n", "") + '[[limits]]\nkind = "haste"': (
        'limits 1 has an unknown kind \'haste\'; use "keep_out", "speed" or "force"'
    ),
    LIMITED + '[[limits]]\nkind = "speed"\nof = "ghost"\nat_most_m_s = 1': 'the body "ghost" cannot move',
    LIMITED + '[[limits]]\nkind = "force"\non = "ghost"\nat_most_n = 1': '"ghost" cannot be touched',
    LIMITED + KEEP_OUT + 'what = "pill"': 'unknown target "pill"',
    'kind = "travel"\ndistance_m = 1\n[[limits]]\nkind = "speed"\nof = "robot"\nat_most_m_s = 0.05': (
        "1 m at no more than 0.05 m/s take 20 s, and time_limit_s is 10 s; allow more time or more speed"
    ),
    MOVING: 'base "moving" requires [mount]',
    LIMITED + '[mount]\npolicy = ["drive_x"]': 'mount is driven only where the base is "moving"; the base is "any"',
    MOVING + '[mount]\npolicy = ["drive_z"]': 'unknown actuator "drive_z"',
    MOVING + '[mount]\npolicy = ["drive_y"]': '"drive_y" has no ctrlrange',
    MOVING + '[mount]\npolicy = ["crank"]': "none of the actuators in [mount] drives a joint that carries a mount",
    MOVING + '[[mount.timetable]]\nactuator = "drive_x"\npoints = [[0, 0], [1, 3]]': (
        'the timetable of "drive_x" asks for 3, outside its ctrlrange -0.2 to 0.2'
    ),
    MOVING + '[[mount.timetable]]\nactuator = "drive_x"\npoints = [[1, 0], [0, 0.1]]': "times must rise",
}


@pytest.mark.parametrize(("text", "sentence"), CANNOT.items())
def test_a_goal_that_cannot_be_met_is_refused_with_the_reason(text, sentence):
    with pytest.raises(UserError) as error:
        made(text)
    assert sentence in str(error.value)
    assert "\n" not in str(error.value)


def test_a_region_that_goes_with_a_body_is_about_its_origin_from_the_start_on():
    bin_with_a_far_center = '<body name="crate" pos="0 -0.1 0.01"><geom size="0.01" pos="0.5 0 0"/></body>'
    mjcf = ROOM.replace('<body name="ghost"', bin_with_a_far_center + '<body name="ghost"')
    with pytest.raises(UserError, match="met before anything moves"):
        made(BRING.format(1).replace('at = "bin"', 'at = "crate"'), mjcf)


def test_as_many_stages_as_anyone_writes_have_a_progress():
    task = made('kind = "stages"\n' + 70 * '[[stages]]\nkind = "reach"\ntarget = "hook"\n')
    seen = read(**{f"goal{number}_offset": (0, 0, 0) for number in range(1, 71)})
    progress, met = played(task, 69 * [seen])
    assert met
    assert progress[:2] == pytest.approx([2 / 70, 3 / 70])


def test_a_free_joint_is_called_one():
    room = ROOM.replace("<freejoint/>", '<freejoint name="loose"/>', 1)
    with pytest.raises(UserError, match='"loose" is a free joint, which has no angle to turn; use a lift, travel or'):
        made(TURN.replace("stem", "loose"), room)


def test_what_joints_allow_is_not_refused():
    assert made(PULL.format(0.1)).goal.distance_m == 0.1
    assert made(TURN.replace("90", "95")).goal.by_deg == 95
    assert made('kind = "travel"\ntarget = "lever"\ndistance_m = 0.05\ndirection = [0, 1, 0]')
    assert made('kind = "lift"\ntarget = "pellet_1"\nby_m = 5')


def test_several_bodies_are_put_elsewhere_each_for_itself():
    task = made(BRING.format('"all"') + "\nvary_m = [0.02, 0.02, 0]")
    variation = task.variation("development", 0)
    assert isinstance(variation, Variation)
    assert [change.name for change in variation.changes] == ["pellet_1", "pellet_2", "pellet_3"]
    shifts = np.array([change.value for change in variation.changes]) - AT_START
    assert len({tuple(shift) for shift in np.round(shifts, 6)}) == 3
    assert task.judging()["Episodes differ"] == (
        "Where pellet_1, pellet_2 and pellet_3 are: each up to 0.02 m along x, 0.02 m along y, to either side of where "
        "they are described here."
    )
