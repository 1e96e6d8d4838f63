"""The human step. The decision is a file, so it can come from a terminal, an editor, a browser or a test."""

from __future__ import annotations

import time
from dataclasses import dataclass

from aidsr.core.artifacts import Decision
from aidsr.core.errors import UserError
from aidsr.loop.parts import Halt
from aidsr.loop.steps import HaltedError
from aidsr.runs import EventLog, IterationFolder
from aidsr.runs.events import Decided, DecisionUnreadable, Waiting


def approve(iteration: IterationFolder, log: EventLog, halt: Halt) -> Decision:
    """Approve a scene that the Judge passed, without a person and without a file."""
    del iteration, log, halt
    return Decision(verdict="approve")


@dataclass(frozen=True)
class DecisionFile:
    """Waits for decision.json in the folder of the iteration."""

    poll_s: float = 0.5

    def __call__(self, iteration: IterationFolder, log: EventLog, halt: Halt) -> Decision:
        """Return the decision as soon as it can be read; log each new reason why the file cannot be read."""
        decision, problem = _read_decision(iteration)
        if decision is not None:
            return decision
        log.write(Waiting(iteration=iteration.number))
        reported = ""
        while decision is None:
            if problem and problem != reported:
                reported = problem
                log.write(DecisionUnreadable(iteration=iteration.number, reason=problem))
            if halt():
                raise HaltedError
            time.sleep(self.poll_s)
            decision, problem = _read_decision(iteration)
        log.write(Decided(iteration=iteration.number, verdict=decision.verdict))
        return decision


@dataclass(frozen=True)
class PresetFeedback:
    """Gives feedback that was written before the run, once for each design, and writes it to decision.json."""

    text: str

    def __call__(self, iteration: IterationFolder, log: EventLog, halt: Halt) -> Decision:
        """Return a refinement with the preset text for the first scene of a design, and approval for all later ones."""
        del halt
        written = iteration.decision.read()
        if written is not None:
            return written
        earlier = [path for path in iteration.path.parent.glob("*/decision.json") if path.parent != iteration.path]
        if earlier:
            return Decision(verdict="approve")
        decision = Decision(verdict="refine", text=self.text)
        iteration.decision.write(decision)
        log.write(Decided(iteration=iteration.number, verdict=decision.verdict))
        return decision


def _read_decision(iteration: IterationFolder) -> tuple[Decision | None, str]:
    """Return the decision, or the problem of the file; neither while the file is missing or being written.

    An editor empties a file before it fills it, so a problem counts only if the file did not change in the meantime.
    """
    before = _content(iteration)
    if not before:
        return None, ""
    try:
        return iteration.decision.read(), ""
    except UserError as error:
        return None, str(error) if _content(iteration) == before else ""


def _content(iteration: IterationFolder) -> bytes:
    path = iteration.decision.path
    return path.read_bytes() if path.exists() else b""
