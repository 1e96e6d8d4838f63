"""Functions that behave badly on purpose, to see what isolation makes of them."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from aidsr.core.artifacts import Fault
from aidsr.core.errors import MjcfError, ReplyError, UserError
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits


@dataclass(frozen=True)
class Parcel:
    """Values of several types."""

    text: str = "Grüße"
    numbers: tuple[float, ...] = (1.0, 2.5, float("inf"))
    data: bytes = b"\x89PNG\xff"
    nothing: None = None


@isolated
def echo(parcel: Parcel = Parcel(), *, more: bytes = b"") -> tuple[Parcel, bytes]:
    return parcel, more


@isolated
def process() -> int:
    """Return the number of the process."""
    return os.getpid()


@isolated
def die_until(folder: Path, last: int) -> int:
    """Count the tries in a file; be killed in all but the last."""
    tries = folder / "tries"
    count = len(tries.read_text()) + 1 if tries.exists() else 1
    tries.write_text("x" * count)
    if count < last:
        os.kill(os.getpid(), signal.SIGKILL)
    return count


@isolated(limits=Limits(wall_s=8.0, grace_s=20.0))
def count_to(last: int, folder: Path, heard: Callable[[int, Parcel], None]) -> str:
    """Tell every number, each within the limit of time; write the last one down when interrupted."""
    number = 0
    try:
        for number in range(1, last + 1):
            time.sleep(3 if last == 3 else 0)
            heard(number, Parcel(str(number)))
        time.sleep(60 if last == 5 else 0)
    except KeyboardInterrupt:
        (folder / "kept").write_text(str(number))
        raise
    return f"up to {number}"


@isolated
def open_files(paths: list[str]) -> list[str]:
    """Return in which of some files and folders something could be read, written or listed."""
    return [path for path in paths if _opened(path)]


@isolated
def open_files_below(folder: Path, paths: list[str]) -> list[str]:
    """Do the same with access to a folder, or to a file."""
    return [path for path in paths if _opened(path)]


@dataclass(frozen=True)
class Box:
    """Holds paths, as deep as arguments are nested."""

    inside: tuple[Path, ...]


@isolated
def open_files_in(box: Box) -> list[str]:
    """Return which of the files in a box could be read."""
    return [str(path) for path in box.inside if _opened(str(path))]


def _opened(path: str) -> bool:
    try:
        if path.endswith("new"):
            Path(path).write_text("made")
        elif Path(path).is_dir():
            list(Path(path).iterdir())
        else:
            Path(path).read_bytes()
    except PermissionError:
        return False
    return True


@isolated
def variables_of_the_parent() -> bool:
    """Return whether the environment of the caller, with its keys, can be read."""
    try:
        return bool(Path(f"/proc/{os.getppid()}/environ").read_bytes())
    except PermissionError:
        return False


@isolated
def connect(port: int) -> bool:
    """Return whether a TCP connection can be made."""
    try:
        socket.create_connection(("127.0.0.1", port), timeout=10).close()
    except PermissionError:
        return False
    return True


@isolated
def absolute(path: Path, box: Box = Box(())) -> tuple[Path, ...]:
    return path, *box.inside


@isolated
def chatter() -> bool:
    """Print to standard output from Python and from C."""
    print("not a reply")  # noqa: T201
    sys.stdout.flush()
    os.write(1, b"\x00" * 64)
    return True


@isolated
def surroundings() -> tuple[Path, list[str]]:
    """Leave a file behind and return the working directory and the names of the environment variables."""
    Path("MUJOCO_LOG.TXT").write_text("left behind")
    return Path.cwd(), sorted(os.environ)


@isolated
def crash() -> None:
    """Read from address zero, as a fault in a native library would."""
    ctypes.string_at(0)


@isolated
def die_by(name: str) -> None:
    """End the process with a signal."""
    os.kill(os.getpid(), signal.Signals[name])


@isolated
def sleep(seconds: float) -> None:
    """Wait without using the processor."""
    time.sleep(seconds)


@isolated(limits=Limits(wall_s=900))
def sleep_long() -> None:
    time.sleep(600)


@isolated(limits=Limits(wall_s=0.2))
def sleep_too_long() -> None:
    time.sleep(600)


@isolated(limits=Limits(wall_s=0.2))
def hang() -> None:
    """Wait in native code that keeps the interpreter to itself."""
    ctypes.PyDLL(None).sleep(600)


@isolated(limits=Limits(cpu_s=0.1))
def spin() -> None:
    """Use the processor for ever."""
    while True:
        pass


@isolated
def allocate(mib: int) -> int:
    return len(bytes(mib * 2**20))


@isolated(limits=Limits(memory_mib=1024))
def allocate_in_a_gigabyte(mib: int) -> int:
    return len(bytes(mib * 2**20))


@isolated
def refuse(error: Literal["mjcf", "user", "bug"]) -> None:
    """Raise one of the errors that travel back as they are, or any other."""
    if error == "mjcf":
        fault = Fault(code="bad_value", layer="load", severity="error", names=("a",), message="on purpose", line=3)
        raise MjcfError([fault])
    if error == "user":
        raise UserError("on purpose")
    raise LookupError("on purpose")


@isolated
def lie() -> int:
    """Return something else than the annotation says."""
    return object()  # type: ignore[return-value]


@isolated
def refuse_reply() -> None:
    raise ReplyError("It has no <patch>.")
