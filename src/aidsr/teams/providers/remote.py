"""A model of an HTTP service, called through pydantic-ai."""

from __future__ import annotations

import asyncio
import json
import re
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from aidsr.core.calls import CallRecord, FailedAttempt, Finish, Message, Question, ToolCall, Usage
from aidsr.core.errors import AidsrError, ModelError, UserError
from aidsr.teams.providers.client_errors import encodable, redact, translate_error
from aidsr.teams.providers.event_loop import run_coroutine
from aidsr.teams.providers.prices import cost_usd, list_price_usd
from aidsr.teams.providers.provider import Endpoint
from aidsr.teams.providers.retry import NoReplyInTimeError, TransientError, call_with_retries
from aidsr.teams.providers.tokens import estimate_input_tokens, estimate_tokens
from aidsr.teams.providers.wire import MAX_REPLY_BYTES, Exchange, token_count, watched

if TYPE_CHECKING:
    from pydantic_ai.messages import ModelMessage, ModelResponse, ToolCallPart
    from pydantic_ai.models import Model as Client
    from pydantic_ai.settings import ModelSettings

_WITHOUT_TOOLS = "start the run with text_tools, or name a model that calls tools"
_REFUSES_TOOLS = re.compile(r"\btools?\b.*(support|require)|support.*\btools?\b", re.IGNORECASE)
"""A message that says that tools are not taken, such as "does not support tools" or "tools param requires --jinja"."""
_WITHOUT_PICTURES = "start the run without judge_pictures, or name a model that takes images"

_SHORTEST_KEY = 8
"""Least length of a key that is redacted in a reply [characters]. Our choice: shorter keys, such as "none", are
ordinary words."""
_REASONING_END = "</think>"
"""End tag of the reasoning. It has no opening tag in a reply if the server's chat template writes that one; pydantic-ai
removes complete pairs."""

_FINISHES: dict[str | None, Finish] = {
    "stop": "stop",
    "tool_call": "stop",
    "length": "length",
    "content_filter": "refusal",
}


@dataclass(frozen=True)
class RemoteModel:
    """A model that is called through pydantic-ai.

    Attributes:
        endpoint: Provider, name, address, key and retry settings of the model.
        client: Model object of pydantic-ai, which knows the wire format.
    """

    endpoint: Endpoint
    client: Client = field(repr=False)

    @property
    def name(self) -> str:
        """Name of the model, as it is recorded."""
        return self.endpoint.name

    @property
    def calls_tools(self) -> bool:
        """Whether the model accepts tools; True if it is unknown."""
        return bool(self.client.profile.get("supports_tools", True))

    def ask(self, question: Question) -> CallRecord:
        """Return the record of a call with the reply to a question and its cost.

        Raises:
            UserError: The key was refused, the model does not exist or the account is empty.
            ModelError: Every attempt failed, or the provider will never accept the request.
            ValueError: The question has a system message that is not its first message; strict servers reject that.
        """
        self._check_pictures(question)
        messages = _wire_messages(question.messages)
        started = datetime.now(UTC)
        clock = self.endpoint.clock
        start_s = clock.now()
        failed: list[FailedAttempt] = []

        def record(reply: str, finish: Finish, usage: Usage, tool_calls: tuple[ToolCall, ...] = ()) -> CallRecord:
            billed = sum((attempt.usage for attempt in failed), usage)
            spent = {
                "calls": 1,
                "latency_s": clock.now() - start_s,
                "retries": max(0, len(failed) - (finish == "failed")),
            }
            return CallRecord(
                question=question,
                model=self.name,
                reply=reply,
                tool_calls=tool_calls,
                finish=finish,
                usage=billed.model_copy(update=spent),
                started=started.isoformat(timespec="milliseconds"),
                failed_attempts=tuple(failed),
            )

        try:
            response = call_with_retries(
                self.name,
                lambda limit_s: self._attempt(question, messages, limit_s),
                self.endpoint.retry,
                clock,
                failed,
            )
        except AidsrError as error:
            if failed:
                error.failed_call = record("", "failed", Usage())
            raise
        keys = [key for key in self._keys() if len(key) >= _SHORTEST_KEY]
        finish = _FINISHES.get(response.finish_reason, "other")
        called = tuple(
            ToolCall(id=part.tool_call_id, name=part.tool_name, arguments=redact(_arguments(part), keys))
            for part in response.tool_calls
        )
        return record(redact(_reply_text(response), keys), finish, self._usage(question, response), called)

    def _check_pictures(self, question: Question) -> None:
        has_pictures = any(message.pictures for message in question.messages)
        if has_pictures and not self.client.profile.get("supports_image_input", True):
            raise UserError(f"{self.name} takes no images; {_WITHOUT_PICTURES}")

    def _attempt(self, question: Question, messages: list[ModelMessage], limit_s: float) -> ModelResponse:
        """Send the question once.

        The exception is raised outside the `except` block, so that the library's own exception, which may contain a
        key, is not attached to it as its context.
        """
        exchange = Exchange()
        try:
            response = run_coroutine(self._request(question, messages, limit_s, exchange))
        except Exception as error:
            variables = " or ".join(self.endpoint.provider.key_variables)
            failure = translate_error(error, self.name, variables, self._keys())
        else:
            if not (response.parts or response.finish_reason or response.usage.has_values()):
                raise TransientError("the reply could not be read: it has no text, finish reason or token count")
            return response
        if exchange.too_large:
            failure = TransientError(f"the reply has more than {MAX_REPLY_BYTES // 2**20} MiB")
        if isinstance(failure, TransientError):
            failure.usage = self._billed(question, exchange, late=isinstance(failure, NoReplyInTimeError))
        if question.tools:
            failure = self._with_advice_on_tools(failure)
        if isinstance(failure, ModelError) and any(message.pictures for message in question.messages):
            failure = UserError(f"{failure}; the request had pictures: if the model takes none, {_WITHOUT_PICTURES}")
        raise failure

    def _with_advice_on_tools(self, failure: Exception) -> Exception:
        """Return the failure of a request with tools, with advice where the model may take none.

        That is so if the request was rejected, or if the service says so while it reports a missing model or a fault of
        its own. Other failures are retried or have a cure of their own.
        """
        model = self.endpoint.argument.partition("@")[0]
        says_so = _REFUSES_TOOLS.search(str(failure).replace(model, ""))
        if isinstance(failure, ModelError) or (isinstance(failure, UserError) and says_so):
            return UserError(f"{failure}; the request had tools: if the model takes none, {_WITHOUT_TOOLS}")
        if isinstance(failure, TransientError) and says_so and str(failure).startswith("HTTP 5"):
            failure.cure = f"The request had tools: if the model takes none, {_WITHOUT_TOOLS}"
        return failure

    async def _request(
        self, question: Question, messages: list[ModelMessage], limit_s: float, exchange: Exchange
    ) -> ModelResponse:
        from pydantic_ai.direct import model_request
        from pydantic_ai.models import ModelRequestParameters
        from pydantic_ai.tools import ToolDefinition

        settings: ModelSettings = {
            "max_tokens": question.max_output_tokens,
            "timeout": limit_s,
            "request_timeout": limit_s,
            "max_retries": 0,
            "framing_announcement": "never",
            "cache": True,
        }
        tools = ModelRequestParameters(
            function_tools=[
                ToolDefinition(name=tool.name, description=tool.description, parameters_json_schema=tool.parameters)
                for tool in question.tools
            ]
        )
        # The client's own time limit applies to each chunk of a reply; a server could send chunks without end.
        async with asyncio.timeout(limit_s), self.client:
            with watched(exchange):
                return await model_request(
                    self.client, messages, model_settings=settings, model_request_parameters=tools
                )

    def _keys(self) -> list[str]:
        return [key.get_secret_value() for key in self.endpoint.secrets]

    def _billed(self, question: Question, exchange: Exchange, *, late: bool) -> Usage:
        """Return the billed usage of a reply that could not be read; no usage if it was not a reply of a model.

        A reply that was not even begun in time counts as the longest one: services bill what the model wrote, although
        nobody waits for it any more.
        """
        reported = exchange.reported_tokens()
        unseen = late and exchange.sent and not exchange.status
        if reported is None and not (exchange.cut_off or exchange.too_large or unseen):
            return Usage()
        tokens_in, tokens_out = reported or (
            estimate_input_tokens(question),
            question.max_output_tokens
            if unseen
            else min(estimate_tokens(exchange.body.decode(errors="replace")), question.max_output_tokens),
        )
        provider, known = self.endpoint.provider, self.endpoint.has_list_price
        price = (
            list_price_usd(provider.price_id or "", self.endpoint.argument, tokens_in, tokens_out) if known else None
        )
        return Usage(
            input_tokens=tokens_in, output_tokens=tokens_out, tokens_estimated=reported is None, cost_usd=price
        )

    def _usage(self, question: Question, response: ModelResponse) -> Usage:
        counted = _with_token_counts(question, response)
        return Usage(
            input_tokens=counted.usage.input_tokens,
            cached_input_tokens=counted.usage.cache_read_tokens,
            output_tokens=counted.usage.output_tokens,
            tokens_estimated=counted is not response,
            cost_usd=cost_usd(counted, self.endpoint.has_list_price),
        )


def _reply_text(response: ModelResponse) -> str:
    """Return the text of a response, without its reasoning."""
    text = response.text or (response.provider_details or {}).get("refusal", "")
    _, end, answer = text.rpartition(_REASONING_END)
    return encodable(answer.lstrip() if end else text)


def _arguments(part: ToolCallPart) -> str:
    """Return the arguments of a tool call as JSON text: the model's own text if the provider passes that on."""
    return encodable(part.args if isinstance(part.args, str) else json.dumps(part.args or {}))


def _with_token_counts(question: Question, response: ModelResponse) -> ModelResponse:
    """Return a response with token counts; those that the server did not report are estimated from the visible text."""
    reported = response.usage
    visible = encodable((response.thinking or "") + (response.text or ""))
    visible += "".join(part.tool_name + _arguments(part) for part in response.tool_calls)
    usage = replace(
        reported,
        input_tokens=token_count(reported.input_tokens) or estimate_input_tokens(question),
        output_tokens=token_count(reported.output_tokens) or estimate_tokens(visible),
        cache_read_tokens=token_count(reported.cache_read_tokens),
    )
    return response if usage == reported else replace(response, usage=usage)


def _wire_messages(messages: tuple[Message, ...]) -> list[ModelMessage]:
    """Return the conversation as messages of pydantic-ai, with unchanged texts."""
    from pydantic_ai.messages import (
        BinaryContent,
        ModelRequest,
        ModelResponse,
        SystemPromptPart,
        TextPart,
        ToolCallPart,
        ToolReturnPart,
        UserPromptPart,
    )

    wire: list[ModelMessage] = []
    for index, message in enumerate(messages):
        match message.role:
            case "system" if index == 0:
                wire.append(ModelRequest(parts=[SystemPromptPart(message.text)]))
            case "system":
                raise ValueError("a system message may only come first")
            case "user":
                pictures = [BinaryContent(data=png, media_type="image/png") for png in message.pictures]
                turn = UserPromptPart([message.text, *pictures] if pictures else message.text)
                outputs = [ToolReturnPart(one.name, one.text, one.id) for one in message.tool_outputs]
                said = [turn] if message.text or pictures or not outputs else []
                wire.append(ModelRequest(parts=[*outputs, *said]))
            case "assistant":
                calls = [ToolCallPart(one.name, one.arguments, one.id) for one in message.tool_calls]
                text = [TextPart(message.text)] if message.text or not calls else []
                wire.append(ModelResponse(parts=[*text, *calls]))
    return wire
