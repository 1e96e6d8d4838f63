"""The Judge for a user's own goal: it checks that a scene is sound and that some motion succeeds."""

from __future__ import annotations

from dataclasses import dataclass

from aidsr.core.artifacts import Brief, Concept, Critique, CritiqueIssue, Robot, Scene, ValidationReport
from aidsr.core.errors import IsolationError
from aidsr.learn.openloop.probe_scene import VARIATIONS, budget_for
from aidsr.tasks.goals import AnyGoal, GoalTask, goal_task
from aidsr.teams.fitting.trial import fit
from aidsr.teams.fitting.views import View, as_the_rules_read
from aidsr.teams.rules.judge import RuleJudge

REFUSED = "no motion of this body wins without learning"
"""Text of the Judge about a body that does not meet the goal."""
UNTRIED = "this body could not be tried with its goal"
"""Text of the Judge if the trial took too long or crashed."""
INSTEAD = "Name a language model, or bring a robot to start from."
"""Advice for the user if no built-in body meets the goal."""
_IDLE = 0.02
"""Progress of a robot at rest above which it is reported. Our choice: more than a body gains by swaying."""


def task_of(goal: AnyGoal, brief: Brief) -> GoalTask:
    """Return the task that a goal defines in the environment of a brief."""
    return goal_task(goal, brief.environment)


@dataclass(frozen=True)
class FittingJudge:
    """The rules' Judge, with a trial that measures how much progress the body makes."""

    goal: AnyGoal

    def judge(self, brief: Brief, concept: Concept, robot: Robot, scene: Scene, report: ValidationReport) -> Critique:
        """Return a pass for a sound scene in which an open-loop motion succeeds, else the issues, or why none does."""
        task, view = task_of(self.goal, brief), View.of(concept)
        read = as_the_rules_read(brief, task.goal, view)
        critique = RuleJudge().judge(read, concept, robot, scene, report)
        # the rules measure the way to the middle of the workpiece; the trial shows whether the body reaches it
        issues = tuple(issue for issue in critique.issues if issue.component not in ("reach", "offset", "direction"))
        if issues:
            return critique.model_copy(update={"issues": issues})
        candidates, max_steps = budget_for(task)
        try:
            found = fit(scene.mjcf, task, robot.actuator_groups, candidates, VARIATIONS, max_steps, explain=True)
        except IsolationError as error:
            return _refusal(f"{UNTRIED}: {error}")
        if found.success:
            won = f"{found.won} of {found.variations} tested variations"
            return Critique(
                passed=True, summary=f"All built-in checks passed. Without learning, a motion succeeds in {won}."
            )
        idle = f", of which {found.idle:.2f} by doing nothing" if found.idle > _IDLE else ""
        short = f"{REFUSED}: {found.reached}, progress {found.progress:.2f}{idle}; {found.why}"
        return _refusal(short, found.progress)


def _refusal(problem: str, progress: float | None = None) -> Critique:
    """Return a critique that rejects a body; the Designer then takes the next best one."""
    issue = CritiqueIssue(blame="designer", component="family", problem=problem, suggestion=INSTEAD)
    return Critique(passed=False, summary=f"{problem[0].upper()}{problem[1:]}.", issues=(issue,), progress=progress)
