"""Lines of progress in the log of a process: written by the command line, read by the web app."""

from __future__ import annotations

import re
from dataclasses import dataclass

INTERRUPTED = "Interrupted. Progress is kept"
"""Beginning of the line of a training that is stopped."""

_LINE = re.compile(r"(?P<doing>(?P<done>\d+) of (?P<of>\d+) (?:episodes ended|motions tried), .+)")
_LEFT = re.compile(r"[;,] about (?P<left>(?:\d+(?:\.\d+)? (?:h|min|s) ?)+)left.*")
_SECONDS = {"h": 3600.0, "min": 60.0, "s": 1.0}


def evaluation_line(ended: int, episodes: int, succeeded: int, rest: str) -> str:
    """Return the progress of an evaluation in words; `rest` is the time left or what is done after the episodes."""
    return f"{ended} of {episodes} episodes ended, {succeeded} succeeded; {rest}"


def probe_line(motions: int, candidates: int, solved: int, variations: int, progress: float, rest: str) -> str:
    """Return the progress of a probe in words; `rest` is the time left."""
    return (
        f"{motions} of {candidates} motions tried, {solved} of {variations} variations solved, "
        f"progress {progress:.2f}, {rest}"
    )


@dataclass(frozen=True)
class ProgressLine:
    """Progress that the last line of a log tells.

    Attributes:
        doing: The line without the time left.
        share: Share that is done, 0 to 1.
        left_s: Remaining time when the line was written [s]; None where the line has none.
    """

    doing: str
    share: float
    left_s: float | None


def read_progress(output: str) -> ProgressLine | None:
    """Return the progress that the last line of a log tells; None where it tells none."""
    lines = output.rstrip().splitlines()
    found = _LINE.fullmatch(lines[-1].strip()) if lines else None
    if found is None:
        return None
    left = _LEFT.search(found["doing"])
    left_s = None
    if left is not None:
        parts = left["left"].split()
        left_s = sum(float(amount) * _SECONDS[unit] for amount, unit in zip(parts[::2], parts[1::2], strict=True))
    share = int(found["done"]) / max(int(found["of"]), 1)
    return ProgressLine(_LEFT.sub("", found["doing"]), min(share, 1.0), left_s)
