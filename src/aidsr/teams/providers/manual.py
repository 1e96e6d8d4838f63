"""A model that is a person: prompts go out as files, replies come in as files.

Any chat product, another program, or a person alone can play the team this way. A directory holds NNNN.prompt.md for
each call, and its reply is expected beside it as NNNN.reply.md.
"""

from __future__ import annotations

import hashlib
import math
import re
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from aidsr.core.calls import CallRecord, Message, Question, Usage
from aidsr.core.directory_lock import Claim
from aidsr.core.errors import ModelError, UserError

__all__ = ["MANUAL", "ManualModel", "WaitingPrompt", "estimated_input_tokens", "estimated_tokens", "waiting_prompts"]

MANUAL = "manual:"
"""What the name of such a model begins with; the directory follows."""

_BYTES_PER_TOKEN = 3
"""Our choice: English and MJCF take 3 to 4 bytes a token with current tokenizers, so this rather counts too many."""
_TOKENS_A_PICTURE = 1600
"""Our choice, rather too many: providers count 250 to 1,600 for pictures of the sizes that we draw."""
_PROMPT = re.compile(r"(\d{4,})\.prompt\.md")
_FIRST_LINE = re.compile(r"<!-- AID-SR question ([0-9a-f]{64}), asked by the ([a-z]+) -->")
_HOW_TO = """\
# {number}: a question of the {role}

Give everything below the first line of equals signs to a language model, or answer it yourself, and save the whole
reply, as raw text, as `{number}.reply.md` beside this file. Instructions come first, then the conversation so far; the
reply is to its last message. The text says which form the reply must have; fenced blocks must be in the file with their
fences. Save it in one go: a file that no longer grows is taken as it is. At most {max_output_tokens} tokens are meant.
"""
_TITLES = {"system": "INSTRUCTIONS", "user": "MESSAGE", "assistant": "EARLIER REPLY"}


@dataclass(frozen=True)
class WaitingPrompt:
    """A question on disk that has no reply yet."""

    prompt: Path
    reply: Path
    """Where the reply is expected."""
    role: str


def waiting_prompts(directory: Path) -> tuple[WaitingPrompt, ...]:
    """Return the questions in a directory that wait for a reply, in order; none where there is no directory."""
    return tuple(
        WaitingPrompt(sheet.prompt, sheet.reply, role)
        for sheet, _, role in _sheets(directory)
        if not (sheet.reply.exists() or sheet.taken.exists())
    )


def estimated_tokens(text: str) -> int:
    """Return about how many tokens a text has; only its visible bytes are known."""
    return math.ceil(len(text.encode()) / _BYTES_PER_TOKEN)


def estimated_input_tokens(question: Question) -> int:
    """Return about how many tokens a question has, its pictures included."""
    pictures = sum(len(message.pictures) for message in question.messages)
    return estimated_tokens("\n".join(message.text for message in question.messages)) + _TOKENS_A_PICTURE * pictures


class ManualModel:
    """Writes each question into a directory and waits, as long as it takes, for its reply to appear there.

    A question found there from an earlier life of the run is not asked twice: its reply is taken, or waited for. Runs
    may use a directory one after the other: it is taken with the first question, and given back by `interrupt`.

    Args:
        directory: Made when the first question is asked.
        poll_s: How often to look for replies [s].
        settled_s: How long a reply must not have changed before it counts as complete [s].
    """

    def __init__(self, directory: Path, *, poll_s: float = 0.3, settled_s: float = 1.0) -> None:
        self.name = f"{MANUAL}{directory}"
        self._directory = directory
        self._poll_s = poll_s
        self._settled_s = settled_s
        self._claimed: dict[str, list[_Sheet]] = {}
        """Sheets that calls of this process ask or asked, by question."""
        self._claim: Claim | None = None
        self._lock = threading.Lock()
        self._interrupted = threading.Event()

    def ask(self, question: Question) -> CallRecord:
        """Return what a person, or whatever answers for them, put into the file of the reply.

        Raises:
            UserError: The directory cannot be written or another run uses it, or the reply is not text in UTF-8.
            ModelError: Waiting was interrupted; the question stays, and its reply is taken when it is asked again.
        """
        if self._interrupted.is_set():
            raise ModelError("interrupted before it could be asked")
        sheet = self._sheet(question)
        while not _is_settled(sheet.reply, self._settled_s):
            if self._interrupted.wait(self._poll_s):
                raise ModelError(f"interrupted while {sheet.prompt} waits for its reply")
        return _record(question, self.name, sheet)

    def check_free(self) -> None:
        """Refuse a directory that another run uses or that cannot be written, before anything is asked.

        Raises:
            UserError: Another run uses it, it cannot be written, or it is none.
        """
        if self._directory.exists():
            self._take().release()

    def kept(self, record: CallRecord) -> None:
        """Take notice that a reply is recorded elsewhere: asked once more, the same question is a new one."""
        with self._lock:
            for sheet in self._claimed.get(_fingerprint(record.question), ()):
                if not sheet.taken.exists() and _read(sheet.reply) == record.reply:
                    sheet.taken.touch()
                    return

    def interrupt(self) -> None:
        """Let every call that waits give up, now and from now on, and the directory be free for another run."""
        self._interrupted.set()
        with self._lock:
            if self._claim:
                self._claim.release()
                self._claim = None

    def _sheet(self, question: Question) -> _Sheet:
        """Return the place of the question: one left by an earlier life of the run, else a new one."""
        key = _fingerprint(question)
        with self._lock:
            if self._claim is None:
                self._claim = self._take()
            claimed = self._claimed.setdefault(key, [])
            left = (
                sheet
                for sheet, asked, _ in _sheets(self._directory)
                if asked == key and sheet not in claimed and not sheet.taken.exists()
            )
            sheet = next(left, None) or self._new_sheet(question, key)
            claimed.append(sheet)
            return sheet

    def _take(self) -> Claim:
        try:
            self._directory.mkdir(parents=True, exist_ok=True)
            return Claim(self._directory)
        except OSError as error:
            raise self._not_writable(error) from None

    def _new_sheet(self, question: Question, key: str) -> _Sheet:
        number = max((sheet.number for sheet, _, _ in _sheets(self._directory)), default=0) + 1
        sheet = _Sheet(self._directory, number)
        try:
            sheet.write(_text(question, key, sheet), [png for each in question.messages for png in each.pictures])
        except OSError as error:
            raise self._not_writable(error) from None
        return sheet

    def _not_writable(self, error: OSError) -> UserError:
        return UserError(f"no prompt can be written into {self._directory} ({error.strerror}); name another directory")


@dataclass(frozen=True)
class _Sheet:
    """The files of one question."""

    directory: Path
    number: int

    @property
    def prompt(self) -> Path:
        return self.directory / f"{self.number:04d}.prompt.md"

    @property
    def reply(self) -> Path:
        return self.directory / f"{self.number:04d}.reply.md"

    @property
    def taken(self) -> Path:
        """There once the reply is recorded in a run."""
        return self.directory / f".{self.number:04d}.taken"

    def picture(self, number: int) -> Path:
        return self.directory / f"{self.number:04d}.picture_{number}.png"

    def write(self, text: str, pictures: Sequence[bytes]) -> None:
        """Put the whole prompt there at once, so that nobody reads half of it; its pictures are there before."""
        for number, png in enumerate(pictures, start=1):
            self.picture(number).write_bytes(png)
        draft = self.directory / f".{self.number:04d}.tmp"
        draft.write_text(text, encoding="utf-8")
        draft.replace(self.prompt)


def _sheets(directory: Path) -> list[tuple[_Sheet, str, str]]:
    """Return the prompts of a directory in order, each with its question's fingerprint and role."""
    found: list[tuple[_Sheet, str, str]] = []
    for path in directory.glob("*.prompt.md"):
        if number := _PROMPT.fullmatch(path.name):
            with path.open(encoding="utf-8") as file:
                first = _FIRST_LINE.match(file.readline())
            found.append((_Sheet(directory, int(number[1])), first[1] if first else "", first[2] if first else ""))
    return sorted(found, key=lambda each: each[0].number)


def _text(question: Question, key: str, sheet: _Sheet) -> str:
    how_to = _HOW_TO.format(
        number=f"{sheet.number:04d}", role=question.role, max_output_tokens=question.max_output_tokens
    )
    first = f"<!-- AID-SR question {key}, asked by the {question.role} -->\n"
    shown = sum(len(message.pictures) for message in question.messages)
    if shown:
        names = ", ".join(f"`{sheet.picture(number).name}`" for number in range(1, shown + 1))
        how_to += f"The pictures that it speaks of lie beside this file, in their order: {names}.\n"
    return first + how_to + "".join(_turn(message) for message in question.messages)


def _turn(message: Message) -> str:
    return f"\n===== {_TITLES[message.role]} =====\n\n{message.text.strip()}\n"


def _fingerprint(question: Question) -> str:
    return hashlib.sha256(question.model_dump_json().encode()).hexdigest()


def _is_settled(reply: Path, settled_s: float) -> bool:
    """Whether there is a reply that has not changed for a while; one that was moved into place may count at once."""
    try:
        found = reply.stat()
    except FileNotFoundError:
        return False
    return time.time() - found.st_mtime >= settled_s and bool(_read(reply).strip())


def _read(reply: Path) -> str:
    try:
        return reply.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        return ""
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(
            f"{reply} was expected to be text in UTF-8 and cannot be read ({error}); save it again, then resume the run"
        ) from None


def _record(question: Question, name: str, sheet: _Sheet) -> CallRecord:
    """Return the answered call; its time runs from the prompt's file to the reply's, whoever was at work meanwhile."""
    reply = _read(sheet.reply)
    asked_s, answered_s = sheet.prompt.stat().st_mtime, sheet.reply.stat().st_mtime
    return CallRecord(
        question=question,
        model=name,
        reply=reply,
        finish="stop",
        usage=Usage(
            calls=1,
            input_tokens=estimated_input_tokens(question),
            output_tokens=estimated_tokens(reply),
            tokens_estimated=True,
            cost_usd=None,
            latency_s=max(0.0, answered_s - asked_s),
        ),
        started=datetime.fromtimestamp(asked_s, UTC).isoformat(timespec="milliseconds"),
    )
