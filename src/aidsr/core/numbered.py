"""Folders named by numbers: iterations, designs, trainings."""

from __future__ import annotations

from pathlib import Path

_MOST_DIGITS = 9


def is_number(name: str) -> bool:
    """Return whether a name is a number of ASCII digits; "²" is not: `str.isdigit` accepts it, `int` does not."""
    return name.isascii() and name.isdigit() and len(name) <= _MOST_DIGITS


def numbered_in(folder: Path) -> list[Path]:
    """Return the subfolders that are named by a number, in numerical order; empty if `folder` does not exist."""
    if not folder.is_dir():
        return []
    return sorted((path for path in folder.iterdir() if is_number(path.name) and path.is_dir()), key=_number)


def _number(path: Path) -> int:
    return int(path.name)
