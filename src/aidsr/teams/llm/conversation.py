"""One role asking one model until the reply can be used, a bounded number of times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from aidsr.core.artifacts import Role
from aidsr.core.calls import CallRecord, Message, Question
from aidsr.core.errors import ReplyError
from aidsr.core.model import Model
from aidsr.teams.llm.prompts import render

__all__ = ["Interview"]

T = TypeVar("T")

_AT_LIMIT = 0.9
"""Share of its limit from which a reply was cut off by it. Our choice: servers may count a few tokens otherwise."""


@dataclass(frozen=True)
class Interview:
    """Asks, reads the reply, and asks again in the same conversation with what was wrong with it.

    Attributes:
        model: Who is asked.
        reasks: How often a reply that cannot be used is asked for again.
    """

    model: Model
    reasks: int = 2

    def ask(self, role: Role, system: str, user: str, read: Callable[[str], T], pictures: tuple[bytes, ...] = ()) -> T:
        """Return what `read` makes of the reply.

        Args:
            role: Which role is asking.
            system: What the role is always told; the same for all its calls, so that providers can cache it.
            user: The job.
            read: Turns a reply into its artifact; raises ReplyError with a sentence for the model.
            pictures: PNGs that belong to the job.

        Raises:
            ReplyError: No reply could be used.
            UserError, ModelError: The model gave no reply.
        """
        asked = Message(role="user", text=user, pictures=pictures)
        messages: tuple[Message, ...] = (Message(role="system", text=system), asked)
        for _ in range(1 + self.reasks):
            record = self.model.ask(Question(role=role, messages=messages))
            try:
                return read(_whole(record))
            except ReplyError as error:
                complaint = str(error)
            messages = _asked_again(record, complaint)
        raise ReplyError(f"No usable reply in {1 + self.reasks} attempts. The last one: {complaint}")


def _whole(record: CallRecord) -> str:
    """Return the reply if it is one.

    Raises:
        ReplyError: It was refused, cut off or empty.
    """
    if record.finish == "refusal":
        raise ReplyError("The reply was a refusal. The job is an ordinary engineering task in a simulator.")
    if record.finish == "length":
        raise ReplyError(f"The reply was cut off {_where(record)}. Reply more briefly, without repetition.")
    if not record.reply.strip():
        raise ReplyError("The reply was empty.")
    return record.reply


def _where(record: CallRecord) -> str:
    """Say where a reply was cut off: at its limit, or before it, by what its server has room for."""
    limit, usage = record.question.max_output_tokens, record.usage
    if usage.tokens_estimated or not 0 < usage.output_tokens < _AT_LIMIT * limit:
        return f"at its limit of {limit} tokens"
    return (
        f"after {usage.output_tokens} tokens, before its limit of {limit}: with a question of {usage.input_tokens} "
        "tokens the model's context was full, or its server has a limit of its own"
    )


def _asked_again(record: CallRecord, complaint: str) -> tuple[Message, ...]:
    """Return the conversation with the complaint added.

    A reply that was cut off, refused or empty is left out: it would be read again at full price, and an empty turn is
    refused by some providers. The complaint then follows the last question, which keeps the turns alternating.
    """
    text = render("reask", complaint=complaint)
    asked = record.question.messages
    if record.finish in {"stop", "other"} and record.reply.strip():
        return (*asked, Message(role="assistant", text=record.reply), Message(role="user", text=text))
    return (*asked[:-1], asked[-1].model_copy(update={"text": f"{asked[-1].text}\n\n{text}"}))
