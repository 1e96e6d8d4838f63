"""Main program of a worker: the child process in which untrusted models are compiled and simulated.

`aidsr.sandbox.child` starts it as `python -m aidsr.sandbox.worker ACCESS [MODULE ...]` and exchanges one message at a
time with it. The process ends when its request pipe closes: when the parent closes it, or when the parent dies.
"""

from __future__ import annotations

import contextlib
import os
import queue
import signal
import sys
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO

from aidsr.core.errors import MjcfError, ReplyError, UserError
from aidsr.core.storage_errors import storage_problem
from aidsr.sandbox.access import Access
from aidsr.sandbox.limits import call_limits
from aidsr.sandbox.pipes import connect_to_parent, write_message

_UNKNOWN_CPP_EXCEPTION = "Caught an unknown exception!"
"""Message of the exception that MuJoCo's bindings raise for exceptions of its compiler, such as out of memory.
Source: pybind11."""


def main() -> None:
    """Answer requests until the parent closes the pipe."""
    inbox, replies = connect_to_parent(access=Access.from_json(sys.argv[1]), prepare=["mujoco", *sys.argv[2:]])
    import mujoco

    # Without a handler MuJoCo appends its warnings to MUJOCO_LOG.TXT in the working directory.
    mujoco.set_mju_user_warning(lambda _message: None)
    write_message(replies, {"ready": mujoco.__version__})
    parent = _Parent(inbox, replies)
    while True:
        request = inbox.get()
        try:
            parent.reply(_run(request, parent))
        except KeyboardInterrupt:  # the function has saved its work; end the process by the signal
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGINT)


@dataclass(frozen=True)
class _Parent:
    """Connection to the parent process, which sends requests and can receive progress."""

    inbox: queue.SimpleQueue[dict[str, Any]]
    replies: BinaryIO

    def reply(self, reply: dict[str, Any]) -> None:
        """Send the reply to a request."""
        try:
            write_message(self.replies, reply)
        except TypeError:
            write_message(self.replies, {"bug": traceback.format_exc()})

    def tell(self, values: list[Any]) -> None:
        """Send values to the listener in the parent, and wait until it has processed them."""
        write_message(self.replies, {"progress": values})
        self.inbox.get()


@contextlib.contextmanager
def _interruptible(saves: bool) -> Iterator[None]:
    """Turn SIGINT and SIGTERM into KeyboardInterrupt in a call that saves its work; they simply end other calls."""
    if not saves:
        yield
        return
    before = {kind: signal.signal(kind, signal.default_int_handler) for kind in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for kind, handler in before.items():
            signal.signal(kind, handler)


def _run(request: dict[str, Any], parent: _Parent) -> dict[str, Any]:
    from aidsr.sandbox.isolated import run_request

    try:
        sys.path.extend(entry for entry in request["path"] if entry not in sys.path)
        with call_limits(**request["limits"]), _interruptible(request.get("saves", False)):
            return {"result": run_request(request["function"], request["arguments"], parent.tell)}
    except MjcfError as error:
        return {"mjcf": [fault.model_dump(mode="json") for fault in error.faults]}
    except UserError as error:
        return {"user": str(error)}
    except ReplyError as error:
        return {"reply": str(error)}
    except MemoryError:
        return {"memory": True}
    except OSError as error:
        problem = storage_problem(error)
        return {"user": problem} if problem else {"bug": traceback.format_exc()}
    except Exception as error:
        return _failure_of_a_library(error) or {"bug": traceback.format_exc()}


def _failure_of_a_library(error: Exception) -> dict[str, Any]:
    """Return the reply for an error that a model caused in MuJoCo or NumPy; empty for any other error, a bug."""
    import mujoco
    import numpy as np

    if isinstance(error, mujoco.FatalError) and "memory" in str(error):
        return {"memory": f"MuJoCo says: {_first_line(error)}"}
    if isinstance(error, mujoco.FatalError) or str(error) == _UNKNOWN_CPP_EXCEPTION:
        return {"crash": f"{_first_line(error)}\n{traceback.format_exc()}"}
    if isinstance(error, (OverflowError, FloatingPointError, np.linalg.LinAlgError)):
        return {"overflow": _first_line(error), "traceback": traceback.format_exc()}
    return {}


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0]


if __name__ == "__main__":
    main()
