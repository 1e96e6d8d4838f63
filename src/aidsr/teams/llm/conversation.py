"""Conversation with a model, which is asked until its reply is usable, a limited number of times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from aidsr.core.artifacts import Role
from aidsr.core.calls import CallRecord, Message, Question
from aidsr.core.errors import ReplyError
from aidsr.core.model import Model
from aidsr.teams.llm.prompts import render
from aidsr.teams.llm.replies import MAX_CHARACTERS

T = TypeVar("T")

_AT_LIMIT = 0.9
"""Share of the token limit from which an incomplete reply counts as cut off by that limit. Our choice: servers count
tokens slightly differently."""


@dataclass(frozen=True)
class Conversation:
    """A conversation in which an unusable reply is answered with a complaint, and the model is asked again.

    Attributes:
        model: The model.
        reasks: How often the model is asked again after an unusable reply.
    """

    model: Model
    reasks: int = 2

    def ask(self, role: Role, system: str, user: str, read: Callable[[str], T], pictures: tuple[bytes, ...] = ()) -> T:
        """Ask the model and return its parsed reply.

        Args:
            role: The role that asks.
            system: System prompt; the same for all calls of a role, so that providers can cache it.
            user: Prompt of the job.
            read: Function that parses a reply, or raises ReplyError with a sentence for the model.
            pictures: PNGs that belong to the prompt.

        Raises:
            ReplyError: No reply could be used.
            UserError, ModelError: The model gave no reply.
        """
        prompt = Message(role="user", text=user, pictures=pictures)
        messages: tuple[Message, ...] = (Message(role="system", text=system), prompt)
        for _ in range(1 + self.reasks):
            record = self.model.ask(Question(role=role, messages=messages))
            complaint = complaint_about(record)
            if not complaint:
                try:
                    return read(record.reply)
                except ReplyError as error:
                    complaint = str(error)
            messages = with_complaint(record, complaint)
        raise ReplyError(f"No usable reply in {1 + self.reasks} attempts. The last one: {complaint}")


def complaint_about(record: CallRecord, *, needs_text: bool = True) -> str:
    """Return why a reply is unusable: refused, cut off, too long or empty; "" if it is none of these."""
    if record.finish == "refusal":
        return "The reply was a refusal. The job is an ordinary engineering task in a simulator."
    if record.finish == "length":
        return f"The reply was cut off {_describe_cutoff(record)}. Reply more briefly, without repetition."
    if len(record.reply) > MAX_CHARACTERS:
        return (
            f"The reply has {len(record.reply):,} characters; at most {MAX_CHARACTERS:,} are read. Reply more briefly."
        )
    return "The reply was empty." if needs_text and not record.reply.strip() else ""


def _describe_cutoff(record: CallRecord) -> str:
    """Describe where a reply was cut off: at its token limit, or before it by the model's context or the server."""
    limit, usage = record.question.max_output_tokens, record.usage
    if usage.tokens_estimated or not 0 < usage.output_tokens < _AT_LIMIT * limit:
        return f"at its limit of {limit} tokens"
    return (
        f"after {usage.output_tokens} tokens, before its limit of {limit}: with a question of {usage.input_tokens} "
        "tokens the model's context was full, or its server has a limit of its own"
    )


def with_complaint(record: CallRecord, complaint: str) -> tuple[Message, ...]:
    """Return the conversation with the complaint added.

    A reply that was cut off, refused, too long or empty is left out: it would be paid for again, and some providers
    refuse an empty turn. The complaint then follows the last prompt, which keeps the turns alternating.
    """
    text = render("reask", complaint=complaint)
    messages = record.question.messages
    if record.finish in {"stop", "other"} and record.reply.strip() and len(record.reply) <= MAX_CHARACTERS:
        return (*messages, Message(role="assistant", text=record.reply), Message(role="user", text=text))
    return (*messages[:-1], messages[-1].model_copy(update={"text": f"{messages[-1].text}\n\n{text}"}))
