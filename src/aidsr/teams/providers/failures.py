"""What went wrong at a provider, in our own terms and in a sentence, with every key wiped out."""

from __future__ import annotations

import json
import traceback
from collections.abc import Iterable

from aidsr.core.errors import ModelError, UserError
from aidsr.teams.providers.retry import TransientError

__all__ = ["explain", "wipe", "writable"]

_READING = frozenset({"_process_response", "_finish_response"})
"""Functions in which pydantic-ai's clients read a reply; what goes wrong before them is no fault of the server."""
_LONGEST_DETAIL = 300
"""Characters of a provider's own words that are kept. Source: our choice; HTML error pages run to kilobytes."""


def explain(error: Exception, name: str, key_variable: str, keys: Iterable[str]) -> Exception:
    """Return what to raise for an exception of a provider's client.

    Args:
        error: The exception, as pydantic-ai raised it.
        name: Name of the model.
        key_variable: Environment variable that holds its key.
        keys: Every known key, to be wiped out of the provider's words.

    Returns:
        TransientError when asking again may help, UserError when the person must act, ModelError when the provider
        said no for good; an exception that neither a provider nor the reading of its reply raised, which is a bug,
        comes back as it is unless it contains a key.
    """
    from pydantic_ai import exceptions as ai

    detail = wipe(writable(_detail(error)), keys)
    match error:
        case ai.ModelAuthenticationError():
            return UserError(f"{name} refused the key ({detail}); check the environment variable {key_variable}.")
        case ai.ModelNotFoundError():
            return UserError(
                f"{name} was not found ({detail}){_suggestion(error)}; check the model's name and its URL."
            )
        case ai.ModelQuotaExceededError():
            return UserError(f"The account behind {key_variable} has no credit left for {name} ({detail}).")
        case ai.ModelContextWindowExceededError():
            return ModelError(f"The prompt is longer than {name} can read ({detail}).")
        case ai.ModelRequestTimeout() | ai.ModelTimeoutError():
            return TransientError("no reply in time")
        case ai.ModelConnectionError():
            return TransientError(f"connection failed: {detail}")
        case ai.ModelRateLimitError() | ai.ModelUnavailableError() | ai.ModelServerError():
            return TransientError(detail, error.retry_after)
        case ai.ModelHTTPError(status_code=408 | 409 | 425):
            return TransientError(detail, error.retry_after)
        case ai.ModelHTTPError() | ai.ModelRequestRejectedError() | ai.UserError():
            return ModelError(f"{name} rejected the request ({detail}).")
        case _ if isinstance(error, ai.AgentRunError) or _arose_while_reading(error):
            return TransientError(f"the reply could not be read: {detail}")
        case _ if wipe(repr(error), keys) != repr(error):
            return ModelError(f"The client of {name} failed ({detail}).")
        case _:
            return error


def _arose_while_reading(error: Exception) -> bool:
    return any(frame.f_code.co_name in _READING for frame, _ in traceback.walk_tb(error.__traceback__))


def wipe(text: str, keys: Iterable[str]) -> str:
    """Return the text with every key replaced by asterisks."""
    for key in keys:
        text = text.replace(key, "***")
    return text


def writable(text: str) -> str:
    """Return the text with "?" for each half of a character (a lone surrogate), which no file can hold."""
    return text.encode("utf-8", "replace").decode()


def _detail(error: Exception) -> str:
    """Return the provider's own words, short: "HTTP 429: Rate limit reached"."""
    status = getattr(error, "status_code", None)
    body = getattr(error, "body", None)
    words = _words(body) if body else "" if status else f"{type(error).__name__}: {error}"
    words = " ".join(words.split())
    if len(words) > _LONGEST_DETAIL:
        words = words[:_LONGEST_DETAIL] + "…"
    return ": ".join(part for part in (f"HTTP {status}" if status else "", words) if part)


def _words(body: object) -> str:
    """Return the message inside an error body, whichever of the usual shapes it has."""
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
