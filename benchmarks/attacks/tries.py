"""One try of an attack: how commands are run, and the outcome."""

from __future__ import annotations

import hashlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

LIMIT_S = 20.0
"""Processor time [s] of a process and of the children that it waited for above which a try counts as a hang."""
WALL_S = 600.0
"""Wall time [s] after which a try counts as a hang, however little processor time it used. Long, because other work may
share the machine."""
ENDINGS = {0, 1, 2}
"""Allowed exit codes of a command: done, result not good enough, error explained in a sentence."""


@dataclass
class Outcome:
    """Outcome of one try. An empty text means that nothing of its kind happened."""

    attack: str
    name: str
    lost: str = ""
    """What was finished before the try and is missing after it."""
    hang: str = ""
    """What did not end in time."""
    changed: str = ""
    """What differs from the undisturbed result without the program reporting it."""
    failed: str = ""
    """Any other forbidden event: a traceback, a foreign file read or written, a key sent or kept."""
    seconds: float = 0.0
    notes: dict[str, Any] = field(default_factory=dict)

    @property
    def survived(self) -> bool:
        """Whether nothing was lost, hung, changed or failed."""
        return not (self.lost or self.hang or self.changed or self.failed)

    def row(self) -> dict[str, Any]:
        """Return the outcome as a JSON object."""
        return {**vars(self), "survived": self.survived}


@dataclass(frozen=True)
class Ended:
    """Result of a command that ended by itself or was killed."""

    code: int | None
    """Exit code; None if the command did not end in time."""
    out: str
    error: str
    cpu_s: float
    wall_s: float

    def problem(self) -> tuple[str, str]:
        """Return the hang and the other failure in words; empty texts if there is none."""
        if self.code is None:
            return f"no end after {self.wall_s:.0f} s, {self.cpu_s:.0f} s of processor", ""
        hang = f"{self.cpu_s:.0f} s of processor" if self.cpu_s > LIMIT_S else ""
        if "Traceback (most recent call last)" in self.out + self.error:
            return hang, "traceback: " + (self.error or self.out).strip().splitlines()[-1][:200]
        return hang, "" if self.code in ENDINGS else f"exit code {self.code}: {self.error[-200:]}"


def environment(home: Path, **more: str) -> dict[str, str]:
    """Return the environment variables of a command: with its own settings folder, without API keys and base URLs."""
    kept = {name: value for name, value in os.environ.items() if not name.endswith(("_API_KEY", "_BASE_URL"))}
    return {**kept, "XDG_CONFIG_HOME": str(home / "settings"), "OMP_NUM_THREADS": "1", "COLUMNS": "200", **more}


def start(
    home: Path, words: Sequence[str], env: Mapping[str, str] | None = None, **options: Any
) -> subprocess.Popen[str]:
    """Start `aidsr` in a folder, as the leader of a process group."""
    return subprocess.Popen(
        [sys.executable, "-m", "aidsr", *words],
        cwd=home,
        env=dict(env or environment(home)),
        start_new_session=True,
        text=True,
        errors="replace",
        **{"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options},
    )


def run(home: Path, *words: str, env: Mapping[str, str] | None = None) -> Ended:
    """Run `aidsr` to its end, and kill it after `WALL_S`."""
    before, began_s = os.times(), time.monotonic()
    process = start(home, words, env)
    try:
        out, error = process.communicate(timeout=WALL_S)
        code: int | None = process.returncode
    except subprocess.TimeoutExpired:
        end(process)
        out, error = process.communicate()
        code = None
    after = os.times()
    cpu_s = after.children_user + after.children_system - before.children_user - before.children_system
    return Ended(code, out, error, cpu_s, time.monotonic() - began_s)


def end(process: subprocess.Popen[str]) -> None:
    """Kill a process that was started with `start`, and its whole process group."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        return


def contents(folder: Path, *, without: Sequence[str] = ()) -> dict[str, str]:
    """Return the SHA-256 of every regular file below a folder; links are not followed."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not path.is_symlink() and path.name not in without
    }


def workers_of(pid: int) -> list[int]:
    """Return the ids of a process's descendants (workers and jobs), at most four levels deep. Linux only."""
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            try:
                parents[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            except (OSError, IndexError):
                continue
    below, found = {pid}, list[int]()
    for _ in range(4):
        new = {child for child, parent in parents.items() if parent in below} - below
        found += sorted(new)
        below |= new
    return found
