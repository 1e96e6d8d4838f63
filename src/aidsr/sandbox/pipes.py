"""Messages between a process and its child: eight bytes of length, then JSON.

The child moves its pipes away from standard input and output first, so that nothing a library prints can be taken for
a message.
"""

from __future__ import annotations

import json
import os
import queue
import shutil
import struct
from typing import Any, BinaryIO

from aidsr.sandbox.environment import INSIDE

_LENGTH = struct.Struct(">Q")


def read_message(pipe: BinaryIO) -> dict[str, Any] | None:
    """Return the next message, or None when the other side has closed the pipe."""
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
        TypeError: The message holds something JSON cannot express.
    """
    body = json.dumps(message).encode()
    pipe.write(_LENGTH.pack(len(body)))
    pipe.write(body)
    pipe.flush()


def take_over_pipes() -> tuple[BinaryIO, BinaryIO]:
    """Return this process's request and reply pipes; whatever is printed from now on goes to standard error."""
    requests = os.fdopen(os.dup(0), "rb")
    replies = os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    return requests, replies


def forward_requests(requests: BinaryIO, inbox: queue.SimpleQueue[dict[str, Any]]) -> None:
    """Put requests into a queue until the parent is gone, then remove the private folder and exit, also mid-call.

    Runs in a thread of its own.
    """
    while (request := read_message(requests)) is not None:
        inbox.put(request)
    os.chdir(os.path.sep)
    shutil.rmtree(os.environ[INSIDE], ignore_errors=True)
    os._exit(0)
