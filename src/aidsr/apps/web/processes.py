"""Runs and trainings as separate processes: they outlive the web app, and a web app started later finds them again.

Each process writes its standard output to a log file. The web app locks that file before the process inherits it, and
the system keeps the lock until the process and its children have ended. So any process can check at any time whether
another still runs, and a process id is never mistaken for that of another program.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from aidsr.core.errors import UserError
from aidsr.core.progress_lines import ProgressLine, read_progress
from aidsr.runs.events import at_work
from aidsr.runs.files import replace_file

_LAST_WORDS = 4000
"""Number of characters shown of a log. Our choice: a traceback fits."""

_NICENESS = 10
"""Niceness of a process, so that pages stay responsive while it uses all processors. Our choice; 19 is the lowest
priority."""


_STOPPING_S = 70.0
"""Time after which a process that was asked to end may be asked again [s]. Our choice: a training has 60 s to save its
progress, and another signal in that time would end it before it has."""


@dataclass(frozen=True)
class Processes:
    """The processes that the web app started, by name."""

    folder: Path

    def start(self, name: str, command: Sequence[str]) -> None:
        """Start `aidsr COMMAND` as a separate process.

        Raises:
            UserError: A process of that name is still running.
        """
        if self.is_alive(name):
            raise UserError(f"{name} is already running; wait for it, or stop it first")
        self.folder.mkdir(parents=True, exist_ok=True)
        with self._log(name).open("wb") as log:
            _lock(log.fileno())
            process = subprocess.Popen(
                [sys.executable, "-P", "-m", "aidsr", *command],  # -P: import nothing from the working directory
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                creationflags=getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0),  # Windows
                env={**os.environ, "COLUMNS": "120", "NO_COLOR": "1", "PYTHONUNBUFFERED": "1"},
            )
        if hasattr(os, "setpriority"):
            own = os.getpriority(os.PRIO_PROCESS, 0)
            os.setpriority(os.PRIO_PROCESS, process.pid, max(own, _NICENESS))
        threading.Thread(target=process.wait, name=f"wait for {name}", daemon=True).start()
        note = {"pid": process.pid, "command": list(command)}
        replace_file(self._note(name), json.dumps(note).encode())

    def is_alive(self, name: str) -> bool:
        """Whether the process of that name is still running."""
        found = at_work(self._log(name))
        if found is None:
            return (pid := self.pid(name)) is not None and _exists(pid)
        return found

    def stop(self, name: str) -> bool:
        """Ask a process to end, as Control-C does, and return whether one was running.

        Finished work is kept; starting the process again resumes from there. A process that is already stopping is left
        to save its work: another signal would end it at once.
        """
        pid = self.pid(name)
        if pid is None or not self.is_alive(name):
            return False
        if self.is_stopping(name):
            return True
        replace_file(self._asked(name), str(pid).encode())
        try:
            os.kill(pid, signal.SIGTERM)
        except ProcessLookupError:  # it ended just now
            return False
        return True

    def is_stopping(self, name: str) -> bool:
        """Whether the process of that name was asked to end, by any page, and may still be saving its work."""
        asked = self._asked(name)
        try:
            pid, age_s = asked.read_text(encoding="ascii"), time.time() - asked.stat().st_mtime
        except FileNotFoundError:
            return False
        return age_s < _STOPPING_S and pid == str(self.pid(name)) and self.is_alive(name)

    def started_s(self, name: str) -> float:
        """Return when the process of that name was last started [s since 1970]; 0 if it never was."""
        try:
            return self._note(name).stat().st_mtime
        except FileNotFoundError:
            return 0.0

    def output_tail(self, name: str) -> str:
        """Return the end of a process's output."""
        try:
            output = self._log(name).read_text(encoding="utf-8", errors="replace")
        except FileNotFoundError:
            return ""
        return output[-_LAST_WORDS:].strip()

    def progress(self, name: str) -> ProgressLine | None:
        """Return the progress that the last line of a process's output tells, with the time left from now on.

        None where that line tells no progress.
        """
        found = read_progress(self.output_tail(name))
        if found is None or found.left_s is None:
            return found
        left_s = found.left_s - (time.time() - self._log(name).stat().st_mtime)
        return replace(found, left_s=left_s if left_s > 0 else None)

    def command(self, name: str) -> tuple[str, ...]:
        """Return the command with which the process of that name was last started; empty where it is not known."""
        command = self._noted(name).get("command")
        return tuple(map(str, command)) if isinstance(command, list) else ()

    def pid(self, name: str) -> int | None:
        """Return the process id of the last process of that name, which may have ended; None where it is not known."""
        pid = self._noted(name).get("pid")
        return pid if isinstance(pid, int) else None

    def _noted(self, name: str) -> dict[str, object]:
        """Return the note on the last process of that name; empty where there is none, or a damaged one."""
        try:
            note = json.loads(self._note(name).read_text(encoding="utf-8"))
        except (FileNotFoundError, ValueError):
            return {}
        return note if isinstance(note, dict) else {}

    def _log(self, name: str) -> Path:
        return self.folder / f"{name}.log"

    def _note(self, name: str) -> Path:
        return self.folder / f"{name}.json"

    def _asked(self, name: str) -> Path:
        """Return the file with the id of the process that was last asked to end."""
        return self.folder / f"{name}.stopping"


def _lock(file: int) -> None:
    """Take a lock that the child inherits with the open file."""
    try:
        import fcntl
    except ImportError:  # Windows: `is_alive` checks the process id instead
        return
    fcntl.flock(file, fcntl.LOCK_EX)


def _exists(pid: int) -> bool:
    if sys.platform == "win32":
        return _exists_on_windows(pid)
    try:
        os.kill(pid, 0)
    except OSError:
        return False
    return True


def _exists_on_windows(pid: int) -> bool:
    """Whether a process runs; `os.kill(pid, 0)` would send Control-C there."""
    import ctypes

    system = ctypes.windll.kernel32  # type: ignore[attr-defined]
    process = system.OpenProcess(_QUERY, False, pid)
    if not process:
        return False
    code = ctypes.c_ulong()
    known = system.GetExitCodeProcess(process, ctypes.byref(code))
    system.CloseHandle(process)
    return bool(known) and code.value == _STILL_ACTIVE


_QUERY, _STILL_ACTIVE = 0x1000, 259
"""PROCESS_QUERY_LIMITED_INFORMATION and STILL_ACTIVE. Source: Windows SDK, winnt.h and minwinbase.h."""
