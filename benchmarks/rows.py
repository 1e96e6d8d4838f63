"""Rows of a benchmark: a file with one JSON object per line."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from aidsr.core.artifacts import Artifact

Row = TypeVar("Row", bound=Artifact)


def read_rows(path: Path, kind: type[Row]) -> list[Row]:
    """Return the rows of a file, none if there is no file."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return [kind.model_validate_json(line) for line in lines]


def append_row(path: Path, row: Artifact) -> None:
    """Append a row to a file, which several processes may do at the same time."""
    with path.open("a", encoding="utf-8") as file:
        file.write(row.model_dump_json() + "\n")
