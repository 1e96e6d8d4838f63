"""A folder of runs: list them, find one by name, move one to the trash and restore it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from aidsr.core.arguments import check_type
from aidsr.core.errors import UserError
from aidsr.core.plain_tree import require_plain_tree
from aidsr.runs.events import at_work
from aidsr.runs.folders import RUN_FILE, Run

_TRASH = ".trash"
_NAME = re.compile(r"\w[\w .+()-]{0,199}(?<! )")
"""Pattern of valid run names: no path separator, no leading dot, no "..", no trailing space."""


@dataclass(frozen=True, init=False)
class Library:
    """All runs in one folder. Names of runs are untrusted input and are checked before use.

        for run in aidsr.Library("runs").runs():
            print(run.name, aidsr.read_status(run).approved)

    Raises:
        TypeError: `path` has another type.
    """

    path: Path

    def __init__(self, path: str | Path) -> None:
        check_type(path, (str, Path), "a library must be given as the path of a folder of runs")
        object.__setattr__(self, "path", Path(path))

    def runs(self) -> tuple[Run, ...]:
        """Return all runs, newest first, including folders that were copied here."""
        if not self.path.is_dir():
            return ()
        found = (path for path in self.path.iterdir() if is_name(path.name) and _is_run(path))
        return tuple(Run(path) for path in sorted(found, key=_begun, reverse=True))

    def run(self, name: str) -> Run:
        """Return the run of that name.

        Raises:
            UserError: There is no such run directly in this folder, or it contains links or other special files.
        """
        run = Run(self._inside(self.path, name))
        require_plain_tree(run.path)
        return run

    def trash(self, name: str) -> None:
        """Move a run to the folder .trash, from which `restore` moves it back.

        Raises:
            UserError: There is no such run, a process is working on it, or .trash contains a run of the same name.
        """
        run = self.run(name)
        if at_work(run.events):
            raise UserError(f"{name} is running; stop it first, then delete it")
        trash = self.path / _TRASH
        trash.mkdir(exist_ok=True)
        taken = {path.name for path in trash.iterdir()}
        if name in taken:
            raise UserError(f"another run named {name} is in {trash} already; remove or rename that one first")
        run.path.replace(trash / name)

    def restore(self, name: str) -> None:
        """Move a run back out of the trash.

        Raises:
            UserError: The trash has no run of that name, or another run has this name now.
        """
        found = self._inside(self.path / _TRASH, name)
        if (self.path / name).exists():
            raise UserError(f"{name} cannot be put back: there is another run of that name by now")
        found.replace(self.path / name)

    def _inside(self, folder: Path, name: str) -> Path:
        path = folder / name
        if is_name(name):
            refuse_link(path)
        ours = is_name(name) and path.resolve().parent == folder.resolve()
        if not (ours and _is_run(path)):
            raise UserError(f'"{name[:80]}" is not a run under {folder}')
        return path


def refuse_link(path: Path) -> None:
    """Refuse a run that is a link: its files are outside the folder of runs.

    Raises:
        UserError: The path is a link.
    """
    if path.is_symlink():
        raise UserError(
            f'"{path.name}" is not a run under {path.parent} but a link; move or copy the run there, or give the '
            "folder that holds it with --runs"
        )


def is_name(name: str) -> bool:
    """Return whether a text is a valid name of a run: no path separator, no leading dot."""
    return bool(_NAME.fullmatch(name))


def fingerprint(run: Run) -> tuple[tuple[str, int, int], ...]:
    """Return a value that changes whenever the run changes: names, modification times and sizes of its files.

    It is cheap enough to compute every second, so that a run is only read again after a change.
    """
    names = [RUN_FILE, "events.jsonl", "calls", "designs"]
    each = ["events.jsonl", "outcome.json", "[0-9][0-9]*", "[0-9][0-9]*/calls", "training"]
    trainings = ["training/[0-9]*", "training/[0-9]*/*.csv", "training/[0-9]*/*.json", "training/[0-9]*/*.mp4"]
    paths = [run.path / name for name in names]
    for design in run.designs:
        paths += [design.path, *(path for pattern in (*each, *trainings) for path in design.path.glob(pattern))]
    return tuple(mark for path in paths if (mark := _mark(path)) is not None)


def _is_run(path: Path) -> bool:
    file = path / RUN_FILE
    try:
        return file.is_file() and not file.is_symlink()
    except OSError:  # a folder that may not be read, such as lost+found
        return False


def _mark(path: Path) -> tuple[str, int, int] | None:
    try:
        found = path.stat()
    except OSError:  # deleted since it was listed, or not readable
        return None
    return str(path), found.st_mtime_ns, found.st_size


def _begun(path: Path) -> tuple[datetime, str]:
    """Return when a run was created, from its record or else the time of run.json, and the folder's name for ties."""
    mark = _mark(path / RUN_FILE)
    written = datetime.fromtimestamp(mark[1] / 1e9 if mark else 0.0).astimezone()
    try:
        record = Run(path).record.read()
        return (datetime.fromisoformat(record.started).astimezone() if record else written), path.name
    except (UserError, ValueError):
        return written, path.name
