"""The model `manual:DIRECTORY`: a person or another program answers prompts through files.

Each call writes NNNN.prompt.md into the directory and waits for NNNN.reply.md beside it.
"""

from __future__ import annotations

import hashlib
import re
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from aidsr.core.calls import CallRecord, Message, Question, Usage
from aidsr.core.directory_lock import DirectoryLock
from aidsr.core.errors import ModelError, UserError
from aidsr.teams.providers.provider import Endpoint, Provider
from aidsr.teams.providers.tokens import estimate_input_tokens, estimate_tokens

_PROMPT = re.compile(r"(\d{4,})\.prompt\.md")
_FIRST_LINE = re.compile(r"<!-- AID-SR question ([0-9a-f]{64}), asked by the ([a-z]+) -->")
_HOW_TO = """\
# {number}: a question of the {role}

Give everything below the first line of equals signs to a language model, or answer it yourself, and save the whole
reply, as raw text, as `{number}.reply.md` beside this file. Instructions come first, then the conversation so far; the
reply is to its last message. The text says which form the reply must have; fenced blocks must be in the file with their
fences. Save it in one go: a file that no longer grows is read as it is. The limit is {max_output_tokens} tokens.
"""
_TITLES = {"system": "INSTRUCTIONS", "user": "MESSAGE", "assistant": "EARLIER REPLY"}


@dataclass(frozen=True)
class PendingPrompt:
    """A prompt file without a reply.

    Attributes:
        prompt: The prompt's file.
        reply: The file in which its reply is expected.
        role: The role that asks the question.
    """

    prompt: Path
    reply: Path
    role: str

    def answer_to_reply(self) -> str:
        """Return the message that follows the last earlier reply, such as the reason why that reply was unusable.

        Empty for a prompt without an earlier reply.
        """
        _, earlier, rest = self.prompt.read_text(encoding="utf-8").rpartition(f"\n===== {_TITLES['assistant']} =====\n")
        return rest.partition(f"\n===== {_TITLES['user']} =====\n")[2].strip() if earlier else ""


def pending_prompts(directory: Path) -> tuple[PendingPrompt, ...]:
    """Return the prompts in a directory that have no reply, in order; empty if the directory does not exist."""
    return tuple(
        PendingPrompt(files.prompt, files.reply, role)
        for files, _, role in _prompt_files(directory)
        if not (files.reply.exists() or files.recorded.exists())
    )


def prompts_directory(name: str) -> Path | None:
    """Return the prompt directory named in a model's name; None for a model of another provider."""
    prefix, _, directory = name.partition(":")
    return Path(directory) if prefix == MANUAL.prefix and directory else None


class ManualModel:
    """A model that writes each question into a directory and waits, without a time limit, for the file with the reply.

    A prompt that an interrupted run left there is not written again: its reply is read, or waited for. Several runs may
    use a directory one after the other: the first question locks it, and `interrupt` releases it.

    Args:
        directory: Directory of the prompts and replies; created with the first question.
        poll_s: Time between two checks for a reply [s].
        settled_s: Time without a change after which a reply counts as complete [s].
    """

    def __init__(self, directory: Path, *, poll_s: float = 0.3, settled_s: float = 1.0) -> None:
        self.name = f"manual:{directory}"
        self._directory = directory
        self._poll_s = poll_s
        self._settled_s = settled_s
        self._claimed: dict[str, list[_PromptFiles]] = {}
        """Prompt files assigned to the questions of this process, by fingerprint of the question."""
        self._lock: DirectoryLock | None = None
        self._mutex = threading.Lock()
        self._interrupted = threading.Event()

    def ask(self, question: Question) -> CallRecord:
        """Write the question as a prompt file, wait for the reply file beside it, and return the record of the call.

        Raises:
            UserError: The directory cannot be written or is locked by another run, or the reply is not text in UTF-8.
            ModelError: Waiting was interrupted; the prompt stays, and its reply is read when the run is resumed.
        """
        if self._interrupted.is_set():
            raise ModelError("interrupted before the call was made")
        files = self._files_of(question)
        while not _is_settled(files.reply, self._settled_s):
            if self._interrupted.wait(self._poll_s):
                raise ModelError(f"interrupted while {files.prompt} waits for its reply")
        return _record(question, self.name, files)

    def check_available(self) -> None:
        """Check the directory before a run starts.

        Raises:
            UserError: The directory is locked by another run, cannot be written, or is not a directory.
        """
        if self._directory.exists():
            self._lock_directory().release()

    def mark_recorded(self, record: CallRecord) -> None:
        """Mark the reply of a call as recorded by a run; if the same question is repeated, it gets a new prompt."""
        with self._mutex:
            for files in self._claimed.get(_fingerprint(record.question), ()):
                if not files.recorded.exists() and _read(files.reply) == record.reply:
                    files.recorded.touch()
                    return

    def interrupt(self) -> None:
        """Make every waiting call and every later call fail, and release the directory for another run."""
        self._interrupted.set()
        with self._mutex:
            if self._lock:
                self._lock.release()
                self._lock = None

    def _files_of(self, question: Question) -> _PromptFiles:
        """Return the files of a question: those left by an interrupted run, else new ones."""
        key = _fingerprint(question)
        with self._mutex:
            if self._lock is None:
                self._lock = self._lock_directory()
            claimed = self._claimed.setdefault(key, [])
            unanswered = (
                files
                for files, fingerprint, _ in _prompt_files(self._directory)
                if fingerprint == key and files not in claimed and not files.recorded.exists()
            )
            files = next(unanswered, None) or self._write_prompt(question, key)
            claimed.append(files)
            return files

    def _lock_directory(self) -> DirectoryLock:
        try:
            self._directory.mkdir(parents=True, exist_ok=True)
            return DirectoryLock(self._directory)
        except OSError as error:
            raise self._not_writable(error) from None

    def _write_prompt(self, question: Question, key: str) -> _PromptFiles:
        number = max((files.number for files, _, _ in _prompt_files(self._directory)), default=0) + 1
        files = _PromptFiles(self._directory, number)
        try:
            files.write(_text(question, key, files), [png for each in question.messages for png in each.pictures])
        except OSError as error:
            raise self._not_writable(error) from None
        return files

    def _not_writable(self, error: OSError) -> UserError:
        return UserError(f"cannot write prompts into {self._directory} ({error.strerror}); name another directory")


@dataclass(frozen=True)
class _PromptFiles:
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
    def recorded(self) -> Path:
        """Empty file that is written when a run has recorded the reply."""
        return self.directory / f".{self.number:04d}.taken"

    def picture(self, number: int) -> Path:
        return self.directory / f"{self.number:04d}.picture_{number}.png"

    def write(self, text: str, pictures: Sequence[bytes]) -> None:
        """Write the pictures, then the prompt atomically, so that no reader sees a partial prompt."""
        for number, png in enumerate(pictures, start=1):
            self.picture(number).write_bytes(png)
        draft = self.directory / f".{self.number:04d}.tmp"
        draft.write_text(text, encoding="utf-8")
        draft.replace(self.prompt)


def _prompt_files(directory: Path) -> list[tuple[_PromptFiles, str, str]]:
    """Return the prompts of a directory in order, each with its question's fingerprint and role."""
    found: list[tuple[_PromptFiles, str, str]] = []
    for path in directory.glob("*.prompt.md"):
        if number := _PROMPT.fullmatch(path.name):
            with path.open(encoding="utf-8") as file:
                first = _FIRST_LINE.match(file.readline())
            fingerprint, role = (first[1], first[2]) if first else ("", "")
            found.append((_PromptFiles(directory, int(number[1])), fingerprint, role))
    return sorted(found, key=lambda each: each[0].number)


def _text(question: Question, key: str, files: _PromptFiles) -> str:
    how_to = _HOW_TO.format(
        number=f"{files.number:04d}", role=question.role, max_output_tokens=question.max_output_tokens
    )
    first = f"<!-- AID-SR question {key}, asked by the {question.role} -->\n"
    pictures = sum(len(message.pictures) for message in question.messages)
    if pictures:
        names = ", ".join(f"`{files.picture(number).name}`" for number in range(1, pictures + 1))
        how_to += f"The pictures that it refers to are beside this file, in order: {names}.\n"
    return first + how_to + "".join(_turn(message) for message in question.messages)


def _turn(message: Message) -> str:
    return f"\n===== {_TITLES[message.role]} =====\n\n{message.text.strip()}\n"


def _fingerprint(question: Question) -> str:
    return hashlib.sha256(question.model_dump_json().encode()).hexdigest()


def _is_settled(reply: Path, settled_s: float) -> bool:
    """Whether the reply file has text and was not modified during the last `settled_s` seconds."""
    try:
        stat = reply.stat()
    except FileNotFoundError:
        return False
    return time.time() - stat.st_mtime >= settled_s and bool(_read(reply).strip())


def _read(reply: Path) -> str:
    try:
        return reply.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        return ""
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{reply} is not text in UTF-8 ({error}); save it again, then resume the run") from None


def _record(question: Question, name: str, files: _PromptFiles) -> CallRecord:
    """Return the record of the answered call; its latency is the time between the prompt file and the reply file."""
    reply = _read(files.reply)
    asked_s, answered_s = files.prompt.stat().st_mtime, files.reply.stat().st_mtime
    return CallRecord(
        question=question,
        model=name,
        reply=reply,
        finish="stop",
        usage=Usage(
            calls=1,
            input_tokens=estimate_input_tokens(question),
            output_tokens=estimate_tokens(reply),
            tokens_estimated=True,
            cost_usd=None,
            latency_s=max(0.0, answered_s - asked_s),
        ),
        started=datetime.fromtimestamp(asked_s, UTC).isoformat(timespec="milliseconds"),
    )


def _connect(endpoint: Endpoint) -> ManualModel:
    return ManualModel(Path(endpoint.argument))


MANUAL = Provider(
    prefix="manual",
    title="By hand",
    doc="You carry each prompt to any chat product, or think for yourself, and bring back the reply.",
    argument="DIRECTORY",
    example="prompts",
    connect=_connect,
    takes_path=True,
)
