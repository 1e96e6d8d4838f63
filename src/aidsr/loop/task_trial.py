"""Trials of scenes on the task of a run: with open-loop motions, and with a short training if requested."""

from __future__ import annotations

from functools import partial
from typing import Any

from aidsr.core.artifacts import (
    SUCCESSFUL_SHARE,
    Critique,
    CritiqueIssue,
    Evaluation,
    Robot,
    Scene,
    TaskReport,
)
from aidsr.core.config import PROMISING_SHARE, RunConfig
from aidsr.core.errors import IsolationError, UserError
from aidsr.core.extras import require_extra
from aidsr.core.formatting import format_check
from aidsr.loop.parts import TryOnTask
from aidsr.runs import Run


def check_trial(config: RunConfig, *, measured: bool) -> None:
    """Refuse a configuration whose trials are impossible.

    Args:
        config: Requested settings.
        measured: Whether there is a task or a goal.

    Raises:
        UserError: Nothing measures success, or a package that training needs is missing.
    """
    if config.task_feedback and not measured:
        raise UserError("task_feedback requires a measure of success; name a task, or give a goal (docs/goals.md)")
    if config.task_training and not config.task_feedback:
        raise UserError("task_training requires task_feedback; switch on both")
    if config.task_training:
        require_extra("rl", "training")


def trial_of(run: Run) -> TryOnTask:
    """Return the function that tries scenes on the task of a run, or on its goal."""
    record = run.asked()
    level, goal = record.level or "standard", None if record.task else run.goal.path
    steps = record.config.task_training
    if not steps:
        return _try(run, attribute=True)
    probe = _try(run, attribute=True, wanted="solved")

    from aidsr.learn.rl.short_training import train_briefly

    def probe_and_train(robot: Robot, scene: Scene) -> TaskReport:
        report = probe(robot, scene)
        if report.critique.passed:
            return report
        try:
            evaluation = train_briefly(
                scene.mjcf, steps=steps, groups=robot.actuator_groups, task=record.task, level=level, goal=goal
            )
        except IsolationError as error:  # only advice, as the probe is; its result is still valid
            return _with_summary(report, f"No policy could be trained: {error}.")
        return with_policy(report, evaluation, steps)

    return probe_and_train


def measure_again(run: Run) -> TryOnTask:
    """Return the function that tries a scene with other seeds and variations than its trial."""
    from aidsr.tools.trial import SEEDS

    return _try(run, first_seed=SEEDS, attribute=False)


def _try(run: Run, **how: Any) -> TryOnTask:
    from aidsr.tools.trial import try_task

    record = run.asked()
    level, goal = record.level or "standard", None if record.task else run.goal.path
    return partial(try_task, task=record.task, level=level, goal=goal, environment=run.brief().environment, **how)


def with_policy(report: TaskReport, evaluation: Evaluation, steps: int) -> TaskReport:
    """Return a report with the result of a policy; if it wins often and in a valid way, no role has to change anything.

    A robot that wins `PROMISING_SHARE` of the episodes after so little training usually does the job after more; one
    that wins now and then usually does not (benchmarks/trial). A success that fails a plausibility check would not
    count in the end either.

    Args:
        report: Report of a trial in which neither a motion nor a script succeeded.
        evaluation: Evaluation of the policy.
        steps: Control steps for which the policy was trained.
    """
    episodes = evaluation.episodes
    progress = sum(one.best_progress for one in episodes) / len(episodes)
    summary = (
        f"After {steps:,} steps of training a policy comes to progress {progress:.2f} on average and succeeds in "
        f"{evaluation.success_share:.0%} of {len(episodes)} episodes it never saw."
    )
    if 0.0 < evaluation.success_share < PROMISING_SHARE:
        summary += f" With less than {PROMISING_SHARE:.0%} so early, few robots do the job after a long training."
    both = _with_summary(report, summary).model_copy(update={"policy": evaluation})
    if evaluation.success_share < PROMISING_SHARE:
        return both
    reached = {"progress": max(report.progress, progress)}
    if not evaluation.valid:
        failed = Critique(passed=False, summary=both.critique.summary, issues=_not_valid(evaluation))
        return both.model_copy(update={**reached, "phase": "not_valid", "critique": failed})
    passed = Critique(passed=True, summary=both.critique.summary)
    phase = "solved" if evaluation.success_share >= SUCCESSFUL_SHARE else "partial"
    return both.model_copy(update={**reached, "phase": phase, "critique": passed})


def _not_valid(evaluation: Evaluation) -> tuple[CritiqueIssue, ...]:
    """Return the failed checks of a successful policy as issues for the Coder."""
    return tuple(
        CritiqueIssue(
            blame="coder",
            component=check.name,
            problem=f"A policy wins, but not in a valid way: {check.message}: {format_check(check)}",
        )
        for check in evaluation.checks
        if not check.passed
    )


def _with_summary(report: TaskReport, more: str) -> TaskReport:
    critique = report.critique.model_copy(update={"summary": f"{report.critique.summary} {more}"})
    return report.model_copy(update={"critique": critique})
