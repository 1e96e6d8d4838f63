"""The child process in which models from outside are compiled and simulated.

`aidsr.sandbox.isolation` starts it as `python -m aidsr.sandbox.worker` and talks to it over two pipes, one message at a
time: eight bytes of length, then JSON. The pipes are moved away from standard input and output first, so that nothing a
library prints can be taken for an answer.

The process ends when its request pipe closes, which happens when the parent closes it and also when the parent dies.
"""

from __future__ import annotations

import contextlib
import faulthandler
import json
import math
import os
import queue
import shutil
import struct
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any, BinaryIO

from aidsr.core.errors import MjcfError, UserError

__all__ = [
    "GL_WANTED",
    "INSIDE",
    "limit_for_good",
    "listen",
    "main",
    "read_message",
    "resolve",
    "take_over_pipes",
    "write_message",
]

INSIDE = "AIDSR_INSIDE_WORKER"
"""Environment variable that tells a worker's code that it is already isolated."""

GL_WANTED = "AIDSR_GL"
"""Environment variable that tells a worker's code what the user set MUJOCO_GL to."""

_LENGTH = struct.Struct(">Q")
_MAX_FILE_BYTES = 256 * 2**20  # our choice: a picture is 100 KB, a video a few MB; a runaway log must not fill the disk


def read_message(pipe: BinaryIO) -> dict[str, Any] | None:
    """Return the next message, or None when the other side has gone."""
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
        OSError: The other side has gone.
        TypeError: The message holds something JSON cannot express.
    """
    body = json.dumps(message).encode()
    pipe.write(_LENGTH.pack(len(body)))
    pipe.write(body)
    pipe.flush()


def resolve(function: str) -> Callable[[dict[str, Any]], dict[str, Any]]:
    """Return the function named "package.module:function".

    Raises:
        ValueError: It is not a function of AID-SR; nothing else is ever run by name.
    """
    module, _, name = function.partition(":")
    if module.split(".")[0] != "aidsr" or not name.isidentifier():
        raise ValueError(f'expected "aidsr.module:function", found {function!r}')
    found: Callable[[dict[str, Any]], dict[str, Any]] = getattr(import_module(module), name)
    return found


def main() -> None:
    """Answer requests until the parent closes the pipe."""
    requests, replies = take_over_pipes()
    faulthandler.enable()
    limit_for_good()
    inbox: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
    threading.Thread(target=listen, args=(requests, inbox), daemon=True).start()
    import mujoco

    # Without a handler MuJoCo appends its warnings to MUJOCO_LOG.TXT in the working directory.
    mujoco.set_mju_user_warning(lambda _message: None)
    write_message(replies, {"ready": mujoco.__version__})
    while True:
        _reply(replies, _answer(inbox.get()))


def take_over_pipes() -> tuple[BinaryIO, BinaryIO]:
    """Return the request and reply pipes; whatever is printed from now on goes to standard error."""
    requests = os.fdopen(os.dup(0), "rb")
    replies = os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    return requests, replies


def listen(requests: BinaryIO, inbox: queue.SimpleQueue[dict[str, Any]]) -> None:
    """Pass requests on; end the process when the parent has gone, also in the middle of a call."""
    while (request := read_message(requests)) is not None:
        inbox.put(request)
    os.chdir(os.path.sep)
    shutil.rmtree(os.environ[INSIDE], ignore_errors=True)
    os._exit(0)


def _reply(replies: BinaryIO, answer: dict[str, Any]) -> None:
    try:
        write_message(replies, answer)
    except TypeError:
        write_message(replies, {"bug": traceback.format_exc()})


def _answer(request: dict[str, Any]) -> dict[str, Any]:
    try:
        with _limited(**request["limits"]):
            return {"result": resolve(request["function"])(request["argument"])}
    except MjcfError as error:
        return {"mjcf": [fault.model_dump(mode="json") for fault in error.faults]}
    except UserError as error:
        return {"user": str(error)}
    except MemoryError:
        return {"memory": True}
    except Exception:
        return {"bug": traceback.format_exc()}


def limit_for_good() -> None:
    """Set the limits that hold for every call: no core dumps, no giant files."""
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_FSIZE, (_MAX_FILE_BYTES, _MAX_FILE_BYTES))


@contextlib.contextmanager
def _limited(cpu_s: float, memory_mib: int) -> Iterator[None]:
    """Limit processor time and address space for one call.

    Past the first the system ends the process (SIGXCPU); past the second allocations fail. Only the soft limits are
    moved, so that they can be taken back afterwards.
    """
    if sys.platform == "win32":
        yield
        return
    import resource

    limits = {resource.RLIMIT_CPU: math.ceil(time.process_time() + cpu_s)}
    if sys.platform == "linux":  # macOS ignores it
        limits[resource.RLIMIT_AS] = memory_mib * 2**20
    before = {kind: resource.getrlimit(kind) for kind in limits}
    for kind, soft in limits.items():
        resource.setrlimit(kind, (soft, before[kind][1]))
    try:
        yield
    finally:
        for kind, both in before.items():
            resource.setrlimit(kind, both)


if __name__ == "__main__":
    main()
