"""The human step. The answer is a file, so that a terminal, an editor, a browser or a test can give it."""

from __future__ import annotations

import time
from dataclasses import dataclass

from aidsr.artifacts import Decision
from aidsr.errors import UserError
from aidsr.pipeline.parts import Halt
from aidsr.pipeline.steps import HaltedError
from aidsr.runs import EventLog, IterationFolder
from aidsr.runs.events import Decided, DecisionUnreadable, Waiting

__all__ = ["DecisionFile", "approve_at_once"]


def approve_at_once(iteration: IterationFolder, log: EventLog, halt: Halt) -> Decision:
    """Approve what the Judge passed; nobody is asked and no file is written."""
    del iteration, log, halt
    return Decision(verdict="approve")


@dataclass(frozen=True)
class DecisionFile:
    """Waits until somebody writes decision.json into the folder of the iteration."""

    poll_s: float = 0.5

    def __call__(self, iteration: IterationFolder, log: EventLog, halt: Halt) -> Decision:
        """Return the decision once it can be read; a file that cannot be is reported once for each way it fails."""
        decision, complaint = _look(iteration)
        if decision is not None:
            return decision
        log.write(Waiting(iteration=iteration.number))
        reported = ""
        while decision is None:
            if complaint != reported:
                reported = complaint
                log.write(DecisionUnreadable(iteration=iteration.number, reason=complaint))
            if halt():
                raise HaltedError
            time.sleep(self.poll_s)
            decision, complaint = _look(iteration)
        log.write(Decided(iteration=iteration.number, verdict=decision.verdict))
        return decision


def _look(iteration: IterationFolder) -> tuple[Decision | None, str]:
    """Return the decision, or what is wrong with the file; neither while there is none, or one just being written.

    An editor empties a file before it fills it.
    """
    path = iteration.decision.path
    if path.exists() and not path.stat().st_size:
        return None, ""
    try:
        return iteration.decision.read(), ""
    except UserError as error:
        return None, str(error)
