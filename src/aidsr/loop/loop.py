"""The loop for one concept: iterations until the design is approved, stops improving, or has used up its iterations."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from enum import Enum, auto

from aidsr.core.artifacts import Brief, Decision, Outcome, Robot
from aidsr.core.errors import BudgetError, NoBetterDesignError, ReplyError
from aidsr.loop.iteration import Draft, Iteration
from aidsr.loop.parts import Halt, Parts
from aidsr.loop.routing import Change
from aidsr.runs import DesignFolder, EventLog, Run
from aidsr.runs.status import newest

_MEASURED_AGAIN = 3
"""Number of scenes that are measured again, among those that fell short, best first. Our choice."""


class _Next(Enum):
    """What follows an iteration that ends neither with a decision nor with an outcome."""

    ITERATION = auto()
    """Another iteration."""
    BEST_TRIED = auto()
    """No more trials: the scene that got farthest in its trial is decided on."""


@dataclass(frozen=True)
class DesignLoop:
    """Develops one design from its concept: each iteration fixes the problems that the previous one found."""

    design: DesignFolder
    brief: Brief
    iterations: int
    """Number of repairs allowed after the first iteration of a round."""
    parts: Parts

    def run(self, log: EventLog, halt: Halt) -> Outcome:
        """Return the outcome; for an approved design, write the final files first and then the outcome.

        Raises:
            HaltedError: Work was requested to stop.
            AidsrError: Work cannot continue, for example because the language model cannot be reached.
        """
        written = self.design.outcome.read()
        if written is not None:
            return written
        concept = self.design.iteration(1).concept.read()
        assert concept is not None, "a design begins with its concept"
        outcome = self._iterate(Draft(concept), log, halt)
        self.design.outcome.write(outcome)
        return outcome

    def _iterate(self, draft: Draft, log: EventLog, halt: Halt) -> Outcome:
        """Run iterations until the design ends; the decision "refine" starts a new round."""
        state = _Round(draft, self.brief, 1 + self.iterations)
        for number in itertools.count(1):
            iteration = Iteration(self.design.iteration(number), state.brief, self.parts, log, halt)
            result = self._run_iteration(iteration, state)
            if result is _Next.ITERATION:
                continue
            if isinstance(result, Outcome) and self._may_continue(result):
                return result
            if result is _Next.BEST_TRIED or (isinstance(result, Outcome) and state.fell_short):
                iteration, state.draft = self._came_farthest(state.fell_short)
                result = iteration.decide()
            elif isinstance(result, Outcome) and state.measured:
                result = self._with_best(result, state.measured)
            match result:
                case Outcome():
                    return result
                case Decision(verdict="approve"):
                    return self._approve(iteration, state.draft)
                case Decision(verdict="quit"):
                    reason = result.text or "Ended by the reviewer."
                    return Outcome(outcome="quit", reason=reason, iteration=iteration.folder.number)
                case Decision():
                    brief = _brief_with_kept_parts(self.brief, state.draft, result)
                    state = _Round(state.draft, brief, 1 + self.iterations, Change(concept=result.text))
        raise AssertionError("the iterations of a round are limited")

    def _may_continue(self, ended: Outcome) -> bool:
        """Whether the design ran out of a budget that was replaced before, as a study does, and may be again."""
        return ended.outcome == "out_of_budget" and Run(self.design.path.parent.parent).larger_budget.exists()

    def _run_iteration(self, iteration: Iteration, state: _Round) -> Decision | Outcome | _Next:
        """Run an iteration; return the decision, the outcome if the design ends, or what follows."""
        number = iteration.folder.number
        try:
            state.draft, result = iteration.run(state.draft, state.requested)
        except ReplyError as error:
            return Outcome(outcome="invalid", reason=f"No usable reply: {error}", iteration=number)
        except NoBetterDesignError as error:
            return Outcome(outcome="invalid", reason=str(error), iteration=number)
        except BudgetError as error:
            return Outcome(outcome="out_of_budget", reason=str(error), iteration=number, limits=error.limits)
        state.iterations_left -= 1
        if isinstance(result, Decision):
            return result
        if result.after_trial:
            return self._after_trial(iteration, state, result)
        state.changes.append(result)
        if _judged_progress(iteration) is not None:
            state.measured.append(iteration)
        if state.iterations_left <= 0:
            return self._give_up(result, number)
        if (ago := self.parts.stalled(state.changes)) is not None:
            return _stop_early(result, number - ago, number)
        state.requested = result
        return _Next.ITERATION

    def _after_trial(self, iteration: Iteration, state: _Round, change: Change) -> _Next:
        """Send back a design that fell short in its trial, unless its trials are used up or do not get farther."""
        state.trial_changes.append(change)
        state.fell_short.append((iteration, state.draft))
        if len(state.trial_changes) > self.parts.task_rounds or self.parts.stalled(state.trial_changes) is not None:
            return _Next.BEST_TRIED
        state.iterations_left, state.changes, state.requested = 1 + self.iterations, [], change
        return _Next.ITERATION

    def _with_best(self, ended: Outcome, measured: list[Iteration]) -> Outcome:
        """Return the outcome of a design that never passed, with the best robot that the Judge measured."""
        best = max(measured, key=lambda one: _judged_progress(one) or 0.0).folder
        if ended.outcome != "invalid" or best.number == ended.iteration:
            return ended
        critique = best.critique.read()
        concept = newest(it.concept.read() for it in self.design.leading_to(best.number))
        assert critique is not None, "only what was judged is measured"
        assert concept is not None, "a design begins with its concept"
        scene = best.scene.xml.path.relative_to(self.design.path.parent.parent).as_posix()
        reason = (
            f"The best robot is {concept.name}, iteration {best.number}. {critique.summary} "
            f"To train it anyway: aidsr train {scene} --goal goal.toml, in the run's folder. {ended.reason}"
        )
        return Outcome(outcome="invalid", reason=reason, iteration=best.number)

    def _came_farthest(self, tried: list[tuple[Iteration, Draft]]) -> tuple[Iteration, Draft]:
        """Return the iteration that gets farthest when the best are measured again, with other seeds."""
        best = sorted(tried, key=lambda one: -_progress(one[0]))[:_MEASURED_AGAIN]
        if len(best) == 1 or self.parts.measure_again is None:
            return best[0]
        return max(best, key=lambda one: one[0].measure_again(_robot_of(one[1])).progress)

    def _approve(self, iteration: Iteration, draft: Draft) -> Outcome:
        folder = iteration.folder
        scene = folder.scene.read()
        assert scene is not None, "only an assembled scene is judged"
        self.design.final_robot.write(_robot_of(draft).mjcf.encode())
        self.design.final_scene.write(scene.mjcf.encode())
        critique, trial = folder.critique.read(), folder.task_report.read()
        reason = critique.summary if critique and critique.summary else "Stable, and passed by the Judge."
        if trial is not None:
            reason += f" {trial.critique.summary}"
        return Outcome(outcome="approved", reason=reason, iteration=folder.number)

    def _give_up(self, change: Change, number: int) -> Outcome:
        attempts = 1 + self.iterations
        reason = f"Faults remain after {attempts} {'attempt' if attempts == 1 else 'attempts'}: {change.reason}"
        return Outcome(outcome="invalid", reason=reason, iteration=number)


@dataclass
class _Round:
    """State of a design during a round."""

    draft: Draft
    brief: Brief
    iterations_left: int
    requested: Change = field(default_factory=Change)
    """Change requested from the next iteration."""
    changes: list[Change] = field(default_factory=list)
    """Changes requested by the iterations, before the Judge passed the design."""
    trial_changes: list[Change] = field(default_factory=list)
    """Changes requested by the trials on the task, after the Judge passed the design."""
    measured: list[Iteration] = field(default_factory=list)
    """Iterations that the Judge did not pass but whose progress it measured."""
    fell_short: list[tuple[Iteration, Draft]] = field(default_factory=list)
    """Iterations that the Judge passed and whose trial fell short; one of them is kept if nothing better follows."""


def _robot_of(draft: Draft) -> Robot:
    assert draft.robot is not None, "only a robot is tried"
    return draft.robot


def _judged_progress(iteration: Iteration) -> float | None:
    critique = iteration.folder.critique.read()
    return critique.progress if critique else None


def _progress(iteration: Iteration) -> float:
    report = iteration.folder.task_report.read()
    return report.progress if report else 0.0


def _stop_early(change: Change, matched: int, number: int) -> Outcome:
    """Return the outcome of a design whose iteration found what an earlier, matched one had found."""
    same = f"iterations {matched} and {number} found the same faults, without improvement"
    reason = f"Stopped early: {same}: {change.reason}"
    return Outcome(outcome="invalid", reason=reason, iteration=number)


def _brief_with_kept_parts(brief: Brief, draft: Draft, decision: Decision) -> Brief:
    """Return the brief of the next round; if parts are to be kept, it starts from the robot that has them."""
    if not decision.keep:
        return brief
    assert draft.robot is not None, "a person decides about a robot"
    return brief.model_copy(update={"starting_robot": draft.robot.mjcf, "keep": decision.keep})
