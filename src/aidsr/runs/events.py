"""Events: order, time and errors, one JSON line each in an append-only events.jsonl. Content lives in files instead.

Each log has one writer at a time: the run has one log, and each design has its own.
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
"""A step is named after the file it writes."""


def _with_offset(time: str) -> str:
    """Check the time of an event; it is empty until the event is written."""
    if time and datetime.fromisoformat(time).utcoffset() is None:
        raise ValueError(_NO_OFFSET)
    return time


_NO_OFFSET = "a time without its offset from UTC"


class _Event(Artifact):
    time: Annotated[str, AfterValidator(_with_offset)] = ""
    """ISO 8601 with zone; set by the log."""


class Started(_Event):
    """A process started or resumed the work."""

    kind: Literal["started"] = "started"


class StepStarted(_Event):
    """A step whose file does not exist yet began."""

    kind: Literal["begun"] = "begun"
    step: Step
    iteration: int | None = None


class StepDone(_Event):
    """The file of a step is written."""

    kind: Literal["done"] = "done"
    step: Step
    iteration: int | None = None
    summary: str = ""
    """What came out, in a few words: "stable", "2 faults: chatter, underdamped", "passed"."""


class Tried(_Event):
    """A Designer tried a body before proposing any."""

    kind: Literal["tried"] = "tried"
    name: str
    number: int
    """Which of those tried, from 1 on; a body keeps it where it is tried again."""
    most: int
    """How many are tried at most."""
    progress: float | None
    """How far it came, 0 to 1; None where it could not be played."""
    succeeded: bool
    seconds: float
    """How long that took."""
    refused: bool = False
    """Whether the Judge refused it before; it is tried again only where a resumed run ranks all bodies anew."""
    motions: int = 0
    """With how many motions it is tried again because it came far; 0 the first time, and in events of before."""


class Repaired(_Event):
    """Code repaired unambiguous mistakes in the robot just written; the text and notes are in files."""

    kind: Literal["repaired"] = "repaired"
    iteration: int
    counts: dict[str, int]
    """How often each kind of repair was made."""


class NoPicture(_Event):
    """A picture could not be drawn, and why."""

    kind: Literal["no_picture"] = "no_picture"
    step: Step
    iteration: int | None = None
    reason: str


class Waiting(_Event):
    """A person is asked; the answer is expected in the iteration's decision.json."""

    kind: Literal["waiting"] = "waiting"
    iteration: int


class DecisionUnreadable(_Event):
    """A decision.json is invalid; waiting continues."""

    kind: Literal["decision_unreadable"] = "decision_unreadable"
    iteration: int
    reason: str


class Decided(_Event):
    """The person answered."""

    kind: Literal["decided"] = "decided"
    iteration: int
    verdict: Literal["approve", "refine", "quit"]


class Stopped(_Event):
    """Work ended before its outcome; resuming the run continues it."""

    kind: Literal["stopped"] = "stopped"
    cause: Literal["error", "bug", "interrupted"]
    """"error" is one of `aidsr.core.errors`, as one sentence; a "bug" keeps its traceback."""
    message: str
    traceback: str = ""


class Finished(_Event):
    """The outcome of a design is written; in the log of a run, all outcomes are."""

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
"""Pauses before a log counts as taken [s]: `at_work` holds it for an instant when it looks."""
_SECRET_NAME = re.compile(r"KEY|TOKEN|SECRET|PASSWORD|CREDENTIAL", re.IGNORECASE)
_SHORTEST_SECRET = 8
"""Shorter values are words like "1" or "true"; our choice, so that ordinary text stays readable."""


def without_secrets(text: str) -> str:
    """Return `text` with the value of every secret-looking environment variable replaced by its name."""
    for name, value in os.environ.items():
        if _SECRET_NAME.search(name) and len(value) >= _SHORTEST_SECRET:
            text = text.replace(value, f"[{name}]")
    return text


def _utc_now() -> datetime:
    return datetime.now(UTC)


class EventLog:
    """The one writer of an events.jsonl. A second writer, in this or another process, is refused while it is open.

    Args:
        path: The events.jsonl; made if absent. A line that a killed writer left unfinished is cut off.
        listen: Called with each event after it is written.
        now: The clock.

    Raises:
        UserError: Another process is at work here.
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
        """Append one event with the present time, then call the listener.

        Raises:
            StorageError: It cannot be written, as on a full disk.
        """
        timed = event.model_copy(update={"time": self._now().isoformat(timespec="milliseconds")})
        self._append(timed.model_dump_json(exclude_none=True).encode() + b"\n")
        self._listen(timed)

    def _append(self, line: bytes) -> None:
        """Write a whole line or nothing: a full disk takes the beginning of one."""
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
    """Take the log for this process until it is closed; the system gives it back when the process dies."""
    try:
        import fcntl
    except ImportError:  # Windows has no flock: there, nothing keeps two processes from one run
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
        if error.errno not in (errno.ENOLCK, errno.ENOTSUP):  # file systems without locks: as on Windows
            raise


def at_work(path: Path) -> bool | None:
    """Whether a process of this machine has a log open for writing; None where the system cannot answer."""
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
    """Return the events in order; none if the file is absent. An unfinished last line is left out.

    Raises:
        UserError: A finished line is not an event.
    """
    try:
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
    """Return how long a process worked [s]: without pauses between processes, and without waiting for a person.

    Args:
        events: One log, in order.
        until: Also count from the last event to this time, for work in progress.
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
