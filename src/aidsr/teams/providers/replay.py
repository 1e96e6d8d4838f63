"""The model `replay:RUN`: a recorded run that gives its recorded replies to the same prompts again, for free."""

from __future__ import annotations

import difflib
import hashlib
import threading
from collections import deque
from pathlib import Path

from aidsr.core.calls import CallRecord, Message, Question
from aidsr.core.errors import ModelError, UserError
from aidsr.runs.answered_calls import calls_in
from aidsr.runs.folders import Run
from aidsr.teams.providers.provider import Endpoint, Provider

_MAX_DIFF_LINES = 60
"""Maximum number of lines of a diff in an error message. Our choice: one screen; a changed prompt mostly differs in few
places."""


class ReplayedModel:
    """A model that gives the recorded replies of a run to exactly the same questions, in any order.

    A question that was answered several times is answered equally often, in the order of the run's folders. Replies
    that the run had set aside as unusable are left out. The limit on output tokens is not part of a prompt and may
    differ.

    Raises:
        UserError: The folder is not a run, or no model was asked in it.
    """

    def __init__(self, folder: Path) -> None:
        self.name = f"replay:{folder}"
        self.run = run = Run(folder)
        run.asked()
        self._records = _usable_calls(run)
        if not self._records:
            raise UserError(f"{folder} has no calls to replay; name a run that asked a language model")
        self._replies: dict[tuple[str, tuple[Message, ...]], deque[CallRecord]] = {}
        for record in self._records:
            self._replies.setdefault(_prompt(record.question), deque()).append(record)
        self._lock = threading.Lock()

    @property
    def calls_tools(self) -> bool:
        """Whether the recorded model was given tools."""
        return any(record.question.tools for record in self._records)

    def leave_out_replies_in(self, run: Run) -> None:
        """Leave out the replies that a replaying run already has in its folders, so that it gets each one once."""
        with self._lock:
            for call in _usable_calls(run):
                left = self._replies.get(_prompt(call.question), deque[CallRecord]())
                given = next((one for one in left if (one.started, one.reply) == (call.started, call.reply)), None)
                if given is not None:
                    left.remove(given)

    def ask(self, question: Question) -> CallRecord:
        """Return the recorded reply. It costs nothing; `replayed_cost_usd` is the cost at the time of recording.

        Raises:
            ModelError: The run has no reply to this question, or no further one. For an unknown question, the message
                has a diff to the most similar prompt.
        """
        with self._lock:
            replies = self._replies.get(_prompt(question))
            record = replies.popleft() if replies else None
        if record is None:
            raise ModelError(self._explain_missing(question, known=replies is not None))
        usage = record.usage.model_copy(update={"cost_usd": 0.0, "replayed_cost_usd": record.usage.cost_usd})
        return record.model_copy(update={"question": question, "model": self.name, "usage": usage})

    def _explain_missing(self, question: Question, *, known: bool) -> str:
        if known:
            return f"{self.name} has no more replies to this question: it is asked once more than in the recorded run"
        texts = [_text(each.question) for each in self._records if each.question.role == question.role]
        if not texts:
            return f"{self.name} has no call of the {question.role}"
        text = _text(question)
        nearest = max(texts, key=lambda recorded: _similarity(recorded, text))
        diff = list(difflib.unified_diff(nearest.splitlines(), text.splitlines(), "recorded", "now", n=2, lineterm=""))
        more = [f"… and {len(diff) - _MAX_DIFF_LINES} more lines"] if len(diff) > _MAX_DIFF_LINES else []
        shown = "\n".join([*diff[:_MAX_DIFF_LINES], *more])
        return f"the prompt of the {question.role} differs from every one that {self.name} recorded:\n{shown}"


def _usable_calls(run: Run) -> tuple[CallRecord, ...]:
    """Return the answered calls of a run in the order of its folders, without those that were set aside."""
    folders = (run.path, *(iteration.path for design in run.designs for iteration in design.iterations))
    calls = (call for folder in folders for call in calls_in(folder, usable=True))
    return tuple(call for call in calls if call.finish != "failed")


def _prompt(question: Question) -> tuple[str, tuple[Message, ...]]:
    return question.role, question.messages


def _text(question: Question) -> str:
    return "\n".join(f"[{message.role}]\n{message.text}{_picture_hashes(message)}" for message in question.messages)


def _picture_hashes(message: Message) -> str:
    return "".join(f"\n[picture {hashlib.sha256(png).hexdigest()[:12]}]" for png in message.pictures)


def _similarity(one: str, other: str) -> float:
    """Return the similarity of two texts by their lines, 0 to 1."""
    return difflib.SequenceMatcher(None, one.splitlines(), other.splitlines(), autojunk=False).ratio()


def _connect(endpoint: Endpoint) -> ReplayedModel:
    return ReplayedModel(Path(endpoint.argument))


REPLAY = Provider(
    prefix="replay",
    title="A recorded run",
    doc="Reuses the recorded replies of a run, for free.",
    argument="RUN",
    example="runs/20260131-100000",
    connect=_connect,
    is_free=True,
    takes_path=True,
)
