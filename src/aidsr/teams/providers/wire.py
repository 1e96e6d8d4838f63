"""The HTTP client of all providers. It limits the size of replies, independent of the size that the server announces.

A megabyte of gzip can decompress to a gigabyte, a stream may never end, and a redirect could send the key to another
host.
"""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Iterator
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import httpx2

MAX_REPLY_BYTES = 16 * 2**20
"""Maximum size of a decompressed reply [bytes]. Our choice: a hundred times the size of 20,000 tokens with their
reasoning."""
_TIMEOUT_S, _CONNECT_S = 1200.0, 5.0
"""Time limits of the client for a request and for connecting [s]; each request replaces the first by its own, shorter
one. Source: those of pydantic-ai's clients."""
_MOST_TOKENS = 100_000_000
"""Largest token count of one call that is accepted as plausible. Our choice: a hundred times the largest context."""


@dataclass
class Exchange:
    """The response of a server in one attempt."""

    status: int = 0
    body: bytes = b""
    too_large: bool = False
    sent: bool = False
    """Whether the whole request was sent."""

    def reported_tokens(self) -> tuple[int, int] | None:
        """Return the input and output tokens that a reply without usable text reports; None if it reports none."""
        try:
            reply = json.loads(self.body)
        except (ValueError, RecursionError):
            return None
        usage = (reply.get("usage") or reply.get("usageMetadata")) if isinstance(reply, dict) else None
        if self.status != 200 or not isinstance(usage, dict):
            return None
        tokens_in = _first_count(usage, "prompt_tokens", "input_tokens", "promptTokenCount")
        if "prompt_tokens" not in usage:  # Anthropic counts the cached part of a prompt apart
            tokens_in += sum(
                token_count(usage.get(name)) for name in ("cache_creation_input_tokens", "cache_read_input_tokens")
            )
        tokens_out = _first_count(usage, "completion_tokens", "output_tokens", "candidatesTokenCount")
        tokens_out += token_count(usage.get("thoughtsTokenCount"))  # Google counts the reasoning apart
        return (tokens_in, tokens_out) if tokens_in or tokens_out else None

    @property
    def cut_off(self) -> bool:
        """Whether the reply begins as JSON but is not valid JSON: the model wrote a reply, which is billed."""
        if self.status != 200 or not self.body.lstrip().startswith(b"{"):
            return False
        try:
            json.loads(self.body)
        except (ValueError, RecursionError):
            return True
        return False


_exchange: ContextVar[Exchange | None] = ContextVar("exchange", default=None)


@contextlib.contextmanager
def watched(exchange: Exchange) -> Iterator[None]:
    """Record in `exchange` what a server sends within this block."""
    token = _exchange.set(exchange)
    try:
        yield
    finally:
        _exchange.reset(token)


def http_client() -> httpx2.AsyncClient:
    """Return a client that follows no redirect, keeps no connection open and reads at most `MAX_REPLY_BYTES`."""
    import httpx2
    from pydantic_ai.models import create_async_httpx2_client

    client = create_async_httpx2_client(
        timeout=httpx2.Timeout(_TIMEOUT_S, connect=_CONNECT_S), limits=httpx2.Limits(max_keepalive_connections=0)
    )
    client.follow_redirects = False
    client.event_hooks = {**client.event_hooks, "request": [_note_sent], "response": [_read_within_limit]}
    return client


def amount(value: object) -> float | None:
    """Return a value that a server reports as a number; None if it is not a number, not finite or negative."""
    if not isinstance(value, int | float) or isinstance(value, bool) or not 0 <= value <= sys.float_info.max:
        return None
    return float(value)


def token_count(value: object) -> int:
    """Return a number of tokens that a server reports; 0 if the value is not plausible."""
    number = amount(value)
    return int(number) if number is not None and number <= _MOST_TOKENS else 0


def _first_count(usage: dict[str, Any], *names: str) -> int:
    return next((token_count(usage[name]) for name in names if name in usage), 0)


async def _note_sent(request: httpx2.Request) -> None:
    """Have the connection record in the exchange when the whole request was sent."""
    exchange = _exchange.get() or Exchange()

    async def trace(event: str, _info: dict[str, Any]) -> None:
        exchange.sent = exchange.sent or event.endswith(".send_request_body.complete")

    request.extensions["trace"] = trace


async def _read_within_limit(response: httpx2.Response) -> None:
    """Read a reply in chunks as it is decompressed, so that never more than the limit is in memory."""
    exchange = _exchange.get() or Exchange()
    exchange.status, exchange.body = response.status_code, b""
    pieces, size = list[bytes](), 0
    try:
        async for piece in response.aiter_bytes():
            size += len(piece)
            if size > MAX_REPLY_BYTES:
                exchange.too_large = True
                raise ValueError(f"the reply has more than {MAX_REPLY_BYTES // 2**20} MiB")
            pieces.append(piece)
    finally:
        exchange.body = b"".join(pieces)
    response._content = exchange.body  # where `aread` stores it; a stream can be read only once
