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
    reach_m=0.2,
    travelled_m=0.0,
    fastest="robot/s3",
)
TOUCHING = replace(AWAY, time_s=2.0, progress=0.55, gap_m=-0.001, force_n=0.3, touching=("robot/tip",))


def watched(*looks: Look, needed_m: float = 0.15, succeeded: bool = False, diverged: bool = False) -> Trace:
    best = max(look.progress for look in looks)
    zeros, no = np.zeros(1), np.zeros(1, dtype=bool)
    course = Course(
        np.array([succeeded]), no, np.array([diverged]), zeros, np.array([best]), zeros, np.array([looks[-1].time_s])
    )
    return Trace(looks, course, needed_m)


@pytest.mark.parametrize(
    ("task", "seen", "phase", "blame", "component", "words"),
    [
        (BUTTON, watched(AWAY, needed_m=0.3), "never_reached", "designer", "reach", "40 mm, at 1 s; it gets 200 mm"),
        (BUTTON, watched(AWAY), "never_reached", "integrator", "placement", "although it gets 200 mm"),
        (BUTTON, watched(AWAY, TOUCHING), "no_force", "coder", "actuator_too_weak", "at 2 s with no more than 0.3 N"),
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
    assert seen.looks[-1].fastest.startswith("robot/")
    assert judge_trace(BUTTON, seen, 1).phase == "never_reached"


def test_a_scene_is_tried_as_it_is_in_a_worker() -> None:
    placement = Placement(mount="mount", base="fixed")
    robot, scene = Robot(mjcf="", functional_part="tip"), Scene(mjcf=small_scene(), placement=placement)
    report = try_out(robot, scene, task="button_pushing", candidates=16)
    assert report.phase in ("never_reached", "no_force", "slipped", "solved")
    assert "16 open-loop motions" in report.critique.summary
