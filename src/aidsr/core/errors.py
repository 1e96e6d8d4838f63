"""The exceptions of AID-SR.

A bad design is never an exception: the validator reports its faults (see `aidsr.core.artifacts.Fault`). The exceptions:

    AidsrError
    ├── UserError            the user must change something: one sentence, exit code 2, no traceback
    ├── MjcfError            an MJCF text cannot be loaded; holds the faults, which callers turn into a report
    ├── IsolationError       a child process exceeded its limits, or crashed because of its input
    ├── WorkerLostError      child processes were ended from outside repeatedly: a fault of the machine, not of a design
    ├── NoBetterDesignError  a Designer has nothing new to try
    ├── ReplyError           a reply of a language model cannot be used: the request is repeated a few times
    ├── BudgetError          the next call could cost more than the user allowed
    └── ModelError           a language model could not be reached, or refused permanently

Any other exception is a bug in AID-SR and keeps its traceback.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from aidsr.core.artifacts import Fault
    from aidsr.core.calls import CallRecord

Limit = Literal["cost_usd", "tokens"]
"""Limited quantities of language models: cost [USD], and tokens, input and output together."""


class AidsrError(Exception):
    """Base class of all exceptions that AID-SR raises on purpose.

    Attributes:
        failed_call: Record of the call to a language model that gave no reply; None if no call was attempted.
    """

    failed_call: CallRecord | None = None


class UserError(AidsrError):
    """The user of AID-SR must change something.

    The message has one or two sentences: first the fault, then what to do.
    """


class MjcfError(AidsrError):
    """An MJCF text cannot be loaded as a model.

    Attributes:
        faults: All faults found; never empty.
        source: File or folder that the text was read from; empty if unknown.
    """

    source: str = ""

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("; ".join(fault.message for fault in self.faults))

    def __str__(self) -> str:
        told = super().__str__()
        return f"{self.source}: {told}" if self.source else told


@contextmanager
def with_source(source: object) -> Iterator[None]:
    """Add the file or folder that MJCF was read from to every `MjcfError` raised in the context."""
    try:
        yield
    except MjcfError as error:
        error.source = error.source or str(source)
        raise


class IsolationError(AidsrError):
    """A child process returned no result because of its input.

    Attributes:
        kind: "time" or "memory" if it exceeded a limit, "overflow" if numbers left the range of floating point, "crash"
            if a native library failed for another reason.
    """

    def __init__(self, kind: Literal["time", "memory", "overflow", "crash"], message: str) -> None:
        self.kind = kind
        super().__init__(message)


class WorkerLostError(AidsrError):
    """Child processes were ended from outside or could not start, for example because the machine ran out of memory.

    The cause is not their input, so no caller turns this error into a fault of a design.
    """


class NoBetterDesignError(AidsrError):
    """A Designer has nothing new to try against the reported problems. It ends the design; the message is for users."""


class ReplyError(AidsrError):
    """A reply cannot be used. The message is addressed to the language model, which gets it with the next request."""


class BudgetError(AidsrError):
    """The next call to a language model could exceed the budget of the run or the design, so it was not made.

    Args:
        message: The limit, the amount used so far and the amount that the call could need.
        limits: All limits that the call could exceed.
    """

    def __init__(self, message: str, *limits: Limit) -> None:
        super().__init__(message)
        self.limits = limits


class ModelError(AidsrError):
    """A language model gave no usable reply after all retries. The message never contains a key."""
