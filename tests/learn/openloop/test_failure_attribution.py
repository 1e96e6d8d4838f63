"""Where a body stops on its way through a task, told from a watched motion, and whose work that is."""

from dataclasses import replace
from functools import cache

import mujoco
import numpy as np
import pytest

from aidsr.core.artifacts import Placement, Robot
from aidsr.learn.episodes.rollout import EpisodeOutcomes
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop.failure_attribution import attribute_failure
from aidsr.learn.openloop.motion import GroupMotion, Motion, Motions, OpenLoopPolicy
from aidsr.learn.openloop.trace import Trace, TraceStep, _Recorder, trace
from aidsr.sim.assembly import assemble
from aidsr.tasks import Change, GoalTask, Variation, goal_task, load_task, parse_goal
from aidsr.tasks.targets import targets_of
from scenes import QuickPushing, small_arm, small_scene

BUTTON, LANE = load_task("button_pushing"), load_task("flat_ground")
ROOM = """
<mujoco>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 0.05" priority="1"/>
    <site name="mount" pos="0 0 0.5" euler="180 0 0"/>
    <site name="mount_low" pos="0 0 0.1"/>
    <site name="hook" pos="0.16 0 0.3"/>
    <site name="moon" pos="0 0 0.9"/>
    <body name="cart" pos="0.06 0 0.3">
      <joint name="rail" type="slide" axis="1 0 0" damping="1" frictionloss="0.3"/>
      <geom name="cart" type="box" size="0.02 0.05 0.02" mass="0.2" priority="1"/>
      <body name="flag" pos="0 0 0.05"><geom name="flag" size="0.01" mass="0.01" priority="1"/></body>
    </body>
    <body name="ball" pos="-0.16 0 0.03">
      <freejoint/>
      <geom name="ball" size="0.03" mass="0.05" priority="1"/>
    </body>
    <body name="bell" pos="-0.06 0 0.3"><geom name="bell" size="0.02" priority="1"/></body>
  </worldbody>
</mujoco>"""
"""What the goals below are about, around an arm that hangs from the mount."""
REACH = 'kind = "reach"\ntarget = "hook"\ntime_limit_s = 1'
MOON = REACH.replace("hook", "moon")
LIFT = 'kind = "lift"\ntarget = "ball"\ntime_limit_s = 1'
PUSH = 'kind = "travel"\ntarget = "flag"\ndistance_m = 0.8\ntime_limit_s = 1'
WALK = 'kind = "travel"\ndistance_m = 0.5\ntime_limit_s = 1'
TOUCH = 'kind = "touch"\ntarget = "bell"\nforce_n = 9\ntime_limit_s = 1'
AWAY = TraceStep(
    time_s=1.0,
    progress=0.1,
    gap_m=0.04,
    nearest="button_cap",
    force_n=0.0,
    touching=(),
    touched=(),
    violation=0.0,
    moved_m=0.0,
    apart_m=0.15,
    reach_m=0.2,
    travelled_m=0.0,
    fastest="robot/s3",
)
TOUCHING = replace(
    AWAY, time_s=2.0, progress=0.55, gap_m=-0.001, force_n=0.3, touching=("robot/tip",), touched=("button_cap",)
)
FIRM = replace(TOUCHING, force_n=7.9)
LOOSE = replace(AWAY, progress=0.0, gap_m=2.0, nearest="", apart_m=0.0)


def watched(
    *steps: TraceStep, required_n: float = 0.0, free=False, succeeded=False, failed=False, diverged=False
) -> Trace:
    best = max(step.progress for step in steps)
    zeros, ends = np.zeros(1), (np.array([end]) for end in (succeeded, failed, diverged))
    course = EpisodeOutcomes(*ends, zeros, np.array([best]), zeros, np.array([steps[-1].time_s]), *[zeros] * 4)
    return Trace(steps, course, {steps[0].nearest: required_n}, free)


def goal(text: str) -> GoalTask:
    return goal_task(parse_goal(text), ROOM)


def crawled(**changes) -> Trace:
    return watched(replace(LOOSE, **changes), free=True)


@pytest.mark.parametrize(
    ("task", "seen", "phase", "blame", "component", "words"),
    [
        (
            BUTTON,
            watched(replace(AWAY, apart_m=0.3)),
            "never_reached",
            "designer",
            "reach",
            "40 mm, at 1 s; it gets 200 mm",
        ),
        (BUTTON, watched(AWAY), "never_reached", "integrator", "placement", "although it gets 200 mm"),
        (
            BUTTON,
            watched(TOUCHING, required_n=0.63),
            "no_force",
            "coder",
            "actuator_too_weak",
            "robot/tip touches button_cap first at 2 s, and presses with no more than 0.3 N for longer than an impact, "
            "where 0.63 N would move it",
        ),
        (
            BUTTON,
            watched(FIRM, required_n=0.63),
            "wrong_way",
            "designer",
            "grip",
            "it presses with 7.9 N, where 0.63 N would be enough to move it, and moves no target: nothing is gained",
        ),
        (
            BUTTON,
            watched(replace(FIRM, moved_m=0.003)),
            "wrong_way",
            "designer",
            "grip",
            "it presses with 7.9 N, and moves no target by more than 3 mm: nothing is gained after 2 s",
        ),
        (BUTTON, watched(TOUCHING, AWAY), "slipped", "coder", "robot/tip", "loses it at 2 s"),
        (BUTTON, watched(AWAY, diverged=True), "unstable", "coder", "robot/s3", "breaks down after 1 s"),
        (LANE, crawled(), "not_forward", "coder", "actuator_too_weak", "no more than 0 mm"),
        (
            LANE,
            crawled(travelled_m=0.2),
            "not_forward",
            "designer",
            "gait",
            "by up to 200 mm in 1 s, but not forward",
        ),
        (
            LANE,
            crawled(progress=0.05, travelled_m=0.06),
            "not_forward",
            "designer",
            "gait",
            "it moves forward, but by no more than 60 mm in 1 s",
        ),
    ],
)
def test_each_phase_blames_a_role_with_bodies_times_and_numbers(task, seen, phase, blame, component, words) -> None:
    found, issue = attribute_failure(task, seen)
    assert (found, issue.blame, issue.component) == (phase, blame, component)
    assert words in issue.problem
    assert issue.suggestion


def test_an_impact_is_no_force() -> None:
    steps = [replace(AWAY, time_s=0.04 * (i + 1)) for i in range(10)]
    steps[4] = replace(FIRM, time_s=steps[4].time_s, force_n=381.0)
    assert watched(*steps).sustained_n == 0
    assert attribute_failure(BUTTON, watched(*steps, required_n=0.63))[0] in ("no_force", "slipped")
    pressed = [replace(FIRM, time_s=step.time_s) if i > 3 else step for i, step in enumerate(steps)]
    assert watched(*pressed).sustained_n == 7.9


def test_targets_are_what_a_task_feels_for() -> None:
    assert targets_of(BUTTON) == ("button_cap",)
    assert targets_of(LANE) == ()
    assert targets_of(goal(REACH)) == ("hook",)
    assert targets_of(goal(WALK)) == ()


PULLS = {"left": (1.0, -1.0), "right": (-1.0, 1.0), "neither": (-1.0, -1.0)}


def pulled(place: TaskScene, way: str) -> Motion:
    ends = zip(place.actions.groups, PULLS[way], strict=True)
    groups = tuple(GroupMotion(group=group.name, first=-1.0, last=end) for group, end in ends)
    return Motion(begin_s=0.1, ramp_s=0.3, frequency_hz=1.0, groups=groups)


def traced(place: TaskScene, variation: Variation, motion: Motion, targets: tuple[str, ...]) -> Trace:
    return trace(place, variation, OpenLoopPolicy(Motions.of([motion]), place.task.control_dt_s), targets)


@cache
def roomy(base: str) -> str:
    placement = Placement(mount="mount_low" if base == "free" else "mount", base=base)
    return assemble(Robot(mjcf=small_arm(), functional_part="tip"), ROOM, placement).mjcf


@pytest.mark.parametrize(
    ("text", "base", "way", "phase", "blame", "words"),
    [
        (
            REACH,
            "fixed",
            "left",
            "never_reached",
            "integrator",
            "where 20 mm is near enough, although it gets 298 mm",
        ),
        (REACH.replace("hook", "flag"), "fixed", "left", "never_reached", "integrator", "and flag is 162 mm away"),
        (MOON, "fixed", "left", "never_reached", "designer", "its root, and moon is 400 mm away: too short"),
        (LIFT, "fixed", "neither", "never_reached", "designer", "no nearer to ball than 203 mm"),
        (LIFT, "free", "left", "no_force", "coder", "robot/seg2 touches ball first at"),
        (PUSH, "fixed", "left", "no_force", "coder", "robot/seg3 touches flag first at"),
        (PUSH, "fixed", "right", "never_reached", "integrator", "comes no nearer to flag than"),
        (WALK, "free", "left", "not_forward", "designer", "mm in 1 s, but not forward"),
        (WALK, "free", "neither", "not_forward", "coder", "it moves its body by no more than"),
        (WALK, "fixed", "left", "not_forward", "integrator", "its root is held, and its centre of mass moves by no"),
        (WALK + '\nbase = "fixed"', "fixed", "left", "not_forward", "designer", "its root is held"),
        (TOUCH, "fixed", "right", "no_force", "coder", "for longer than an impact, where 9 N is wanted"),
        (TOUCH, "fixed", "left", "never_reached", "integrator", "comes no nearer to bell than"),
    ],
)
def test_where_a_goal_of_each_kind_is_missed_is_told_with_its_target(text, base, way, phase, blame, words) -> None:
    task = goal_task(parse_goal(text), roomy(base))
    place = TaskScene.of(roomy(base), task)
    found, issue = attribute_failure(task, traced(place, Variation(), pulled(place, way), targets_of(task)))
    assert (found, issue.blame) == (phase, blame)
    assert words in issue.problem


ROLLED = replace(FIRM, progress=0.5, nearest="ball", touched=("ball",), moved_m=0.02, force_n=0.8)
RUNG = replace(FIRM, progress=0.3, nearest="bell", touched=("bell",))


@pytest.mark.parametrize(
    ("text", "seen", "phase", "words"),
    [
        (
            LIFT,
            watched(ROLLED, required_n=0.49),
            "wrong_way",
            "0.49 N would be enough to move it, and moves no target by",
        ),
        (LIFT, watched(replace(ROLLED, force_n=0.3), required_n=0.49), "no_force", "where 0.49 N would move it"),
        (TOUCH, watched(replace(RUNG, force_n=12.0)), "wrong_way", "presses with 12 N, but too little of that by its"),
        (REACH, watched(replace(AWAY, nearest="hook", apart_m=0.21)), "never_reached", "although it gets 200 mm from"),
        (REACH, watched(replace(AWAY, nearest="hook", apart_m=0.23)), "never_reached", "230 mm away: too short"),
    ],
)
def test_what_was_touched_for_a_goal_is_not_called_out_of_reach(text, seen, phase, words) -> None:
    found, issue = attribute_failure(goal(text), seen)
    assert found == phase
    assert words in issue.problem


def test_the_body_that_moves_fastest_is_told_not_the_one_at_the_middle_of_its_tree() -> None:
    place = TaskScene.of(small_scene(), QuickPushing())
    whirling = Variation((Change("qvel", "robot/bend4", (30.0,)),), {"signal_s": (1.0,)})
    seen = traced(place, whirling, pulled(place, "neither"), targets_of(BUTTON))
    assert seen.steps[0].fastest == "robot/seg4", "the last segment alone turns, and about its own joint"


@pytest.fixture(scope="module")
def place() -> TaskScene:
    return TaskScene.of(small_scene(), BUTTON)


def test_a_body_that_rests_is_seen_to_rest(place: TaskScene) -> None:
    still = tuple(
        GroupMotion(group=group.name, first=float(rest), last=float(rest))
        for group, rest in zip(place.actions.groups, place.actions.rest, strict=True)
    )
    motion = Motion(begin_s=0.1, ramp_s=0.1, frequency_hz=1.0, groups=still)
    seen = traced(place, BUTTON.variation("development", 0), motion, targets_of(BUTTON))
    assert len(seen.steps) == round(BUTTON.time_limit_s / BUTTON.control_dt_s)
    assert [step.time_s for step in seen.steps[:2]] == pytest.approx([0.04, 0.08])
    assert 0.02 < seen.nearest.gap_m < 0.3
    assert (seen.hardest.force_n, seen.hardest.touching) == (0.0, ())
    assert seen.needed_m > 0.2
    assert seen.yield_force_n == {"button_cap": pytest.approx(0.15 + 60 * 0.008)}, "its preload, and its whole spring"
    assert seen.required_n == 0, "nothing is touched"
    assert seen.steps[-1].fastest.startswith("robot/")
    assert attribute_failure(BUTTON, seen)[0] == "never_reached"


@pytest.mark.parametrize("asked", ["1 0 0", "-1 0 0"])
def test_what_a_target_does_by_itself_is_not_credited_to_the_robot(asked) -> None:
    room = roomy("fixed").replace('frictionloss="0.3"', 'frictionloss="0"')
    rolling = room.replace("<option ", '<option gravity="1 0 -9.81" ', 1)
    text = f"{PUSH}\ndirection = [{asked.replace(' ', ', ')}]"
    place = TaskScene.of(rolling, goal_task(parse_goal(text), rolling))
    seen = traced(place, Variation(), pulled(place, "right"), ("flag",))
    assert seen.steps[-1].apart_m != pytest.approx(seen.steps[0].apart_m, abs=0.05), "it rolls"
    assert max(step.moved_m for step in seen.steps) < 1e-6


def test_a_way_against_the_one_that_is_asked_is_none() -> None:
    for direction, moved_m in (("[1, 0, 0]", 0.1), ("[-1, 0, 0]", 0.0)):
        task = goal_task(parse_goal(f"{PUSH}\ndirection = {direction}"), roomy("fixed"))
        shoved = Variation((Change("qvel", "rail", (0.5,)),))
        recorder = _Recorder(TaskScene.of(roomy("fixed"), task), shoved, ("flag",))
        recorder._data.joint("rail").qpos = 0.1
        mujoco.mj_forward(recorder._model, recorder._data)
        assert recorder.initial().moved_m == pytest.approx(moved_m)
