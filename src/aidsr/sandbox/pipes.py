"""Messages between a process and its child: eight bytes of length, then JSON.

The child first moves its pipes away from standard input and output, so that output printed by a library is not
mistaken for a message.
"""

from __future__ import annotations

import faulthandler
import json
import os
import queue
import shutil
import struct
import threading
from collections.abc import Iterable
from importlib import import_module
from typing import Any, BinaryIO

from aidsr.sandbox.access import NOTHING, Access
from aidsr.sandbox.environment import INSIDE
from aidsr.sandbox.limits import set_process_limits

_LENGTH = struct.Struct(">Q")


def read_message(pipe: BinaryIO) -> dict[str, Any] | None:
    """Return the next message, or None if the other side has closed the pipe."""
    header = pipe.read(_LENGTH.size)
    if len(header) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack(header)
    body = pipe.read(length)
    if len(body) < length:
        return None
    message: dict[str, Any] = json.loads(body)
    return message


def write_message(pipe: BinaryIO, message: dict[str, Any]) -> None:
    """Send one message.

    Raises:
        OSError: The other side has closed the pipe.
        TypeError: The message contains a value that JSON cannot express.
    """
    write_bytes(pipe, json.dumps(message).encode())


def write_bytes(pipe: BinaryIO, body: bytes) -> None:
    """Send one message that is not JSON.

    Raises:
        OSError: The other side has closed the pipe.
    """
    pipe.write(_LENGTH.pack(len(body)))
    pipe.write(body)
    pipe.flush()


def connect_to_parent(
    memory_mib: int | None = None, access: Access = NOTHING, prepare: Iterable[str] = ()
) -> tuple[queue.SimpleQueue[dict[str, Any]], BinaryIO]:
    """Set up this process as a child: limits, a queue of requests, and the pipe for replies.

    The process ends when its parent closes the request pipe, which also happens when the parent dies.

    Args:
        memory_mib: Permanent memory limit of this process; None for no limit.
        access: Files that it may open afterwards.
        prepare: Modules to import before it gives up access to other files, as "module", or "module:function" to also
            call a function. Python could not cache the bytecode of modules imported afterwards.

    Returns:
        The queue of requests, and the pipe for replies.
    """
    requests, replies = _take_over_pipes()
    faulthandler.enable()
    set_process_limits(memory_mib)
    for prepared in prepare:
        module, _, function = prepared.partition(":")
        loaded = import_module(module)
        if function:
            getattr(loaded, function)()
    access.give_up_everything_else()  # before the first thread: Landlock applies to threads started later
    inbox: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
    threading.Thread(target=_forward_requests, args=(requests, inbox), daemon=True).start()
    return inbox, replies


def _take_over_pipes() -> tuple[BinaryIO, BinaryIO]:
    """Return this process's request and reply pipes, and redirect standard output to standard error."""
    requests = os.fdopen(os.dup(0), "rb")
    replies = os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    return requests, replies


def _forward_requests(requests: BinaryIO, inbox: queue.SimpleQueue[dict[str, Any]]) -> None:
    """Put requests into a queue until the parent has ended; then remove the private folder and exit, even in a call."""
    while (request := read_message(requests)) is not None:
        inbox.put(request)
    os.chdir(os.path.sep)
    shutil.rmtree(os.environ[INSIDE], ignore_errors=True)
    os._exit(0)
