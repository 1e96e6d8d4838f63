"""Calls that misbehave on purpose, to see that isolation holds on this machine.

`try_isolation` runs some of them; the tests run them one by one. Each function is called in a worker.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

from aidsr.core.artifacts import Fault
from aidsr.core.errors import IsolationError, MjcfError, UserError
from aidsr.sandbox import isolation
from aidsr.sandbox.isolation import Guarantee, Limits

__all__ = ["try_isolation"]

_HOME = "aidsr.sandbox.self_test"


def try_isolation() -> tuple[Guarantee, ...]:
    """Return which promises of isolation were kept just now; takes a few seconds."""
    found = []
    for name, function, argument, limits, kind in (
        ("own process", "crash", {}, Limits(), "crash"),
        ("wall clock", "sleep", {"seconds": 60}, Limits(wall_s=0.5), "time"),
        ("processor time", "spin", {}, Limits(wall_s=30, cpu_s=1), "time"),
        ("memory", "allocate", {"mib": 8192}, Limits(memory_mib=2048), "memory"),
    ):
        ending = _ending(function, argument, limits)
        found.append(Guarantee(name, ending == kind, f"tried with {_HOME}:{function}, which ended in: {ending}"))
    return tuple(found)


def _ending(function: str, argument: dict[str, Any], limits: Limits) -> str:
    try:
        isolation.call(f"{_HOME}:{function}", argument, limits)
    except IsolationError as error:
        return error.kind
    return "no error"


def echo(argument: dict[str, Any]) -> dict[str, Any]:
    """Return the argument and the number of the process."""
    return {"argument": argument, "pid": os.getpid()}


def chatter(_argument: dict[str, Any]) -> dict[str, Any]:
    """Print to standard output from Python and from C."""
    print("not an answer")  # noqa: T201
    sys.stdout.flush()
    os.write(1, b"\x00" * 64)
    return {"done": True}


def surroundings(_argument: dict[str, Any]) -> dict[str, Any]:
    """Leave a file behind and return the working directory and the names of the environment variables."""
    Path("MUJOCO_LOG.TXT").write_text("left behind")
    return {"folder": str(Path.cwd()), "variables": sorted(os.environ)}


def crash(_argument: dict[str, Any]) -> dict[str, Any]:
    """Read from address zero, as a fault in a native library would."""
    ctypes.string_at(0)
    return {}


def abort(argument: dict[str, Any]) -> dict[str, Any]:
    """End the process with a signal."""
    os.kill(os.getpid(), signal.Signals[argument["signal"]])
    return {}


def sleep(argument: dict[str, Any]) -> dict[str, Any]:
    """Wait without using the processor."""
    time.sleep(argument["seconds"])
    return {}


def hang(argument: dict[str, Any]) -> dict[str, Any]:
    """Wait in native code that keeps the interpreter to itself."""
    ctypes.PyDLL(None).sleep(argument["seconds"])
    return {}


def spin(_argument: dict[str, Any]) -> dict[str, Any]:
    """Use the processor for ever."""
    while True:
        pass


def allocate(argument: dict[str, Any]) -> dict[str, Any]:
    """Ask for memory."""
    return {"bytes": len(bytes(argument["mib"] * 2**20))}


def refuse(argument: dict[str, Any]) -> dict[str, Any]:
    """Raise one of the errors that travel back as they are, or any other."""
    if argument["error"] == "mjcf":
        fault = Fault(code="bad_value", layer="load", severity="error", names=("a",), message="on purpose", line=3)
        raise MjcfError([fault])
    if argument["error"] == "user":
        raise UserError("on purpose")
    raise LookupError("on purpose")


def unspeakable(_argument: dict[str, Any]) -> dict[str, Any]:
    """Return something that JSON cannot express."""
    return {"value": object()}
