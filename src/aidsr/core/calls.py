"""Requests to language models, their replies, and their cost."""

from __future__ import annotations

import base64
from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    PlainSerializer,
    SerializerFunctionWrapHandler,
    model_serializer,
)

from aidsr.core.artifacts import Artifact, Role

Finish = Literal["stop", "length", "refusal", "other", "failed"]
"""How a reply ended; "failed" means that there was no reply."""


def _decoded(value: object) -> object:
    return base64.b64decode(value, validate=True) if isinstance(value, str) else value


def _encoded(value: bytes) -> str:
    return base64.b64encode(value).decode()


Png = Annotated[bytes, BeforeValidator(_decoded), PlainSerializer(_encoded, return_type=str, when_used="json")]
"""A PNG picture; base64 in JSON."""


class ToolSpec(Artifact):
    """A tool that a language model may call."""

    name: str
    description: str
    parameters: dict[str, Any]
    """JSON schema of its arguments; the type is "object"."""


class ToolCall(Artifact):
    """A model's call of a tool."""

    id: str
    """Identifier that links the result to the call."""
    name: str
    arguments: str
    """Arguments as the model wrote them: JSON, possibly malformed."""


class ToolOutput(Artifact):
    """The result of a tool call, as sent to the model."""

    id: str
    name: str
    text: str


class _MayUseTools(Artifact):
    """Base class that omits empty fields about tools when serialized, as in files from before tools existed."""

    @model_serializer(mode="wrap")
    def _without_empty(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = handler(self)
        return {name: value for name, value in values.items() if value or not name.startswith("tool")}


class Message(_MayUseTools):
    """One turn of a conversation with a language model."""

    role: Literal["system", "user", "assistant"]
    text: str
    pictures: tuple[Png, ...] = ()
    """Pictures after the text; only in a user turn, and only for a model that accepts images."""
    tool_calls: tuple[ToolCall, ...] = ()
    """Tool calls after the text; only in an assistant turn."""
    tool_outputs: tuple[ToolOutput, ...] = ()
    """Results of tool calls, before the text; only in the user turn that follows the calls."""


class Question(_MayUseTools):
    """A request: everything that is sent to a language model in one call."""

    role: Role
    """Which of the four roles makes the call."""
    messages: tuple[Message, ...]
    max_output_tokens: int = 20_000
    tools: tuple[ToolSpec, ...] = ()
    """Tools that the model may call; only for a model that supports tools, see `aidsr.core.model.calls_tools`."""


Count = Annotated[int, Field(ge=0, le=10**15)]
"""Number of calls, tokens or steps. It is bounded because a file from elsewhere may hold one larger than any float."""
_Amount = Annotated[float, Field(ge=0, le=1e15)]


class Usage(Artifact):
    """Tokens, cost and time of one call or of several calls."""

    model_config = ConfigDict(allow_inf_nan=False)

    calls: Count = 0
    input_tokens: Count = 0
    cached_input_tokens: Count = 0
    output_tokens: Count = 0
    """Output tokens, including reasoning."""
    tokens_estimated: bool = False
    """Whether some tokens were estimated from the visible text because the provider does not count them."""
    cost_usd: _Amount | None = 0.0
    """Cost; None if a price is unknown. An unknown price is never counted as free."""
    replayed_cost_usd: _Amount | None = 0.0
    """Cost of replayed calls when they were recorded, which is not paid again; None if unknown."""
    latency_s: _Amount = 0.0
    retries: Count = 0

    def __add__(self, other: Usage) -> Usage:
        """Return the sum; if one price is unknown, the sum is unknown."""
        once_known = self.replayed_cost_usd is not None and other.replayed_cost_usd is not None
        once = (self.replayed_cost_usd or 0.0) + (other.replayed_cost_usd or 0.0)
        known = self.cost_usd is not None and other.cost_usd is not None
        return Usage.model_construct(  # not validated: both terms are within their bounds
            calls=self.calls + other.calls,
            input_tokens=self.input_tokens + other.input_tokens,
            cached_input_tokens=self.cached_input_tokens + other.cached_input_tokens,
            output_tokens=self.output_tokens + other.output_tokens,
            tokens_estimated=self.tokens_estimated or other.tokens_estimated,
            cost_usd=(self.cost_usd or 0.0) + (other.cost_usd or 0.0) if known else None,
            replayed_cost_usd=once if once_known else None,
            latency_s=self.latency_s + other.latency_s,
            retries=self.retries + other.retries,
        )


class FailedAttempt(Artifact):
    """One attempt at a call that gave no usable reply and was retried."""

    error: str
    waited_s: float
    """Pause before the next attempt [s]."""
    usage: Usage = Usage()
    """Billed usage of a reply that could not be read: as reported by the server, else estimated; unknown for an attempt
    without a reply."""


class CallRecord(_MayUseTools):
    """Complete record of one call, sufficient to replay the reply without the model."""

    question: Question
    model: str
    reply: str
    tool_calls: tuple[ToolCall, ...] = ()
    finish: Finish
    usage: Usage
    started: str
    """Time of the first attempt, ISO 8601 with zone."""
    failed_attempts: tuple[FailedAttempt, ...] = ()
