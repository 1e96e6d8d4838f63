"""The exceptions of AID-SR.

A bad design is never an exception: the validator returns it as faults (see `aidsr.core.artifacts.Fault`). What is left:

    AidsrError
    ├── UserError         the person must change something: one sentence, exit 2, no traceback
    ├── MjcfError         an MJCF text that cannot be loaded, as faults; callers turn it into a report
    ├── IsolationError    a child process ran past its limits, or crashed on what it was given
    ├── WorkerLostError   a child process was ended from outside, again and again: the machine's fault, never a design's
    ├── ReplyError        a language model's reply could not be used: asked again, a bounded number of times
    ├── BudgetError       the next call could cost more than the person allowed
    └── ModelError        a language model could not be reached or refused for good

Anything else that is raised is a bug of ours and keeps its traceback.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from aidsr.core.artifacts import Fault
    from aidsr.core.calls import CallRecord

Limit = Literal["cost_usd", "tokens"]
"""What of language models may be limited: money, and tokens in and out."""


class AidsrError(Exception):
    """Base class of everything AID-SR raises on purpose.

    Attributes:
        failed_call: The call to a language model that brought no reply, where it was attempted at all.
    """

    failed_call: CallRecord | None = None


class UserError(AidsrError):
    """The person using AID-SR must change something.

    The message is one sentence or two: the fault first, then what to do.
    """


class MjcfError(AidsrError):
    """An MJCF text cannot become a model.

    Attributes:
        faults: Everything found wrong, never empty.
        source: The file that was named, where one was.
    """

    source: str = ""

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("; ".join(fault.message for fault in self.faults))

    def __str__(self) -> str:
        told = super().__str__()
        return f"{self.source}: {told}" if self.source else told


@contextmanager
def about(source: object) -> Iterator[None]:
    """Name the file or folder, in what is found wrong with the MJCF that was read from it."""
    try:
        yield
    except MjcfError as error:
        error.source = error.source or str(source)
        raise


class IsolationError(AidsrError):
    """A child process did not come back with an answer, because of what it was given.

    Attributes:
        kind: "time" or "memory" when it ran past a limit, "overflow" when numbers left the range of floating point,
            "crash" when a native library failed for another reason.
    """

    def __init__(self, kind: Literal["time", "memory", "overflow", "crash"], message: str) -> None:
        self.kind = kind
        super().__init__(message)


class WorkerLostError(AidsrError):
    """Child processes were ended from outside or could not start, as where the machine runs out of memory.

    It says nothing about what they were given, so no caller turns it into a fault of a design.
    """


class NoBetterDesignError(AidsrError):
    """A Designer has nothing new to try for what was found wrong. The message ends the design, and is for a person."""


class ReplyError(AidsrError):
    """A reply arrived and cannot be used. The message is written for the model that is asked again."""


class BudgetError(AidsrError):
    """The next call to a language model could exceed the budget of the run or the design, so it was not made.

    Args:
        message: Which limit, what was used of it and what the call could take.
        limits: All limits that refused it.
    """

    def __init__(self, message: str, *limits: Limit) -> None:
        super().__init__(message)
        self.limits = limits


class ModelError(AidsrError):
    """A language model gave no usable reply after all retries. Never contains a key."""
