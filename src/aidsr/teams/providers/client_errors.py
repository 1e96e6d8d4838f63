"""Translation of a client library's exceptions into those of AID-SR, with every API key redacted."""

from __future__ import annotations

import json
import traceback
from collections.abc import Iterable

from aidsr.core.errors import ModelError, UserError
from aidsr.teams.providers.retry import NoReplyInTimeError, TransientError

_READING_FUNCTIONS = frozenset({"_process_response", "_finish_response", "_from_response", "raw_decode"})
"""Functions in which pydantic-ai, the client libraries below it and `json` parse a reply. An error raised elsewhere is
not the server's fault."""
_BROKEN = "The service has a fault of its own; try again later, a run with `aidsr resume`"
_LIMITED = "The service limits its use; try again later, a run with `aidsr resume`"
_TOO_SLOW = "Raise AIDSR_ATTEMPT_TIMEOUT_S if the model is slow"
_MAX_DETAIL = 300
"""Length to which a provider's message is cut [characters]. Source: our choice; HTML error pages have kilobytes."""


def translate_error(error: Exception, name: str, key_variable: str, keys: Iterable[str]) -> Exception:
    """Return the exception to raise in place of an exception of a provider's client library.

    Args:
        error: The exception, as pydantic-ai raised it.
        name: Name of the model.
        key_variable: Name of the environment variable with the model's API key.
        keys: Every known key, to be redacted in the provider's message.

    Returns:
        TransientError when a retry may help, UserError when the user must act, ModelError when the provider will
        never accept the request. Any other exception is a bug and is returned as it is, unless it contains a key.
    """
    from pydantic_ai import exceptions as ai

    detail = redact(encodable(_detail(error)), keys)
    match error:
        case ai.ModelAuthenticationError():
            return UserError(f"{name} refused the key ({detail}); check the environment variable {key_variable}")
        case ai.ModelNotFoundError():
            return UserError(f"{name} was not found ({detail}){_suggestion(error)}; check the model's name and its URL")
        case ai.ModelQuotaExceededError():
            return UserError(f"the account of {key_variable} has no credit left for {name} ({detail})")
        case ai.ModelContextWindowExceededError():
            return ModelError(f"the prompt exceeds the context window of {name} ({detail})")
        case ai.ModelRequestTimeout() | ai.ModelTimeoutError() | TimeoutError():
            return NoReplyInTimeError("no reply in time", cure=_TOO_SLOW)
        case ai.ModelConnectionError():
            return TransientError(f"connection failed: {detail} Check the address, and that the server is running")
        case ai.ModelRateLimitError():
            return TransientError(detail, error.retry_after, cure=_LIMITED)
        case ai.ModelUnavailableError() | ai.ModelServerError():
            return TransientError(detail, error.retry_after, cure=_BROKEN)
        case ai.ModelHTTPError(status_code=408 | 409 | 425):
            return TransientError(detail, error.retry_after)
        case ai.ModelHTTPError() | ai.ModelRequestRejectedError() | ai.UserError():
            return ModelError(f"{name} rejected the request ({detail})")
        case _ if isinstance(error, ai.AgentRunError) or _failed_while_reading(error):
            return TransientError(f"the reply could not be read: {detail}")
        case _ if redact(repr(error), keys) != repr(error):
            return ModelError(f"the client of {name} failed ({detail})")
        case _:
            return error


def _failed_while_reading(error: Exception) -> bool:
    return any(frame.f_code.co_name in _READING_FUNCTIONS for frame, _ in traceback.walk_tb(error.__traceback__))


def redact(text: str, keys: Iterable[str]) -> str:
    """Return the text with every key replaced by asterisks."""
    for key in keys:
        text = text.replace(key, "***")
    return text


def encodable(text: str) -> str:
    """Return the text with "?" for each lone surrogate, which UTF-8 cannot encode."""
    return text.encode("utf-8", "replace").decode()


def _detail(error: Exception) -> str:
    """Return the provider's own message, shortened, such as "HTTP 429: Rate limit reached"."""
    status = getattr(error, "status_code", None)
    body = getattr(error, "body", None)
    message = _message(body) if body else "" if status else f"{type(error).__name__}: {error}"
    message = " ".join(message.split())
    if len(message) > _MAX_DETAIL:
        message = message[:_MAX_DETAIL] + "…"
    return ": ".join(part for part in (f"HTTP {status}" if status else "", message) if part)


def _message(body: object) -> str:
    """Return the message inside an error body, which may have any of the usual formats."""
    if isinstance(body, str):
        return body
    if isinstance(body, dict):
        inner = body.get("error", body)
        message = inner.get("message") if isinstance(inner, dict) else inner
        if message:
            return str(message)
    return json.dumps(body, default=str)


def _suggestion(error: Exception) -> str:
    near = getattr(error, "suggested_model_id", None)
    return f', did you mean "{near}"' if near else ""
