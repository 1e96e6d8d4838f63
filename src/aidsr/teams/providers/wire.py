"""The HTTP client of all providers: what a server may send is limited, whatever it says it sends.

A megabyte of gzip can unfold to a gigabyte, a stream need not end, and a redirect could take the key to another host.
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
"""Bytes of a reply, unpacked. Our choice: a hundred times what 20,000 tokens with their reasoning hold."""
_TIMEOUT_S, _CONNECT_S = 1200.0, 5.0
"""Time limits of the client; each request shortens the first to its own. Source: those of pydantic-ai's clients."""
_MOST_TOKENS = 100_000_000
"""Tokens of one call that are believed. Our choice: a hundred times the largest context."""


@dataclass
class Exchange:
    """What a server sent in one attempt."""

    status: int = 0
    body: bytes = b""
    too_large: bool = False

    def reported_tokens(self) -> tuple[int, int] | None:
        """Return the tokens in and out that a reply without usable text says were used; None where it says nothing."""
        try:
            reply = json.loads(self.body)
        except (ValueError, RecursionError):
            return None
        usage = (reply.get("usage") or reply.get("usageMetadata")) if isinstance(reply, dict) else None
        if self.status != 200 or not isinstance(usage, dict):
            return None
        tokens_in = _first_count(usage, "prompt_tokens", "input_tokens", "promptTokenCount")
        tokens_out = _first_count(usage, "completion_tokens", "output_tokens", "candidatesTokenCount")
        return (tokens_in, tokens_out) if tokens_in or tokens_out else None

    @property
    def cut_off(self) -> bool:
        """Whether a reply began as JSON and cannot be read: it was written, and is paid for."""
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
    """Note what a server sends within this block."""
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
    client.event_hooks = {**client.event_hooks, "response": [_read_within_limit]}
    return client


def amount(value: object) -> float | None:
    """Return a number that a server reports, None where it is none, not finite or negative."""
    if not isinstance(value, int | float) or isinstance(value, bool) or not 0 <= value <= sys.float_info.max:
        return None
    return float(value)


def token_count(value: object) -> int:
    """Return a number of tokens that a server reports, 0 where it cannot be one."""
    number = amount(value)
    return int(number) if number is not None and number <= _MOST_TOKENS else 0


def _first_count(usage: dict[str, Any], *names: str) -> int:
    return next((token_count(usage[name]) for name in names if name in usage), 0)


async def _read_within_limit(response: httpx2.Response) -> None:
    """Read a reply piece by piece as it unpacks, so that no more than the limit is ever held."""
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
    response._content = exchange.body  # as `aread` keeps it; a stream can be read only once
