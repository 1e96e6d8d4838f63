"""Recorded calls of a language model in a folder of a run."""

from __future__ import annotations

from pathlib import Path

from aidsr.core.calls import CallRecord
from aidsr.runs.files import JsonFile

UNUSABLE = ".unusable.json"


def calls_in(folder: Path, *, usable: bool = False) -> tuple[CallRecord, ...]:
    """Return the calls recorded in `folder`/calls, in order; `usable` leaves out those marked as unusable."""
    paths = sorted((folder / "calls").glob("[0-9]*_*.json"))
    records = (JsonFile(path, CallRecord).read() for path in paths if not (usable and path.name.endswith(UNUSABLE)))
    return tuple(record for record in records if record is not None)


def set_calls_aside(folder: Path) -> None:
    """Mark the calls of a folder as unusable: they still count in the cost, but no longer answer questions."""
    for path in (folder / "calls").glob("[0-9]*_*.json"):
        if not path.name.endswith(UNUSABLE):
            path.rename(path.with_name(path.name.removesuffix(".json") + UNUSABLE))
