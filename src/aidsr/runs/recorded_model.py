"""A language model whose answers are kept in a folder, so that no answered question is ever paid for twice."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from aidsr.core.calls import CallRecord, Question
from aidsr.runs.answered_calls import calls_in
from aidsr.runs.files import JsonFile

if TYPE_CHECKING:
    from aidsr.core.model import Model


class RecordedModel:
    """Asks `model`, and writes each answer to `folder`/calls before anyone sees it.

    A question that was answered there before gets that answer again. When the very same question was answered several
    times, the answers come in their order.

    Args:
        model: The model that is called.
        folder: Where answers are kept, in its folder "calls".
        kept: Called with each new answer once it is on disk.
    """

    def __init__(self, model: Model, folder: Path, kept: Callable[[CallRecord], None] = lambda _record: None) -> None:
        self._kept = kept
        self.name = model.name
        self._model = model
        self._calls = folder / "calls"
        self._unused = list(calls_in(folder, usable=True))
        self._count = len(calls_in(folder))
        self._lock = threading.Lock()

    def ask(self, question: Question) -> CallRecord:
        """Return the recorded answer to exactly this question, or ask and record."""
        with self._lock:
            for index, record in enumerate(self._unused):
                if record.question == question:
                    return self._unused.pop(index)
        record = self._model.ask(question)
        with self._lock:
            self._count += 1
            JsonFile(self._calls / f"{self._count:04d}_{question.role}.json", CallRecord).write(record)
        self._kept(record)
        return record
