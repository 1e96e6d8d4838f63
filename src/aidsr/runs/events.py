"""Event logs with order, time and errors: append-only events.jsonl files with one JSON line for each event.

Contents are in other files. The run has one log and each design has its own; each log has one writer at a time.
"""

from __future__ import annotations

import errno
import itertools
import os
import re
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, TypeAdapter, ValidationError

from aidsr.core.artifacts import Artifact, Outcome
from aidsr.core.errors import UserError
from aidsr.core.storage_errors import storage_errors

Step = Literal[
    "concepts",
    "concept",
    "robot",
    "robot_report",
    "placement",
    "scene",
    "scene_report",
    "preview",
    "critique",
    "task_report",
    "measured_again",
    "motion",
]
"""Steps, each named after the file that it writes."""


def _with_offset(time: str) -> str:
    """Check that the time of an event has a UTC offset; it is empty until the event is written."""
    if time and datetime.fromisoformat(time).utcoffset() is None:
        raise ValueError(_NO_OFFSET)
    return time


_NO_OFFSET = "a time without its offset from UTC"


class _Event(Artifact):
    time: Annotated[str, AfterValidator(_with_offset)] = ""
    """Time in ISO 8601 with UTC offset; set by the log."""


class Started(_Event):
    """A process started or resumed the work."""

    kind: Literal["started"] = "started"


class StepStarted(_Event):
    """A step started because its file does not exist yet."""

    kind: Literal["begun"] = "begun"
    step: Step
    iteration: int | None = None


class StepDone(_Event):
    """The file of a step was written."""

    kind: Literal["done"] = "done"
    step: Step
    iteration: int | None = None
    summary: str = ""
    """Result in a few words: "stable", "2 faults: chatter, underdamped", "passed"."""


class Tried(_Event):
    """A Designer tried a body before it proposed concepts, or again in a resumed run before it revised one."""

    kind: Literal["tried"] = "tried"
    name: str
    number: int
    """Number of the body, from 1; it stays the same when the body is tried again."""
    most: int
    """Largest number of bodies that are tried."""
    progress: float | None
    """Task progress reached, 0 to 1; None where the body could not be simulated."""
    succeeded: bool
    """Whether a motion succeeded at the task."""
    seconds: float
    """Duration of the trial [s]."""
    refused: bool = False
    """Whether the Judge rejected it earlier; it is then tried again only when a resumed run ranks all bodies anew."""
    motions: int = 0
    """Number of motions in a repeated trial of a body with much progress; 0 for a first trial and in older logs."""


class Repaired(_Event):
    """Code repaired unambiguous mistakes in the new robot; the robot and notes on the repairs are in files."""

    kind: Literal["repaired"] = "repaired"
    iteration: int
    counts: dict[str, int]
    """Number of repairs of each kind."""


class NoPicture(_Event):
    """A picture could not be drawn, for the given reason."""

    kind: Literal["no_picture"] = "no_picture"
    step: Step
    iteration: int | None = None
    reason: str


class Waiting(_Event):
    """The design waits for a person's decision in the iteration's decision.json."""

    kind: Literal["waiting"] = "waiting"
    iteration: int


class DecisionUnreadable(_Event):
    """A decision.json is invalid; the design continues to wait."""

    kind: Literal["decision_unreadable"] = "decision_unreadable"
    iteration: int
    reason: str


class Decided(_Event):
    """A person decided."""

    kind: Literal["decided"] = "decided"
    iteration: int
    verdict: Literal["approve", "refine", "quit"]


class Stopped(_Event):
    """Work ended before the outcome; the run can be resumed."""

    kind: Literal["stopped"] = "stopped"
    cause: Literal["error", "bug", "interrupted"]
    """"error" is an exception of `aidsr.core.errors`, recorded as one sentence; "bug" is any other exception, recorded
    with its traceback."""
    message: str
    traceback: str = ""


class Finished(_Event):
    """The outcome of a design was written; in the log of a run, the outcomes of all designs were."""

    kind: Literal["finished"] = "finished"
    outcome: Outcome | None = None


Event = Annotated[
    Started
    | StepStarted
    | StepDone
    | Tried
    | Repaired
    | NoPicture
    | Waiting
    | DecisionUnreadable
    | Decided
    | Stopped
    | Finished,
    Field(discriminator="kind"),
]
_ADAPTER: TypeAdapter[Event] = TypeAdapter(Event)

_GLANCES_S = (0.01, 0.05)
"""Pauses between attempts to lock a log [s], since `at_work` holds the lock for a moment when it checks."""
_SECRET_NAME = re.compile(r"KEY|TOKEN|SECRET|PASSWORD|CREDENTIAL", re.IGNORECASE)
_SHORTEST_SECRET = 8
"""Length from which values are removed. Our choice: shorter values are words like "1" or "true" of ordinary text."""


def without_secrets(text: str) -> str:
    """Return `text` with the value of every environment variable with a secret-like name replaced by that name."""
    for name, value in os.environ.items():
        if _SECRET_NAME.search(name) and len(value) >= _SHORTEST_SECRET:
            text = text.replace(value, f"[{name}]")
    return text


def _utc_now() -> datetime:
    return datetime.now(UTC)


class EventLog:
    """The only writer of an events.jsonl. While it is open, a second writer in this or another process is refused.

    Args:
        path: The events.jsonl; created if missing. An unfinished last line of a killed writer is cut off.
        listen: Called with each event after it is written.
        now: Clock.

    Raises:
        UserError: Another writer has the log open.
    """

    def __init__(
        self,
        path: Path,
        listen: Callable[[Event], None] = lambda _event: None,
        now: Callable[[], datetime] = _utc_now,
    ) -> None:
        with storage_errors(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
        self._listen = listen
        self._now = now
        self._path = path
        try:
            _lock(self._file, path)
            content = path.read_bytes()
            if content and not content.endswith(b"\n"):
                os.ftruncate(self._file, content.rfind(b"\n") + 1)
        except BaseException:
            os.close(self._file)
            raise

    def write(self, event: Event) -> None:
        """Append one event with the current time, then call the listener.

        Raises:
            StorageError: The event cannot be written, as on a full disk.
        """
        timed = event.model_copy(update={"time": self._now().isoformat(timespec="milliseconds")})
        self._append(timed.model_dump_json(exclude_none=True).encode() + b"\n")
        self._listen(timed)

    def _append(self, line: bytes) -> None:
        """Write a whole line or nothing; a partial line, as on a full disk, is removed again."""
        before = os.fstat(self._file).st_size
        with storage_errors(self._path):
            written = os.write(self._file, line)
            if written < len(line):
                os.ftruncate(self._file, before)
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.close(self._file)


def _lock(file: int, path: Path) -> None:
    """Lock the log until it is closed; the system releases the lock when the process ends.

    Raises:
        UserError: Another writer holds the lock.
    """
    try:
        import fcntl
    except ImportError:  # Windows has no flock: there, nothing prevents two processes from working on one run
        return
    try:
        for pause_s in (*_GLANCES_S, None):
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                if pause_s is None:
                    raise
                time.sleep(pause_s)
            else:
                return
    except BlockingIOError:
        raise UserError(f"another process is at work on {path.parent}; wait for it or end it, then try again") from None
    except OSError as error:
        if error.errno not in (errno.ENOLCK, errno.ENOTSUP):  # file systems without locks are treated like Windows
            raise


def at_work(path: Path) -> bool | None:
    """Whether a process on this machine has a log open for writing; None where the system cannot tell."""
    try:
        import fcntl
    except ImportError:  # as in `_lock`
        return None
    if not path.exists():
        return False
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        except OSError:
            return None
    return False


def read_events(path: Path) -> tuple[Event, ...]:
    """Return the events in order, or none if the file is missing. An unfinished last line is ignored.

    Raises:
        UserError: A complete line is not an event.
        StorageError: The file cannot be read, as without the permission.
    """
    try:
        with storage_errors(path):
            content = path.read_bytes()
    except FileNotFoundError:
        return ()
    events = []
    for number, line in enumerate(content.split(b"\n")[:-1], start=1):
        try:
            event = _ADAPTER.validate_json(line)
        except ValidationError:
            event = None
        if event is None or not event.time:
            raise UserError(f"line {number} of {path} is not an event of AID-SR; remove or restore that line")
        events.append(event)
    return tuple(events)


def working_time_s(events: Sequence[Event], until: datetime | None = None) -> float:
    """Return the working time [s], without pauses between processes and without waiting for a person.

    Args:
        events: Events of one log, in order.
        until: Time up to which work in progress is counted; None counts up to the last event.
    """
    total_s = 0.0
    for before, after in itertools.pairwise(events):
        if not isinstance(before, Waiting | DecisionUnreadable) and not isinstance(after, Started):
            total_s += (_time(after) - _time(before)).total_seconds()
    if until is not None and events and not isinstance(events[-1], Waiting | DecisionUnreadable | Stopped | Finished):
        total_s += max(0.0, (until - _time(events[-1])).total_seconds())
    return total_s


def _time(event: Event) -> datetime:
    return datetime.fromisoformat(event.time)
