"""A recorded run as the model: it answers its own prompts again, offline and free."""

from __future__ import annotations

import difflib
import hashlib
import threading
from collections import deque
from pathlib import Path

from aidsr.core.calls import CallRecord, Message, Question
from aidsr.core.errors import ModelError, UserError
from aidsr.runs.folders import Run

REPLAY = "replay:"
"""What the name of such a model begins with; the folder of the run follows."""

_MOST_LINES = 60
"""Lines of a difference that are shown. Our choice: a screenful; a changed prompt is mostly changed at few places."""


class ReplayedModel:
    """Answers exactly the questions that a run recorded, in any order, and nothing near them.

    A question that was answered several times is answered as often, in the order of the folders. The cap on output
    tokens is no part of a prompt and may differ.

    Raises:
        UserError: The folder is not a run, or nobody was asked in it.
    """

    def __init__(self, folder: Path) -> None:
        self.name = f"{REPLAY}{folder}"
        run = Run(folder)
        run.asked()
        iterations = (iteration for design in run.designs for iteration in design.iterations)
        self._records = (*run.calls, *(call for iteration in iterations for call in iteration.calls))
        if not self._records:
            raise UserError(f"a run with calls to a language model was expected; {folder} has none to answer from")
        self._answers: dict[tuple[str, tuple[Message, ...]], deque[CallRecord]] = {}
        for record in self._records:
            self._answers.setdefault(_prompt(record.question), deque()).append(record)
        self._lock = threading.Lock()

    def ask(self, question: Question) -> CallRecord:
        """Return the recorded answer; nothing is paid, and what was paid then is told apart.

        Raises:
            ModelError: The run was not asked this, with the difference to the nearest prompt, or not this often.
        """
        with self._lock:
            answers = self._answers.get(_prompt(question))
            record = answers.popleft() if answers else None
        if record is None:
            raise ModelError(self._missing(question, known=answers is not None))
        usage = record.usage.model_copy(update={"cost_usd": 0.0, "replayed_cost_usd": record.usage.cost_usd})
        return record.model_copy(update={"question": question, "model": self.name, "usage": usage})

    def _missing(self, question: Question, *, known: bool) -> str:
        if known:
            return f"{self.name} answered this question as often as it was recorded; it is asked once more now"
        texts = [_text(each.question) for each in self._records if each.question.role == question.role]
        if not texts:
            return f"{self.name} has no call of the {question.role}; it cannot answer one"
        asked = _text(question)
        nearest = max(texts, key=lambda text: _likeness(text, asked))
        lines = list(
            difflib.unified_diff(nearest.splitlines(), asked.splitlines(), "recorded", "asked now", n=2, lineterm="")
        )
        more = [f"… and {len(lines) - _MOST_LINES} lines more"] if len(lines) > _MOST_LINES else []
        shown = "\n".join([*lines[:_MOST_LINES], *more])
        return f"the prompt of the {question.role} differs from every one that {self.name} recorded:\n{shown}"


def _prompt(question: Question) -> tuple[str, tuple[Message, ...]]:
    return question.role, question.messages


def _text(question: Question) -> str:
    return "\n".join(f"[{message.role}]\n{message.text}{_pictures(message)}" for message in question.messages)


def _pictures(message: Message) -> str:
    return "".join(f"\n[picture {hashlib.sha256(png).hexdigest()[:12]}]" for png in message.pictures)


def _likeness(one: str, other: str) -> float:
    """Return the share of lines in common, for finding the nearest text quickly."""
    return difflib.SequenceMatcher(None, one.splitlines(), other.splitlines(), autojunk=False).ratio()
