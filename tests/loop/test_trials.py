"""What a policy reached after a short training stands beside what the probe reached."""

from importlib import import_module
from pathlib import Path

import pytest

from aidsr.core.artifacts import (
    Critique,
    CritiqueIssue,
    EpisodeResult,
    Evaluation,
    Placement,
    PlausibilityCheck,
    Robot,
    Scene,
    TaskReport,
)
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.loop.run import create_run, make_brief
from aidsr.loop.task_trial import check_trial, trial_of, with_policy
from scenes import small_scene

ISSUE = CritiqueIssue(blame="coder", component="tip", problem="presses with 0.1 N")
SHORT = TaskReport(
    phase="no_force", progress=0.4, critique=Critique(passed=False, summary="Comes to 0.40.", issues=(ISSUE,))
)


def learned(succeeded: int, progress: float, *checks: PlausibilityCheck) -> Evaluation:
    episodes = tuple(
        EpisodeResult(
            variation=index,
            ended="succeeded" if index < succeeded else "out_of_time",
            progress=progress,
            best_progress=progress,
            reward=0.0,
            time_s=1.0,
        )
        for index in range(20)
    )
    return Evaluation(task="button_pushing", level="standard", benchmark_version=2, episodes=episodes, checks=checks)


def test_a_policy_that_falls_short_too_is_told_beside_the_probe() -> None:
    report = with_policy(SHORT, learned(0, 0.55), 20_000)
    assert (report.phase, report.progress, report.critique.issues) == ("no_force", 0.4, (ISSUE,))
    assert report.critique.summary == (
        "Comes to 0.40. After 20,000 steps of training a policy comes to progress 0.55 on average and succeeds in 0% "
        "of 20 episodes it never saw."
    )
    assert report.policy == learned(0, 0.55)
    assert TaskReport.model_validate_json(report.model_dump_json()) == report


def test_a_policy_that_wins_now_and_then_falls_short_and_is_told_so() -> None:
    report = with_policy(SHORT, learned(5, 0.8), 20_000)
    assert (report.phase, report.progress, report.critique.passed) == ("no_force", 0.4, False)
    assert report.critique.summary.endswith(
        "succeeds in 25% of 20 episodes it never saw. With less than 30% so early, few robots do the job after a long "
        "training."
    )


@pytest.mark.parametrize(("won", "phase"), [(6, "partial"), (9, "partial"), (10, "solved")])
def test_a_policy_that_wins_often_shows_that_nobody_has_to_change_anything(won: int, phase: str) -> None:
    report = with_policy(SHORT, learned(won, 0.9), 20_000)
    assert (report.phase, report.progress, report.critique.passed) == (phase, 0.9, True)
    assert report.critique.summary.startswith("Comes to 0.40. After 20,000 steps")


def test_a_policy_that_wins_in_an_implausible_way_sends_the_body_back() -> None:
    deep = PlausibilityCheck(
        name="no_deep_overlap", passed=False, measured=1.4, limit=1.0, bound="at most", message="deepest overlap"
    )
    report = with_policy(SHORT, learned(14, 0.9, deep), 20_000)
    assert (report.phase, report.progress, report.critique.passed) == ("not_valid", 0.9, False)
    (issue,) = report.critique.issues
    assert (issue.blame, issue.component) == ("coder", "no_deep_overlap")
    assert issue.problem == "A policy wins, but not in a valid way: deepest overlap: 1.4 (at most 1)"


def test_what_a_motion_wins_is_not_trained(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solved = TaskReport(phase="solved", progress=1.0, critique=Critique(passed=True, summary="It can."))
    asked = []

    def tried(robot: Robot, scene: Scene, **how: object) -> TaskReport:
        asked.append(how["wanted"])
        return solved

    monkeypatch.setattr(import_module("aidsr.tools.trial"), "try_task", tried)
    monkeypatch.setattr(import_module("aidsr.learn.rl.short_training"), "train_briefly", None)
    config = RunConfig(task_feedback=True, task_training=30_000)
    run = create_run(make_brief(task="button_pushing"), config, level="standard", runs=tmp_path)
    scene = Scene(mjcf=small_scene(), placement=Placement(mount="mount", base="fixed"))
    assert trial_of(run)(Robot(mjcf="", functional_part="tip"), scene) == solved
    assert asked == ["solved"], "the decisive stage is not enough where a training decides"


def test_training_is_off_by_default_and_needs_the_trial() -> None:
    assert RunConfig().task_training == 0
    with pytest.raises(UserError, match="task_training requires task_feedback"):
        check_trial(RunConfig(task_training=100), measured=True)
    check_trial(RunConfig(task_training=100, task_feedback=True), measured=True)


@pytest.mark.slow
def test_a_scene_is_probed_and_trained_in(tmp_path: Path) -> None:
    config = RunConfig(task_feedback=True, task_training=1)
    run = create_run(make_brief(task="button_pushing"), config, level="standard", runs=tmp_path)
    scene = Scene(mjcf=small_scene(), placement=Placement(mount="mount", base="fixed"))
    report = trial_of(run)(Robot(mjcf="", functional_part="tip"), scene)
    assert "searches reach" in report.critique.summary
    assert "After 1 steps of training" in report.critique.summary
    assert report.policy is not None
    assert len(report.policy.episodes) == 20
