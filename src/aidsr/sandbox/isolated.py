"""The decorator `@isolated`: a function runs in a child process with limits, but is called like any other function.

A model written by a language model or a stranger can make a native library crash, hang or exhaust memory. Therefore,
every function that compiles or steps such a model has this decorator:

    @isolated
    def measure(robot: Robot) -> Extent:
        import mujoco
        ...

For the caller, signature, types and errors are those of the function. The body runs in one of a few warm workers (see
`aidsr.sandbox.pool`). Modules that load slowly are imported in the body, so that the caller never loads them.
"""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, wraps
from importlib import import_module
from types import GenericAlias
from typing import Any, ParamSpec, TypeVar, get_args, get_origin, get_type_hints, overload

from pydantic import ConfigDict, TypeAdapter

from aidsr.core.artifacts import Fault
from aidsr.core.errors import IsolationError, MjcfError, ReplyError, UserError, WorkerLostError
from aidsr.sandbox.access import Access, with_absolute_paths
from aidsr.sandbox.environment import inside_worker
from aidsr.sandbox.limits import Limits
from aidsr.sandbox.pool import call_in_worker, module_path

_PAUSES_S = (0.0, 0.5, 3.0)
"""Pause before each attempt of a call [s]. Our choice: memory used by another process is often free after seconds."""

P = ParamSpec("P")
R = TypeVar("R")


@overload
def isolated(function: Callable[P, R], /) -> Callable[P, R]: ...
@overload
def isolated(*, limits: Limits, prepare: Sequence[str] = ()) -> Callable[[Callable[P, R]], Callable[P, R]]: ...
def isolated(
    function: Callable[P, R] | None = None, /, *, limits: Limits | None = None, prepare: Sequence[str] = ()
) -> Callable[P, R] | Callable[[Callable[P, R]], Callable[P, R]]:
    """Make a module-level function run in a worker process with limits.

    Arguments and result are sent as JSON according to their annotations, which must be importable at run time: pydantic
    models, dataclasses, numbers, text, bytes and containers of them. A relative path, also in a model or container, is
    relative to the caller's directory. The function may be called from several threads; each call has its own worker.

    A parameter annotated as `Callable[[…], None]` is a listener: it is called in the caller's process, and the function
    waits until it returns. If an argument is a Path, the worker may change files in the folder or read the file; it can
    open no other file of the user where the system has Landlock (`aidsr.sandbox.access`). Inside a worker, the function
    runs directly, within the limits of the current call.

    MjcfError, UserError and ReplyError of the function reach the caller unchanged. In addition, a call raises:

        IsolationError: The call exceeded a limit, its numbers overflowed or its process crashed.
        WorkerLostError: Its process was lost in each of three attempts: it could not start or was ended from outside.
        RuntimeError: The function has a bug; the child's traceback is a note on the error.

    Args:
        function: The function; omitted if limits are given.
        limits: Limits of a call; `Limits()` by default.
        prepare: Modules that take long to load, see `connect_to_parent`; each call then has a new process.
    """
    if function is not None:
        return _isolate(function, limits or Limits(), prepare)
    return lambda function: _isolate(function, limits or Limits(), prepare)


def run_request(name: str, arguments: Sequence[Any], tell: Callable[[list[Any]], None]) -> Any:
    """Run a decorated function on arguments from JSON and return its result as JSON values.

    Args:
        name: Name of the function, "module:function".
        arguments: All arguments except the listener, as JSON values.
        tell: Sends values to the listener, as JSON values.

    Raises:
        ValueError: The function is not decorated with `@isolated`; no other function is run by name.
    """
    import_module(name.partition(":")[0])
    if name not in _FUNCTIONS:
        raise ValueError(f"{name} is not decorated with @isolated")
    return _FUNCTIONS[name].run(arguments, tell)


def _isolate(function: Callable[P, R], limits: Limits, prepare: Sequence[str]) -> Callable[P, R]:
    if function.__qualname__ != function.__name__:
        raise TypeError(f"{function.__qualname__} is not at module level, where a worker could find it")
    subject = _FUNCTIONS[f"{function.__module__}:{function.__qualname__}"] = _Function(function, limits, prepare)

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        if inside_worker():
            return function(*args, **kwargs)
        result: R = subject.call(*args, **kwargs)
        return result

    return call


@dataclass(frozen=True)
class _Function:
    """A decorated function with the JSON conversion of its arguments and its result."""

    function: Callable[..., Any]
    limits: Limits
    prepare: Sequence[str]

    @cached_property
    def _signature(self) -> inspect.Signature:
        return inspect.signature(self.function)

    @cached_property
    def _types(self) -> dict[str, Any]:
        return get_type_hints(self.function, include_extras=True)

    @cached_property
    def _sent(self) -> list[str]:
        """Names of the arguments that are sent to the worker."""
        return [name for name in self._signature.parameters if name != self._listener]

    @cached_property
    def _listener(self) -> str:
        """Name of the listener argument, empty if there is none."""
        return next((name for name, kind in self._types.items() if get_origin(kind) is Callable), "")

    @cached_property
    def _progress(self) -> TypeAdapter[Any]:
        kinds, _ = get_args(self._types[self._listener])
        return _adapter(*kinds)

    @cached_property
    def _arguments(self) -> TypeAdapter[Any]:
        return _adapter(*(self._types[name] for name in self._sent))

    @cached_property
    def _result(self) -> TypeAdapter[Any]:
        return _adapter(self._types["return"])

    def call(self, *args: Any, **kwargs: Any) -> Any:
        """Run the function in a worker."""
        bound = self._signature.bind(*args, **kwargs)
        bound.apply_defaults()
        given = bound.arguments
        values = with_absolute_paths(tuple(given[name] for name in self._sent))
        listen = given.get(self._listener)
        path = module_path()
        request = {
            "function": f"{self.function.__module__}:{self.function.__qualname__}",
            "arguments": self._arguments.dump_python(values, mode="json", warnings="error"),
            "limits": {"cpu_s": self.limits.cpu_s, "memory_mib": self.limits.memory_mib},
            "path": path,  # a worker finds the same modules as its caller
            "saves": self.limits.grace_s > 0,
        }

        def hear(told: list[Any]) -> None:
            if listen is not None:
                listen(*self._progress.validate_python(told))

        reply = self._reply(request, Access.needed(path, values), hear)
        if "lost" in reply:
            raise WorkerLostError(
                f"{self.function.__name__} could not be run: its worker process was lost {len(_PAUSES_S)} times, the "
                f"last time because {reply['lost']}. Free memory on this machine, or run fewer jobs, then try again"
            )
        if "result" not in reply:
            raise _error(self.function.__name__, reply, self.limits)
        (result,) = self._result.validate_python(reply["result"])
        return result

    def _reply(self, request: dict[str, Any], access: Access, listen: Callable[[list[Any]], None]) -> dict[str, Any]:
        """Return the reply of a worker; if it is lost without fault of the request, try again with another worker."""
        for pause_s in _PAUSES_S:
            time.sleep(pause_s)
            reply = call_in_worker(request, self.limits.wall_s, access, self.prepare, listen, self.limits.grace_s)
            if "lost" not in reply:
                break
        return reply

    def run(self, arguments: Sequence[Any], tell: Callable[[list[Any]], None]) -> Any:
        """Run the function in this process on arguments from JSON, and return its result as JSON values."""
        values = dict(zip(self._sent, self._arguments.validate_python(arguments), strict=True))
        if self._listener:
            values[self._listener] = lambda *told: tell(self._progress.dump_python(told, mode="json", warnings="error"))
        result = self.function(**values)
        return self._result.dump_python((result,), mode="json", warnings="error")


def _adapter(*types: Any) -> TypeAdapter[Any]:
    """Return the converter for a tuple of values of these types; bytes are encoded as base64."""
    row: Any = GenericAlias(tuple, types)
    return TypeAdapter(row, config=ConfigDict(ser_json_bytes="base64", val_json_bytes="base64"))


_FUNCTIONS: dict[str, _Function] = {}


def _error(name: str, reply: dict[str, Any], limits: Limits) -> Exception:
    """Return the exception for a reply without a result."""
    if "mjcf" in reply:
        return MjcfError([Fault.model_validate(fault) for fault in reply["mjcf"]])
    if "user" in reply:
        return UserError(reply["user"])
    if "reply" in reply:
        return ReplyError(reply["reply"])
    if "bug" in reply:
        error = RuntimeError(f"{name} failed in its worker: {reply['bug'].strip().splitlines()[-1]}")
        error.add_note("In the worker:\n" + reply["bug"])
        return error
    if "time" in reply:
        spent = f"{limits.wall_s:g} s" if reply["time"] == "wall" else f"{limits.cpu_s:g} s of processor time"
        return IsolationError("time", f"{name} was stopped after {spent}; the model is too large or too slow to run")
    if "memory" in reply:
        if isinstance(reply["memory"], str):
            return IsolationError("memory", f"{name} ran out of memory; the model is too large. {reply['memory']}")
        return IsolationError("memory", f"{name} needed more than {limits.memory_mib} MiB; the model is too large")
    if "overflow" in reply:
        overflow = IsolationError("overflow", f"numbers overflow in {name}: {reply['overflow']}")
        overflow.add_note("In the worker:\n" + reply["traceback"])
        return overflow
    return IsolationError("crash", f"the process running {name} died: {reply['crash']}")
