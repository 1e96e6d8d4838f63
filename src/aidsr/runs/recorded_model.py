"""A wrapper of a language model that caches its answers in a folder, so that no question is paid for twice."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

from aidsr.core.calls import CallRecord, Question
from aidsr.core.errors import AidsrError
from aidsr.core.model import Model, calls_tools
from aidsr.runs.answered_calls import UNUSABLE, calls_in
from aidsr.runs.files import JsonFile


class RecordedModel:
    """Language model that writes each answer, and each failed call, to `folder`/calls before it returns.

    A question that was answered before gets the recorded answer. If the same question was answered several times, the
    recorded answers are returned in order, each one once.

    Args:
        model: Model to call.
        folder: Folder whose subfolder "calls" holds the answers.
        kept: Called with each new answer after it is written.
    """

    def __init__(self, model: Model, folder: Path, kept: Callable[[CallRecord], None] = lambda _record: None) -> None:
        self._kept = kept
        self.name = model.name
        self._model = model
        self._calls = folder / "calls"
        self._unused = list(calls_in(folder, usable=True))
        self._count = len(calls_in(folder))
        self._lock = threading.Lock()

    @property
    def calls_tools(self) -> bool:
        """Whether the model takes tools."""
        return calls_tools(self._model)

    def ask(self, question: Question) -> CallRecord:
        """Return the recorded answer to exactly this question, or call the model and record its answer.

        Raises:
            AidsrError: The call failed; it is recorded as unusable where it has a record.
        """
        with self._lock:
            for index, record in enumerate(self._unused):
                if record.question == question:
                    return self._unused.pop(index)
        try:
            record = self._model.ask(question)
        except AidsrError as error:
            if error.failed_call:
                self._write(error.failed_call, UNUSABLE)
            raise
        self._write(record, ".json")
        self._kept(record)
        return record

    def _write(self, record: CallRecord, suffix: str) -> None:
        with self._lock:
            self._count += 1
            path = self._calls / f"{self._count:04d}_{record.question.role}{suffix}"
            JsonFile(path, CallRecord).write(record)
