"""One event loop in its own thread, so that any thread can wait for a provider's asynchronous client."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Coroutine
from typing import Any, TypeVar

T = TypeVar("T")

_lock = threading.Lock()
_loops: list[asyncio.AbstractEventLoop] = []


def run_coroutine(coroutine: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine on the event loop and wait for its result.

    Several threads may wait at once; their coroutines run concurrently. An interrupt of the waiting thread cancels
    the coroutine.
    """
    future = asyncio.run_coroutine_threadsafe(coroutine, _event_loop())
    try:
        return future.result()
    except BaseException:
        future.cancel()
        raise


def _event_loop() -> asyncio.AbstractEventLoop:
    """Return the event loop; the first call starts it."""
    with _lock:
        if not _loops:
            loop = asyncio.new_event_loop()
            threading.Thread(target=loop.run_forever, name="aidsr-models", daemon=True).start()
            _loops.append(loop)
        return _loops[0]
