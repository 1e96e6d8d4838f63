"""Where a body stops on its way through a task, told from a watched motion, and whose work that is."""

from dataclasses import replace

import numpy as np
import pytest

from aidsr.artifacts import Placement, Robot, Scene
from aidsr.episodes.playing import Course
from aidsr.episodes.scene import TaskScene
from aidsr.probing.blaming import judge_trace, targets_of
from aidsr.probing.motion import GroupMotion, Motion
from aidsr.probing.tracing import Look, Trace, trace
from aidsr.probing.trying import try_out
from aidsr.tasks import load_task
from scenes import small_scene

BUTTON, LANE = load_task("button_pushing"), load_task("flat_ground")
AWAY = Look(
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


def watched(*looks: Look, takes_n: float = 0.0, succeeded=False, failed=False, diverged=False) -> Trace:
    best = max(look.progress for look in looks)
    zeros, ends = np.zeros(1), (np.array([end]) for end in (succeeded, failed, diverged))
    return Trace(
        looks, Course(*ends, zeros, np.array([best]), zeros, np.array([looks[-1].time_s])), {"button_cap": takes_n}
    )


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
            watched(TOUCHING, takes_n=0.63),
            "no_force",
            "coder",
            "actuator_too_weak",
            "robot/tip touches button_cap first at 2 s, and presses with no more than 0.3 N for longer than an impact, "
            "where 0.63 N would move it",
        ),
        (
            BUTTON,
            watched(FIRM, takes_n=0.63),
            "wrong_way",
            "designer",
            "grip",
            "it presses with 7.9 N, where 0.63 N would be enough to move it, and does not move it: nothing is gained",
        ),
        (
            BUTTON,
            watched(replace(FIRM, moved_m=0.003)),
            "wrong_way",
            "designer",
            "grip",
            "it presses with 7.9 N, and moves it by no more than 3 mm: nothing is gained after 2 s",
        ),
        (BUTTON, watched(TOUCHING, AWAY), "slipped", "coder", "robot/tip", "loses it at 2 s"),
        (BUTTON, watched(AWAY, diverged=True), "unstable", "coder", "robot/s3", "breaks down after 1 s"),
        (LANE, watched(replace(AWAY, progress=0)), "not_forward", "coder", "actuator_too_weak", "no more than 0 mm"),
        (
            LANE,
            watched(replace(AWAY, progress=0, travelled_m=0.2)),
            "not_forward",
            "designer",
            "gait",
            "by up to 200 mm in 1 s, but not forward",
        ),
        (
            LANE,
            watched(replace(AWAY, progress=0.05, travelled_m=0.06)),
            "not_forward",
            "designer",
            "gait",
            "it moves forward, but by no more than 60 mm in 1 s",
        ),
    ],
)
def test_each_phase_blames_a_role_with_bodies_times_and_numbers(task, seen, phase, blame, component, words) -> None:
    report = judge_trace(task, seen, 64)
    assert report.phase == phase
    (issue,) = report.critique.issues
    assert (issue.blame, issue.component) == (blame, component)
    assert words in issue.problem
    assert issue.suggestion
    assert "best of 64 open-loop motions" in report.critique.summary


@pytest.mark.parametrize(
    ("task", "seen", "phase"),
    [
        (BUTTON, watched(TOUCHING, succeeded=True), "solved"),
        (LANE, watched(replace(AWAY, progress=0.12)), "partial"),
    ],
)
def test_what_is_left_to_training_passes(task, seen, phase) -> None:
    report = judge_trace(task, seen, 64)
    assert (report.phase, report.critique.passed, report.critique.issues) == (phase, True, ())


def test_an_impact_is_no_force() -> None:
    looks = [replace(AWAY, time_s=0.04 * (i + 1)) for i in range(10)]
    looks[4] = replace(FIRM, time_s=looks[4].time_s, force_n=381.0)
    assert watched(*looks).kept_n == 0
    assert judge_trace(BUTTON, watched(*looks, takes_n=0.63), 64).phase in ("no_force", "slipped")
    pressed = [replace(FIRM, time_s=look.time_s) if i > 3 else look for i, look in enumerate(looks)]
    assert watched(*pressed).kept_n == 7.9


def test_an_episode_that_its_task_gives_up_is_told() -> None:
    report = judge_trace(LANE, watched(replace(AWAY, progress=0, travelled_m=0.2), failed=True), 64)
    assert "given up by the task's own rule after 1 s" in report.critique.summary
    assert "forbids" not in report.critique.summary


def test_what_the_task_forbids_is_told() -> None:
    report = judge_trace(BUTTON, watched(FIRM, replace(FIRM, violation=0.4)), 64)
    assert "doing what the task forbids for 50% of the time" in report.critique.summary


def test_targets_are_what_a_task_feels_for() -> None:
    assert targets_of(BUTTON) == ("button_cap",)
    assert targets_of(LANE) == ()


@pytest.fixture(scope="module")
def place() -> TaskScene:
    return TaskScene.of(small_scene(), BUTTON)


def test_a_body_that_rests_is_seen_to_rest(place: TaskScene) -> None:
    still = tuple(
        GroupMotion(group=group.name, first=float(rest), last=float(rest))
        for group, rest in zip(place.actions.groups, place.actions.rest, strict=True)
    )
    motion = Motion(begin_s=0.1, ramp_s=0.1, frequency_hz=1.0, groups=still)
    seen = trace(place, BUTTON.variation("development", 0), motion, targets_of(BUTTON))
    assert len(seen.looks) == round(BUTTON.time_limit_s / BUTTON.control_dt_s)
    assert [look.time_s for look in seen.looks[:2]] == pytest.approx([0.04, 0.08])
    assert 0.02 < seen.nearest.gap_m < 0.3
    assert (seen.hardest.force_n, seen.hardest.touching) == (0.0, ())
    assert seen.needed_m > 0.2
    assert seen.gives_way_at_n == {"button_cap": pytest.approx(0.15 + 60 * 0.008)}, "its preload, and its whole spring"
    assert seen.takes_n == 0, "nothing is touched"
    assert seen.looks[-1].fastest.startswith("robot/")
    assert judge_trace(BUTTON, seen, 1).phase == "never_reached"


def test_a_scene_is_tried_as_it_is_in_a_worker() -> None:
    placement = Placement(mount="mount", base="fixed")
    robot, scene = Robot(mjcf="", functional_part="tip"), Scene(mjcf=small_scene(), placement=placement)
    report = try_out(robot, scene, task="button_pushing", candidates=16)
    assert report.phase in ("never_reached", "no_force", "wrong_way", "slipped", "solved")
    assert "16 open-loop motions" in report.critique.summary
