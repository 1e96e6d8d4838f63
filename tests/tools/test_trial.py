"""A scene is sent back unless a blind motion brings it to the decisive stage, with figures and after a script."""

from pathlib import Path

import pytest
from tests.tools.carts import CART

from aidsr.core.artifacts import Attempt, CritiqueIssue, Placement, Robot, Scene
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop import failure_attribution
from aidsr.learn.openloop.motion import GroupMotion, Motion
from aidsr.learn.openloop.script import parse_script
from aidsr.learn.openloop.script_policy import played_by
from aidsr.tasks import goal_task, load_task, parse_goal
from aidsr.tools import playing, trial
from aidsr.tools.script_search import WAYPOINTS, Scripts, search_script
from aidsr.tools.trial import try_scene, try_task
from scenes import small_arm, small_scene

FAR = 'kind = "travel"\ndistance_m = {}\ntime_limit_s = 4\nhold_s = 0.2\n'


@pytest.fixture(autouse=True)
def brief_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trial, "LEAST_STEPS", 60_000)
    monkeypatch.setattr(trial, "LONGEST_S", 2.0)


def travelling(distance_m: float) -> TaskScene:
    task = goal_task(parse_goal(FAR.format(distance_m)), CART)
    return TaskScene.of(CART, task)


def test_two_searches_that_agree_pass_what_reaches_the_decisive_stage() -> None:
    report = try_scene(travelling(0.4))
    assert (report.phase, report.critique.passed, report.critique.issues) == ("solved", True, ())
    assert [(one.how, one.seed, one.variation) for one in report.attempts] == [("search", 0, 0), ("search", 1, 1)]
    assert 'searches reach "half way" (progress 0.50)' in report.critique.summary
    assert "It starts at progress 0.00." in report.critique.summary


def test_what_no_motion_gets_there_is_sent_back_with_what_happened() -> None:
    report = try_scene(travelling(3.0))  # a wall stands after 0.45 m
    assert not report.critique.passed
    assert [one.how for one in report.attempts] == ["search", "search", "script"], "a script failed before any blame"
    assert 0.05 < report.progress < 0.2
    assert report.spread[0] <= report.progress <= report.spread[1]
    assert "The best: on its way, not yet half way." in report.critique.summary
    assert "touches wall first at " in report.account
    assert "The best of them, as a script:" in report.account
    assert "heading" in report.account


def test_a_third_search_decides_where_two_disagree(monkeypatch: pytest.MonkeyPatch) -> None:
    found = {0: 0.9, 1: 0.1, 2: 0.8}
    real = trial._attempt

    def told(task, report):
        progress = found[report.seed]
        return real(task, report).model_copy(
            update={"progress": progress, "decisive": progress > 0.5, "succeeded": False}
        )

    monkeypatch.setattr(trial, "_attempt", told)
    report = try_scene(travelling(3.0))
    assert [one.progress for one in report.attempts] == [0.9, 0.1, 0.8]
    assert (report.phase, report.critique.passed) == ("partial", True)
    assert report.spread == (0.1, 0.9)


def test_where_a_training_decides_only_success_is_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    real = trial._attempt

    def told(task, report):
        return real(task, report).model_copy(update={"progress": 0.9, "decisive": True, "succeeded": False})

    monkeypatch.setattr(trial, "_attempt", told)
    assert try_scene(travelling(3.0)).critique.passed
    report = try_scene(travelling(3.0), wanted="solved")
    assert not report.critique.passed
    assert [one.how for one in report.attempts] == ["search", "search", "script"]
    assert try_scene(travelling(0.4), wanted="solved").critique.passed, "there a script succeeds"


def test_a_script_is_tried_where_the_searches_fell_short(monkeypatch: pytest.MonkeyPatch) -> None:
    found = {0: 0.9, 1: 0.1, 2: 0.2}
    real = trial._attempt

    def told(task, report):
        progress = found[report.seed]
        return real(task, report).model_copy(update={"progress": progress, "decisive": progress > 0.5})

    played, record = [], playing.record

    def recorded(scene, policy, *, variation):
        played.append(variation)
        return record(scene, policy, variation=variation)

    monkeypatch.setattr(trial, "_attempt", told)
    monkeypatch.setattr(playing, "record", recorded)
    report = try_scene(travelling(3.0))
    assert [(one.how, one.seed) for one in report.attempts][:3] == [("search", seed) for seed in (0, 1, 2)]
    script = report.attempts[3]
    assert script.variation in (1, 2), "in variation 0 it is reached without a script"
    assert not report.critique.passed
    assert played == [script.variation], "nobody is blamed for the attempt that reached it"
    assert "The best of those that fell short, as a script:" in report.account


def test_measured_again_takes_seeds_and_variations_of_its_own() -> None:
    report = try_scene(travelling(3.0), first_seed=3, attribute=False)
    assert [(one.how, one.seed, one.variation) for one in report.attempts] == [
        ("search", seed, seed) for seed in (3, 4, 5)
    ]
    assert report.critique.passed, "it is measured, and nobody is blamed"


ISSUE = CritiqueIssue(blame="integrator", component="placement", problem="comes no nearer", suggestion="turn it")


class Others:
    """Placements that a search comes to a known progress with."""

    def __init__(self, **progress: float) -> None:
        self.progress = progress

    def placements(self):
        return [(words, words) for words in self.progress]

    def scene(self, placement: str) -> float:
        return self.progress[placement]


@pytest.mark.parametrize(
    ("others", "blame", "words"),
    [
        (Others(turned=0.9, larger=0.5), "integrator", "turn it; turned it comes to 0.90"),
        (Others(turned=0.55, larger=0.5), "designer", "another placement is not enough"),
        (None, "designer", "another placement is not enough"),
    ],
)
def test_a_placement_is_blamed_where_others_come_farther_than_seeds_differ(
    others, blame, words, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Found:
        def __init__(self, progress: float) -> None:
            self.progress = progress

    monkeypatch.setattr(trial, "_search", lambda scene, _seed: Found(scene))
    attempts = [
        Attempt(how=how, seed=0, variation=0, tried=9, progress=p, reached="", decisive=False, succeeded=False)
        for how, p in (("search", 0.45), ("search", 0.65), ("script", 0.7))
    ]
    issue, lines = trial._placement_or_body(ISSUE, attempts, others)
    assert issue.blame == blame
    assert words in issue.suggestion
    assert len(lines) == (0 if others is None else 1)
    assert all("seeds differ by 0.20" in line for line in lines)


def test_a_root_that_is_held_where_it_has_to_travel_is_told_to_the_integrator(monkeypatch: pytest.MonkeyPatch) -> None:
    """Other scales and turns keep the base, so that they say nothing about it."""
    held = ISSUE.model_copy(update={"suggestion": 'place it with base "free"'})
    monkeypatch.setattr(failure_attribution, "attribute_failure", lambda *_: ("not_forward", held))
    report = try_scene(travelling(3.0))
    assert report.critique.issues == (held,)


def test_other_placements_are_made_from_the_one_there_is() -> None:
    robot, task = Robot(mjcf=small_arm(), functional_part="tip"), load_task("button_pushing")
    placement = Placement(mount="mount", base="fixed", scale=1.8, rotation_deg=(0, 0, 10))
    others = trial._Others(robot, placement, task.environment, task)
    told = dict(others.placements())
    assert list(told) == ["at scale 1.44", "turned by 90 deg", "turned by 180 deg"], "2.25 is more than may be"
    assert told["turned by 90 deg"].rotation_deg == (0, 0, 100)
    assert others.scene(told["at scale 1.44"]).model.nu == 2


def test_a_scene_is_tried_as_it_is_in_a_worker(tmp_path: Path) -> None:
    (tmp_path / "goal.toml").write_text(FAR.format(0.05))
    scene = Scene(mjcf=CART, placement=Placement(mount="world", base="fixed"))
    report = try_task(Robot(mjcf="", functional_part="tip"), scene, goal=tmp_path / "goal.toml")
    assert report.phase == "solved"


def motion(**changes: object) -> Motion:
    drive = GroupMotion(group="robot/drive", first=0.0, last=0.5, **changes)
    turn = GroupMotion(group="robot/turn", first=0.0, last=0.0)
    return Motion(begin_s=0.0, ramp_s=2.0, frequency_hz=1.0, groups=(drive, turn))


def test_a_motion_as_a_script_does_the_same_and_is_written_as_it_is_played() -> None:
    scripts = Scripts.of(motion(amplitude=0.2, phase_rad=0.5), horizon_s=2.0)
    assert scripts.times_s.size == WAYPOINTS
    names = ["robot/drive", "robot/turn"]
    block = played_by(parse_script(scripts.text(names)), names, [0.0, 0.0], 0.04).blocks[0]
    for time_s in (0.0, 0.3, 1.9, 5.0):
        assert block.at(time_s) == pytest.approx(scripts.at(time_s)[0], abs=0.005)


def test_a_search_among_scripts_finds_what_its_motion_missed() -> None:
    still = motion().model_copy(
        update={"groups": tuple(each.model_copy(update={"last": 0.0}) for each in motion().groups)}
    )
    found = search_script(travelling(0.4), still, variation=0, seed=0, max_steps=60_000, longest_s=2.0)
    assert found.tried >= 12
    assert found.episode.best_progress > 0.9
    assert "robot/" not in found.script


def test_a_scene_that_hangs_still_tells_where_it_stopped() -> None:
    report = try_scene(TaskScene.of(small_scene(), load_task("button_pushing")))
    assert not report.critique.passed
    (issue,) = report.critique.issues
    assert issue.blame in ("designer", "coder")
    assert "button" in issue.problem
