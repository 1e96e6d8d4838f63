"""One step of the method: a value that is computed once and stored in a file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import TypeVar

from aidsr.core.errors import IsolationError, MjcfError
from aidsr.core.roles import Designer, TriesBodies
from aidsr.loop.parts import Halt, Picture
from aidsr.runs import EventLog
from aidsr.runs.events import NoPicture, Step, StepDone, StepStarted, Tried
from aidsr.runs.files import BytesFile, Stored

Value = TypeVar("Value")


class HaltedError(Exception):
    """Work was requested to stop; everything finished so far is on disk."""


def reporting(designer: Designer, log: EventLog) -> Designer:
    """Return the same Designer; one that tries bodies writes each of them to the log."""
    if not isinstance(designer, TriesBodies):
        return designer
    return designer.with_listener(lambda body: log.write(Tried.model_validate(asdict(body))))


@dataclass(frozen=True)
class Steps:
    """Runs the steps whose files do not exist yet. Resuming needs nothing else: it runs the same code as starting."""

    log: EventLog
    halt: Halt
    iteration: int | None = None

    def run(
        self,
        step: Step,
        file: Stored[Value],
        compute: Callable[[], Value],
        summarize: Callable[[Value], str] = lambda _value: "",
    ) -> Value:
        """Return the content of the step's file; compute and write it first if it does not exist.

        Raises:
            HaltedError: Work was requested to stop before the step began.
        """
        value = file.read()
        if value is not None:
            return value
        if self.halt():
            raise HaltedError
        self.log.write(StepStarted(step=step, iteration=self.iteration))
        value = compute()
        file.write(value)
        self.log.write(StepDone(step=step, iteration=self.iteration, summary=summarize(value)))
        return value

    def draw(self, step: Step, file: BytesFile, picture: Picture, mjcf: str) -> None:
        """Render a model once; if this fails, log the reason and continue."""
        try:
            self.run(step, file, lambda: picture(mjcf))
        except (MjcfError, IsolationError) as error:
            self.log.write(NoPicture(step=step, iteration=self.iteration, reason=str(error)))
