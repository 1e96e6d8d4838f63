"""The Judge for a goal of one's own: sound, and does any motion win."""

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
"""What the Judge says of a body that falls short of the goal."""
UNTRIED = "this body could not be tried with its goal"
"""What the Judge says where the trial took too long or crashed."""
INSTEAD = "Name a language model, or bring a robot to start from."
"""What helps where no built-in body does."""
_IDLE = 0.02
"""Progress by doing nothing that is told of. Our choice: more than a body wavers by."""


def task_of(goal: AnyGoal, brief: Brief) -> GoalTask:
    """Return the task that a goal makes of the environment of a brief."""
    return goal_task(goal, brief.environment)


@dataclass(frozen=True)
class FittingJudge:
    """The rules' Judge, who also asks how far the body comes."""

    goal: AnyGoal

    def judge(self, brief: Brief, concept: Concept, robot: Robot, scene: Scene, report: ValidationReport) -> Critique:
        """Return a pass for a sound scene in which a blind motion wins, else what is wrong, or why none does."""
        task, view = task_of(self.goal, brief), View.of(concept)
        read = as_the_rules_read(brief, task.goal, view)
        critique = RuleJudge().judge(read, concept, robot, scene, report)
        # the rules measure the reach to the middle of what is worked on; how far it is the trial tells
        issues = tuple(issue for issue in critique.issues if issue.component not in ("reach", "offset"))
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
    """Return a critique that does not pass a body, after which the Designer takes the next best."""
    issue = CritiqueIssue(blame="designer", component="family", problem=problem, suggestion=INSTEAD)
    return Critique(passed=False, summary=f"{problem[0].upper()}{problem[1:]}.", issues=(issue,), progress=progress)
