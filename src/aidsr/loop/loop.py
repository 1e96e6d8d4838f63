"""The loop for one concept: iterations until a person or the loop itself approves, or the attempts are used up."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

from aidsr.core.artifacts import Brief, Decision, Outcome
from aidsr.core.errors import BudgetError, ReplyError
from aidsr.loop.iteration import Draft, Iteration
from aidsr.loop.parts import Halt, Parts
from aidsr.loop.routing import Change
from aidsr.runs import DesignFolder, EventLog


@dataclass(frozen=True)
class DesignLoop:
    """Grows one design from its concept."""

    design: DesignFolder
    brief: Brief
    iterations: int
    """Repairs allowed after the first attempt of a round."""
    parts: Parts

    def run(self, log: EventLog, halt: Halt) -> Outcome:
        """Return the outcome, which is also written, after the final files of an approved design.

        Raises:
            HaltedError: Work was asked to stop.
            AidsrError: Work cannot go on, for example because the language model cannot be reached.
        """
        written = self.design.outcome.read()
        if written is not None:
            return written
        concept = self.design.iteration(1).concept.read()
        assert concept is not None, "a design begins with its concept"
        outcome = self._rounds(Draft(concept), log, halt)
        self.design.outcome.write(outcome)
        return outcome

    def _rounds(self, draft: Draft, log: EventLog, halt: Halt) -> Outcome:
        at = _Standing(draft, self.brief, 1 + self.iterations)
        for number in itertools.count(1):
            attempt = Iteration(self.design.iteration(number), at.brief, self.parts, log, halt)
            found = self._next(attempt, at)
            if isinstance(found, Outcome) and at.fallback:
                attempt, at.draft = at.fallback
                found = attempt.decide()
            match found:
                case None:
                    continue
                case Outcome():
                    return found
                case Decision(verdict="approve"):
                    return self._approve(attempt, at.draft)
                case Decision(verdict="quit"):
                    reason = found.text or "A person ended it."
                    return Outcome(outcome="quit", reason=reason, iteration=attempt.folder.number)
                case Decision():
                    brief = _keeping(self.brief, at.draft, found)
                    at = _Standing(at.draft, brief, 1 + self.iterations, Change(concept=found.text))
        raise AssertionError("the attempts are counted")

    def _next(self, attempt: Iteration, at: _Standing) -> Decision | Outcome | None:
        """Make an attempt and return the person's decision or how the design ends; None when it goes on."""
        number = attempt.folder.number
        try:
            at.draft, found = attempt.make(at.draft, at.asked)
        except ReplyError as error:
            return Outcome(outcome="invalid", reason=f"No usable reply came: {error}", iteration=number)
        except BudgetError as error:
            return Outcome(outcome="out_of_budget", reason=str(error), iteration=number, limits=error.limits)
        at.left -= 1
        if isinstance(found, Decision):
            return found
        if found.after_trial:
            return self._after_trial(attempt, at, found)
        at.found_wrong.append(found)
        if at.left <= 0:
            return self._give_up(found, number)
        if self.parts.stalled(at.found_wrong):
            return _stop_early(found, number)
        at.asked = found
        return None

    def _after_trial(self, attempt: Iteration, at: _Standing, found: Change) -> Outcome | None:
        """Send a design back that fell short on its task; after the last time, keep what came farthest."""
        at.shortfalls.append(found)
        if not at.fallback or _progress(attempt) > _progress(at.fallback[0]):
            at.fallback = attempt, at.draft
        if len(at.shortfalls) > self.parts.task_rounds or self.parts.stalled(at.shortfalls):
            return _stop_early(found, attempt.folder.number)
        at.left, at.found_wrong, at.asked = 1 + self.iterations, [], found
        return None

    def _approve(self, attempt: Iteration, draft: Draft) -> Outcome:
        scene = attempt.folder.scene.read()
        assert scene is not None, "only an assembled scene is judged"
        assert draft.robot is not None, "only a robot is placed in a scene"
        self.design.final_robot.write(draft.robot.mjcf.encode())
        self.design.final_scene.write(scene.mjcf.encode())
        critique, tried = attempt.folder.critique.read(), attempt.folder.task_report.read()
        reason = critique.summary if critique and critique.summary else "Stable, and passed by the Judge."
        if tried is not None:
            reason += f" {tried.critique.summary}"
        return Outcome(outcome="approved", reason=reason, iteration=attempt.folder.number)

    def _give_up(self, wanted: Change, number: int) -> Outcome:
        attempts = 1 + self.iterations
        still = f"Still wrong after {attempts} {'attempt' if attempts == 1 else 'attempts'}: {wanted.reason}"
        return Outcome(outcome="invalid", reason=still, iteration=number)


@dataclass
class _Standing:
    """Where a design stands in a round."""

    draft: Draft
    brief: Brief
    left: int
    """Attempts."""
    asked: Change = field(default_factory=Change)
    found_wrong: list[Change] = field(default_factory=list)
    shortfalls: list[Change] = field(default_factory=list)
    """What scenes fell short by that the Judge had passed."""
    fallback: tuple[Iteration, Draft] | None = None
    """The one of them that came farthest; it is kept where nothing better follows."""


def _progress(attempt: Iteration) -> float:
    report = attempt.folder.task_report.read()
    return report.progress if report else 0.0


def _stop_early(wanted: Change, number: int) -> Outcome:
    reason = f"Stopped early: iterations {number - 1} and {number} found the same, no better: {wanted.reason}"
    return Outcome(outcome="invalid", reason=reason, iteration=number)


def _keeping(brief: Brief, draft: Draft, decision: Decision) -> Brief:
    """Return the job of the next round: with parts to keep, it starts from the robot that has them."""
    if not decision.keep:
        return brief
    assert draft.robot is not None, "a person decides about a robot"
    return brief.model_copy(update={"starting_robot": draft.robot.mjcf, "keep": decision.keep})
