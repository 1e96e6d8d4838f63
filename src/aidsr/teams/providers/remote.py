"""A model behind an HTTP service."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from aidsr.core.calls import CallRecord, FailedAttempt, Finish, Message, Question, Usage
from aidsr.core.errors import ModelError, UserError
from aidsr.teams.providers import event_loop as background
from aidsr.teams.providers.credentials import Access
from aidsr.teams.providers.failures import explain, writable
from aidsr.teams.providers.manual import estimated_input_tokens, estimated_tokens
from aidsr.teams.providers.retry import Clock, Patience, TransientError, persist

if TYPE_CHECKING:
    from pydantic_ai.messages import ModelMessage, ModelResponse
    from pydantic_ai.models import Model as Client
    from pydantic_ai.settings import ModelSettings

__all__ = ["RemoteModel", "cost_usd"]

_WITHOUT_PICTURES = "start the run without --judge-pictures, or name a model that takes images"

_REASONING_ENDS = "</think>"
"""Alone, without its opening, where that stands in the server's chat template; pydantic-ai takes out whole pairs."""

_FINISHES: dict[str | None, Finish] = {"stop": "stop", "length": "length", "content_filter": "refusal"}


@dataclass(frozen=True)
class RemoteModel:
    """Asks a provider through pydantic-ai; made by `connect`.

    Attributes:
        name: Name the person gave.
        client: pydantic-ai's model, which knows the wire format.
        priced: Whether the provider's list prices apply.
        key_variable: Environment variable that holds the key, for error sentences.
        access: Where the keys are, to wipe them out of error texts.
        patience: Retries and time limits.
        clock: Time as the retries see it.
    """

    name: str
    client: Client = field(repr=False)
    priced: bool
    key_variable: str
    access: Access = field(repr=False)
    patience: Patience
    clock: Clock = field(repr=False)

    def ask(self, question: Question) -> CallRecord:
        """Return the reply to a question together with what it cost.

        Raises:
            UserError: The key was refused, the model does not exist or the account is empty.
            ModelError: No reply after every retry, or a request the provider will never accept.
            ValueError: The question has a system message after the first place, which strict servers refuse.
        """
        self._check_pictures(question)
        messages = _wire_messages(question.messages)
        started = datetime.now(UTC)
        begin = self.clock.now()
        response, failed = persist(
            self.name, lambda limit_s: self._attempt(question, messages, limit_s), self.patience, self.clock
        )
        return CallRecord(
            question=question,
            model=self.name,
            reply=_answer(response),
            finish=_FINISHES.get(response.finish_reason, "other"),
            usage=self._usage(question, response, self.clock.now() - begin, failed),
            started=started.isoformat(timespec="milliseconds"),
            failed_attempts=failed,
        )

    def _check_pictures(self, question: Question) -> None:
        shown = any(message.pictures for message in question.messages)
        if shown and not self.client.profile.get("supports_image_input", True):
            raise UserError(f"{self.name} takes no images; {_WITHOUT_PICTURES}.")

    def _attempt(self, question: Question, messages: list[ModelMessage], limit_s: float) -> ModelResponse:
        """Send the question once.

        The exception is raised outside the handler, so that what the provider's library put into its own exception,
        which may echo a key, does not travel along as the context.
        """
        try:
            response = background.run(self._request(messages, question.max_output_tokens, limit_s))
        except Exception as error:
            failure = explain(error, self.name, self.key_variable, self.access.keys())
        else:
            if not (response.parts or response.finish_reason or response.usage.has_values()):
                raise TransientError("the reply could not be read: it has neither words nor an end nor tokens")
            return response
        if isinstance(failure, ModelError) and any(message.pictures for message in question.messages):
            failure = UserError(f"{failure} It was shown pictures: if it takes none, {_WITHOUT_PICTURES}.")
        raise failure

    async def _request(self, messages: list[ModelMessage], max_output_tokens: int, limit_s: float) -> ModelResponse:
        from pydantic_ai.direct import model_request

        settings: ModelSettings = {
            "max_tokens": max_output_tokens,
            "timeout": limit_s,
            "request_timeout": limit_s,
            "max_retries": 0,
            "framing_announcement": "never",
            "cache": True,
        }
        async with self.client:
            return await model_request(self.client, messages, model_settings=settings)

    def _usage(
        self, question: Question, response: ModelResponse, latency_s: float, failed: tuple[FailedAttempt, ...]
    ) -> Usage:
        counted = _counted(question, response)
        return Usage(
            calls=1,
            input_tokens=counted.usage.input_tokens,
            cached_input_tokens=counted.usage.cache_read_tokens,
            output_tokens=counted.usage.output_tokens,
            tokens_estimated=counted is not response,
            cost_usd=cost_usd(counted, self.priced),
            latency_s=latency_s,
            retries=len(failed),
        )


def cost_usd(response: ModelResponse, priced: bool) -> float | None:
    """Return what a response cost [USD]: as its server reports it, else by list price, None when unknown.

    Args:
        response: The response.
        priced: Whether the provider's list prices apply.

    Source: list prices of the genai-prices package, matched by provider and model name.
    """
    reported: float | None = (response.provider_details or {}).get("cost")
    if reported is not None:
        return reported
    if not priced or not response.model_name:
        return None
    try:
        return float(response.cost().total_price)
    except (LookupError, ValueError):
        return None


def _answer(response: ModelResponse) -> str:
    """Return the words of a response, without reasoning, as a file can hold them."""
    words = response.text or (response.provider_details or {}).get("refusal", "")
    _, ended, answer = words.rpartition(_REASONING_ENDS)
    return writable(answer.lstrip() if ended else words)


def _counted(question: Question, response: ModelResponse) -> ModelResponse:
    """Return a response with its tokens, estimated from what is visible where its server did not count them."""
    told = response.usage
    visible = writable((response.thinking or "") + (response.text or ""))
    usage = replace(
        told,
        input_tokens=told.input_tokens or estimated_input_tokens(question),
        output_tokens=told.output_tokens or estimated_tokens(visible),
    )
    return response if usage == told else replace(response, usage=usage)


def _wire_messages(messages: tuple[Message, ...]) -> list[ModelMessage]:
    """Return the conversation in pydantic-ai's terms, word for word."""
    from pydantic_ai.messages import (
        BinaryContent,
        ModelRequest,
        ModelResponse,
        SystemPromptPart,
        TextPart,
        UserPromptPart,
    )

    wire: list[ModelMessage] = []
    for place, message in enumerate(messages):
        match message.role:
            case "system" if place == 0:
                wire.append(ModelRequest(parts=[SystemPromptPart(message.text)]))
            case "system":
                raise ValueError("a system message may only come first")
            case "user":
                shown = [BinaryContent(data=png, media_type="image/png") for png in message.pictures]
                wire.append(ModelRequest(parts=[UserPromptPart([message.text, *shown] if shown else message.text)]))
            case "assistant":
                wire.append(ModelResponse(parts=[TextPart(message.text)]))
    return wire
