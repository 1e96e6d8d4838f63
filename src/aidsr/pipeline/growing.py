"""The loop for one concept: iterations until a person or the loop itself approves, or the attempts are used up."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from aidsr.artifacts import Brief, Decision, Outcome
from aidsr.errors import BudgetError, ReplyError
from aidsr.pipeline.attempt import Attempt, Draft
from aidsr.pipeline.parts import Halt, Parts
from aidsr.pipeline.routing import Change
from aidsr.runs import DesignFolder, EventLog

__all__ = ["Growth"]


@dataclass(frozen=True)
class Growth:
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
        asked, left, brief = Change(), 1 + self.iterations, self.brief
        found_wrong: list[Change] = []
        for number in itertools.count(1):
            attempt = Attempt(self.design.iteration(number), brief, self.parts, log, halt)
            try:
                draft, found = attempt.make(draft, asked)
            except ReplyError as error:
                return Outcome(outcome="invalid", reason=f"No usable reply came: {error}", iteration=number)
            except BudgetError as error:
                return Outcome(outcome="out_of_budget", reason=str(error), iteration=number)
            left -= 1
            match found:
                case Decision(verdict="approve"):
                    return self._approve(attempt, draft)
                case Decision(verdict="quit"):
                    return Outcome(outcome="quit", reason=found.text or "A person ended it.", iteration=number)
                case Decision():
                    asked, left = Change(concept=found.text), 1 + self.iterations
                    brief = _keeping(self.brief, draft, found)
                    found_wrong.clear()
                case _:
                    found_wrong.append(found)
                    if left <= 0:
                        return self._give_up(found, number)
                    if self.parts.stalled(found_wrong):
                        return _stop_early(found, number)
                    asked = found
        raise AssertionError("the attempts are counted")

    def _approve(self, attempt: Attempt, draft: Draft) -> Outcome:
        scene = attempt.folder.scene.read()
        assert scene is not None, "only an assembled scene is judged"
        assert draft.robot is not None, "only a robot is placed in a scene"
        self.design.final_robot.write(draft.robot.mjcf.encode())
        self.design.final_scene.write(scene.mjcf.encode())
        critique = attempt.folder.critique.read()
        reason = critique.summary if critique and critique.summary else "Stable, and passed by the Judge."
        return Outcome(outcome="approved", reason=reason, iteration=attempt.folder.number)

    def _give_up(self, wanted: Change, number: int) -> Outcome:
        attempts = 1 + self.iterations
        still = f"Still wrong after {attempts} {'attempt' if attempts == 1 else 'attempts'}: {wanted.reason}"
        return Outcome(outcome="invalid", reason=still, iteration=number)


def _stop_early(wanted: Change, number: int) -> Outcome:
    reason = f"Stopped early: iterations {number - 1} and {number} found the same, no better: {wanted.reason}"
    return Outcome(outcome="invalid", reason=reason, iteration=number)


def _keeping(brief: Brief, draft: Draft, decision: Decision) -> Brief:
    """Return the job of the next round: with parts to keep, it starts from the robot that has them."""
    if not decision.keep:
        return brief
    assert draft.robot is not None, "a person decides about a robot"
    return brief.model_copy(update={"starting_robot": draft.robot.mjcf, "keep": decision.keep})
