"""The child process in which models from outside are compiled and simulated.

`aidsr.sandbox.child` starts it as `python -m aidsr.sandbox.worker [MODULE ...]` and exchanges one message at a time
with it. The process ends when its request pipe closes, which happens when the parent closes it and also when the parent
dies.
"""

from __future__ import annotations

import sys
import traceback
from importlib import import_module
from typing import Any, BinaryIO

from aidsr.core.errors import MjcfError, ReplyError, UserError
from aidsr.sandbox.limits import call_limits
from aidsr.sandbox.pipes import connect_to_parent, write_message

_UNKNOWN_CPP_EXCEPTION = "Caught an unknown exception!"
"""What MuJoCo's bindings raise for its compiler's own exceptions, as where memory runs out. Source: pybind11."""


def main() -> None:
    """Answer requests until the parent closes the pipe."""
    inbox, replies = connect_to_parent()
    import mujoco

    # Without a handler MuJoCo appends its warnings to MUJOCO_LOG.TXT in the working directory.
    mujoco.set_mju_user_warning(lambda _message: None)
    write_message(replies, {"ready": mujoco.__version__})
    for module in sys.argv[1:]:
        import_module(module)
    while True:
        _reply(replies, _run(inbox.get()))


def _reply(replies: BinaryIO, reply: dict[str, Any]) -> None:
    try:
        write_message(replies, reply)
    except TypeError:
        write_message(replies, {"bug": traceback.format_exc()})


def _run(request: dict[str, Any]) -> dict[str, Any]:
    from aidsr.sandbox.isolated import run_request

    try:
        sys.path.extend(entry for entry in request["path"] if entry not in sys.path)
        with call_limits(**request["limits"]):
            return {"result": run_request(request["function"], request["arguments"])}
    except MjcfError as error:
        return {"mjcf": [fault.model_dump(mode="json") for fault in error.faults]}
    except UserError as error:
        return {"user": str(error)}
    except ReplyError as error:
        return {"reply": str(error)}
    except MemoryError:
        return {"memory": True}
    except Exception as error:
        return _failure_of_a_library(error) or {"bug": traceback.format_exc()}


def _failure_of_a_library(error: Exception) -> dict[str, Any]:
    """Return the reply where a model was too much for MuJoCo or NumPy; empty for any other error, which is a bug."""
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
