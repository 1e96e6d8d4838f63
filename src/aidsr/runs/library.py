"""A folder of runs: which there are, one by its name, thrown away and taken back."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from aidsr.core.errors import UserError
from aidsr.core.plain_tree import require_plain_tree
from aidsr.runs.events import at_work
from aidsr.runs.folders import Run

_TRASH = ".trash"
_NAME = re.compile(r"\w[\w .+()-]{0,199}(?<! )")
"""What a folder may be called to be opened by name: no separator, nothing hidden, nothing that climbs."""


@dataclass(frozen=True)
class Library:
    """All runs under one folder. Names come from outside and are taken for what they are: text that may be hostile."""

    path: Path

    def runs(self) -> tuple[Run, ...]:
        """Return all runs, the newest first; a folder copied here from elsewhere is one of them."""
        if not self.path.is_dir():
            return ()
        found = (path for path in self.path.iterdir() if is_name(path.name) and _is_run(path))
        return tuple(Run(path) for path in sorted(found, key=_begun, reverse=True))

    def run(self, name: str) -> Run:
        """Return the run of that name.

        Raises:
            UserError: There is none directly in this folder, or it holds links or other special files.
        """
        run = Run(self._inside(self.path, name))
        require_plain_tree(run.path)
        return run

    def trash(self, name: str) -> None:
        """Move a run to the folder .trash; `restore` moves it back until that folder is emptied.

        Raises:
            UserError: There is no such run, or a process is at work on it.
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
        """Take a run back out of the trash.

        Raises:
            UserError: There is none of that name, or its place is taken.
        """
        found = self._inside(self.path / _TRASH, name)
        if (self.path / name).exists():
            raise UserError(f"{name} cannot be put back: there is another run of that name by now")
        found.replace(self.path / name)

    def _inside(self, folder: Path, name: str) -> Path:
        path = folder / name
        ours = is_name(name) and path.resolve().parent == folder.resolve()
        if not (ours and _is_run(path)):
            raise UserError(f'"{name[:80]}" is not a run under {folder}')
        return path


def is_name(name: str) -> bool:
    """Return whether a folder may be called so to be opened by name: no separator, nothing hidden."""
    return bool(_NAME.fullmatch(name))


def fingerprint(run: Run) -> tuple[tuple[str, int, int], ...]:
    """Return what changes whenever something happens to a run: names, times and sizes of its files.

    Cheap enough to call every second, so that a run is only read again when there is something new.
    """
    names = ["run.json", "events.jsonl", "calls", "designs"]
    each = ["events.jsonl", "outcome.json", "[0-9][0-9]*", "[0-9][0-9]*/calls", "training"]
    trainings = ["training/[0-9]*", "training/[0-9]*/*.csv", "training/[0-9]*/*.json", "training/[0-9]*/*.mp4"]
    paths = [run.path / name for name in names]
    for design in run.designs:
        paths += [design.path, *(path for pattern in (*each, *trainings) for path in design.path.glob(pattern))]
    return tuple(mark for path in paths if (mark := _mark(path)) is not None)


def _is_run(path: Path) -> bool:
    file = path / "run.json"
    return file.is_file() and not file.is_symlink()


def _mark(path: Path) -> tuple[str, int, int] | None:
    try:
        found = path.stat()
    except FileNotFoundError:  # gone between being listed and being looked at
        return None
    return str(path), found.st_mtime_ns, found.st_size


def _begun(path: Path) -> tuple[datetime, str]:
    """When a run began, by its own words where they can be read, else by the age of its file."""
    written = datetime.fromtimestamp((path / "run.json").stat().st_mtime).astimezone()
    try:
        record = Run(path).record.read()
        return (datetime.fromisoformat(record.started).astimezone() if record else written), path.name
    except (UserError, ValueError):
        return written, path.name
