"""What is asked of a language model, what it answered, and what that cost."""

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
"""How a reply ended; a call that "failed" brought none."""


def _decoded(value: object) -> object:
    return base64.b64decode(value, validate=True) if isinstance(value, str) else value


def _encoded(value: bytes) -> str:
    return base64.b64encode(value).decode()


Png = Annotated[bytes, BeforeValidator(_decoded), PlainSerializer(_encoded, return_type=str, when_used="json")]
"""A picture; base64 where it is written as JSON."""


class ToolSpec(Artifact):
    """A tool that a model may call."""

    name: str
    description: str
    parameters: dict[str, Any]
    """JSON schema of its arguments, an object."""


class ToolCall(Artifact):
    """A model's call of a tool."""

    id: str
    """By which the result is matched."""
    name: str
    arguments: str
    """As the model wrote them: JSON, or what was meant to be."""


class ToolOutput(Artifact):
    """The result of a call, for the model."""

    id: str
    name: str
    text: str


class _MayUseTools(Artifact):
    """Is written without its fields about tools where they are empty, as in files from before there were any."""

    @model_serializer(mode="wrap")
    def _without_empty(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = handler(self)
        return {name: value for name, value in values.items() if value or not name.startswith("tool")}


class Message(_MayUseTools):
    """One turn of a conversation with a language model."""

    role: Literal["system", "user", "assistant"]
    text: str
    pictures: tuple[Png, ...] = ()
    """Shown after the text; of a user's turn only, and only to a model that takes images."""
    tool_calls: tuple[ToolCall, ...] = ()
    """Made after the text; of an assistant's turn only."""
    tool_outputs: tuple[ToolOutput, ...] = ()
    """Before the text; of a user's turn only, which follows the calls."""


class Question(_MayUseTools):
    """Everything that is sent to a language model in one call."""

    role: Role
    """Which of the four roles makes the call."""
    messages: tuple[Message, ...]
    max_output_tokens: int = 20_000
    tools: tuple[ToolSpec, ...] = ()
    """That the model may call; only for one that can, see `aidsr.core.model.calls_tools`."""


Count = Annotated[int, Field(ge=0, le=10**15)]
"""Of calls, tokens or steps; in a file of others a number can be larger than any float."""
_Amount = Annotated[float, Field(ge=0, le=1e15)]


class Usage(Artifact):
    """Tokens, money and time of one call or of many."""

    model_config = ConfigDict(allow_inf_nan=False)

    calls: Count = 0
    input_tokens: Count = 0
    cached_input_tokens: Count = 0
    output_tokens: Count = 0
    """Reasoning included."""
    tokens_estimated: bool = False
    """Whether tokens were, at least in part, estimated from visible text, because the provider does not count them."""
    cost_usd: _Amount | None = 0.0
    """None when a price is unknown; unknown is never counted as free."""
    replayed_cost_usd: _Amount | None = 0.0
    """What replayed calls cost when they were recorded; not paid again. None when that is unknown."""
    latency_s: _Amount = 0.0
    retries: Count = 0

    def __add__(self, other: Usage) -> Usage:
        """Return the sum; one unknown price makes the sum unknown."""
        once_known = self.replayed_cost_usd is not None and other.replayed_cost_usd is not None
        once = (self.replayed_cost_usd or 0.0) + (other.replayed_cost_usd or 0.0)
        known = self.cost_usd is not None and other.cost_usd is not None
        return Usage.model_construct(  # the sum of two that are within their bounds is not checked
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
    """One attempt at a call that brought no reply and was tried again."""

    error: str
    waited_s: float
    """Pause before the next attempt [s]."""
    usage: Usage = Usage()
    """What a reply that could not be read was billed for: as its server reports it, else estimated; not known for an
    attempt without a reply."""


class CallRecord(_MayUseTools):
    """One call, complete: enough to replay its answer without the model."""

    question: Question
    model: str
    reply: str
    tool_calls: tuple[ToolCall, ...] = ()
    finish: Finish
    usage: Usage
    started: str
    """Time of the first attempt, ISO 8601 with zone."""
    failed_attempts: tuple[FailedAttempt, ...] = ()
