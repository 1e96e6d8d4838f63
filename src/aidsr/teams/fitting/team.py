"""The four roles for a goal of one's own. Goal and geometry say what is tried, the probe which of it is proposed."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from aidsr.core.artifacts import Brief, Concept, Critique, CritiqueIssue, Placement, Robot, Scene, ValidationReport
from aidsr.core.errors import IsolationError, MjcfError
from aidsr.core.roles import Feedback, Team
from aidsr.sim.assembly import assemble
from aidsr.sim.measure import measure
from aidsr.tasks.goals import AnyGoal, Goal, GoalTask, goal_task
from aidsr.teams.fitting.trial import CANDIDATES, MAX_STEPS, Fit, fit, overlaps
from aidsr.teams.fitting.views import (
    View,
    as_placed,
    as_the_rules_read,
    as_viewed,
    candidates,
    own_views,
    turns_of,
    with_view,
    without_view,
)
from aidsr.teams.rules.coder import RuleCoder
from aidsr.teams.rules.designer import RuleDesigner
from aidsr.teams.rules.families import Families, load_families
from aidsr.teams.rules.integrator import RuleIntegrator
from aidsr.teams.rules.job import read_job
from aidsr.teams.rules.judge import RuleJudge

_BODIES = 10
"""Bodies that are tried for a run. Our choice: half a minute."""
_TURNS = 2
"""Placements of one body that are tried, of those in which it overlaps nothing. Our choice."""
_JUDGED_CANDIDATES, _JUDGED_STEPS = 96, 200_000
"""Of the trial that the Judge makes. Our choice: two thirds of what `aidsr probe` takes."""


@dataclass(frozen=True)
class Fitted:
    """A concept with how far its body came."""

    concept: Concept
    fit: Fit


def fitting_team(goal: AnyGoal, seed: int) -> Team:
    """Return the built-in team for a goal.

    Args:
        goal: As in its file.
        seed: The same seed, brief and goal give the same designs.
    """
    return Team(FittingDesigner(goal, seed), FittingCoder(goal), FittingIntegrator(goal), FittingJudge(goal))


def task_of(goal: AnyGoal, brief: Brief) -> GoalTask:
    """Return the task that a goal makes of the environment of a brief."""
    return goal_task(goal, brief.environment)


@dataclass(frozen=True)
class FittingDesigner:
    """Tries bodies of all families that may do, and proposes those that come farthest."""

    goal: AnyGoal
    seed: int
    families: Families = field(default_factory=load_families)

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return the `count` concepts that came farthest, of different families as far as those came near."""
        if brief.starting_robot:
            return self._own_robot(brief, count)
        found = self.tried(brief) or [self._untried(brief)]
        best = sorted(found, key=lambda each: -each.fit.value)
        task = task_of(self.goal, brief)
        firsts = {
            each.concept.family: each
            for each in reversed(best)
            if task.is_decisive(each.fit.progress) or each is best[0]
        }
        chosen = sorted(firsts.values(), key=lambda each: -each.fit.value)
        chosen += [each for each in best if each not in chosen]
        return tuple(self._with_reason(chosen[index % len(chosen)], best) for index in range(count))

    def tried(self, brief: Brief, *, bodies: int = _BODIES, turns: int = _TURNS) -> list[Fitted]:
        """Return every body that was tried, with how far it came; none where each overlaps something.

        Args:
            brief: The job.
            bodies: How many are tried at most.
            turns: In how many placements each, of those in which it overlaps nothing.
        """
        task = task_of(self.goal, brief)
        rng = self._rng(brief)
        found: list[Fitted] = []
        for number, (view, name, variant) in enumerate(candidates(brief, task.goal, self.families)):
            if number == bodies:
                break
            placed = 0
            for turned in turns_of(view):
                result = self._try(brief, task, turned, name, variant, rng)
                if result is not None:
                    found.append(result)
                    placed += 1
                if placed == turns or (result is not None and result.fit.success):
                    break
        return found

    def _untried(self, brief: Brief) -> Fitted:
        """Return the first body, where none could be placed; the validator says what it overlaps."""
        goal = task_of(self.goal, brief).goal
        view, name, variant = next(candidates(brief, goal, self.families))
        concept = self._concept(brief, goal, view, name, variant, self._rng(brief))
        return Fitted(concept, Fit(progress=0.0, success=False, reached="no body could be placed"))

    def _rng(self, brief: Brief) -> np.random.Generator:
        return np.random.default_rng([self.seed, zlib.crc32(brief.environment.encode())])

    def _own_robot(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return versions of the robot that its user brought, placed and scaled where it comes farthest."""
        task = task_of(self.goal, brief)
        versions = RuleDesigner(self.seed).propose(brief, count)
        robot = FittingCoder(self.goal).write(brief, versions[0])
        try:
            extent = measure(robot)
        except (MjcfError, IsolationError):
            return versions  # the validator says what is wrong with it
        views = list(own_views(brief, task.goal, extent.low_m, extent.high_m))
        tried = [self._play(brief, task, with_view(versions[0], view)) for view in views]
        found = [each for each in tried if each is not None]
        best = max(found, key=lambda each: each.fit.value, default=None)
        view = View.of(best.concept) if best else views[0]
        words = (
            f"Tried in {len(found)} placements; scaled by {view.scale:g} it came to progress {best.fit.progress:.2f} "
            f"({best.fit.reached})."
            if best
            else f"In none of {len(views)} placements it was free of what surrounds it."
        )
        return tuple(
            with_view(each, view).model_copy(update={"rationale": f"{each.rationale} {words}"}) for each in versions
        )

    def _try(
        self, brief: Brief, task: GoalTask, view: View, name: str, variant: str, rng: np.random.Generator
    ) -> Fitted | None:
        return self._play(brief, task, self._concept(brief, task.goal, view, name, variant, rng))

    def _play(self, brief: Brief, task: GoalTask, concept: Concept) -> Fitted | None:
        """Return how far the body of a concept comes; None where it overlaps something or cannot be tried."""
        robot = FittingCoder(self.goal).write(brief, concept)
        placement = FittingIntegrator(self.goal).place(brief, concept, robot)
        try:
            scene = assemble(robot, brief.environment, placement, task.sensors).mjcf
            if overlaps(scene):
                return None
            return Fitted(concept, fit(scene, task, robot.actuator_groups, CANDIDATES, 1, MAX_STEPS))
        except (MjcfError, IsolationError):
            return None

    def _concept(
        self, brief: Brief, goal: Goal, view: View, name: str, variant: str, rng: np.random.Generator
    ) -> Concept:
        job = read_job(as_the_rules_read(brief, goal, view))
        family = self.families[name]
        interpretation = f"{goal.success_text} Read from the goal and the geometry as a job to {view.kind}."
        return with_view(family.concept(family.size(job, rng, variant), job, interpretation), view)

    def _with_reason(self, chosen: Fitted, tried: Sequence[Fitted]) -> Concept:
        words = (
            f"The built-in rules tried {len(tried)} bodies without learning; this one came to progress "
            f"{chosen.fit.progress:.2f} ({chosen.fit.reached}), the best to {tried[0].fit.progress:.2f}."
        )
        return chosen.concept.model_copy(update={"rationale": f"{chosen.concept.rationale} {words}".strip()})

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        """Return the concept changed as the rules understand the feedback."""
        goal, view = task_of(self.goal, brief).goal, View.of(concept)
        read = as_the_rules_read(brief, goal, view)
        return with_view(RuleDesigner(self.seed).revise(read, without_view(concept), robot, feedback), view)


@dataclass(frozen=True)
class FittingCoder:
    """The rules' Coder, which knows nothing of views."""

    goal: AnyGoal

    def write(self, brief: Brief, concept: Concept) -> Robot:
        """Return the robot of a concept."""
        return RuleCoder().write(brief, without_view(concept))

    def repair(self, brief: Brief, concept: Concept, robot: Robot, feedback: Feedback) -> Robot:
        """Return the robot with the reported faults edited out."""
        return RuleCoder().repair(brief, without_view(concept), robot, feedback)


@dataclass(frozen=True)
class FittingIntegrator:
    """The rules' Integrator, to whom the mount is turned towards the place of work."""

    goal: AnyGoal

    def place(self, brief: Brief, concept: Concept, robot: Robot) -> Placement:
        """Return a placement."""
        goal, view = task_of(self.goal, brief).goal, View.of(concept)
        read = as_the_rules_read(brief, goal, view)
        return as_placed(brief, goal, view, RuleIntegrator().place(read, without_view(concept), robot))

    def adjust(
        self, brief: Brief, concept: Concept, robot: Robot, placement: Placement, feedback: Feedback
    ) -> Placement:
        """Return the placement with overlaps and falls removed."""
        goal, view = task_of(self.goal, brief).goal, View.of(concept)
        read, seen = as_the_rules_read(brief, goal, view), as_viewed(brief, goal, view, placement)
        return as_placed(brief, goal, view, RuleIntegrator().adjust(read, without_view(concept), robot, seen, feedback))


@dataclass(frozen=True)
class FittingJudge:
    """The rules' Judge, who also asks how far the body comes."""

    goal: AnyGoal

    def judge(self, brief: Brief, concept: Concept, robot: Robot, scene: Scene, report: ValidationReport) -> Critique:
        """Return a pass for a sound scene whose body comes near, else what is wrong, or that none came near."""
        task, view = task_of(self.goal, brief), View.of(concept)
        read = as_the_rules_read(brief, task.goal, view)
        critique = RuleJudge().judge(read, concept, robot, scene, report)
        # the rules measure the reach to the middle of what is worked on; how far it is the trial tells
        issues = tuple(issue for issue in critique.issues if issue.component not in ("reach", "offset"))
        if issues:
            return critique.model_copy(update={"issues": issues})
        try:
            found = fit(scene.mjcf, task, robot.actuator_groups, CANDIDATES, 1, MAX_STEPS)
            if not task.is_decisive(found.progress):  # another search may find what the one that chose it did not
                longer = fit(scene.mjcf, task, robot.actuator_groups, _JUDGED_CANDIDATES, 1, _JUDGED_STEPS)
                found = max(found, longer, key=lambda each: each.value)
        except IsolationError as error:
            return Critique(passed=True, summary=f"It could not be tried with its goal: {error}.")
        came = f"progress {found.progress:.2f} of 1 without learning ({found.reached})"
        if found.success or task.is_decisive(found.progress):
            return Critique(passed=True, summary=f"The built-in rules find it sound, and it comes to {came}.")
        return Critique(
            passed=False,
            summary=f"No built-in body came near: the best motion of this one reaches {came}.",
            issues=(
                CritiqueIssue(
                    blame="designer",
                    component="family",
                    problem=f"no built-in body came near: this one reaches {came}",
                    suggestion="name a language model, or bring a robot to start from",
                ),
            ),
        )
