"""Which known name a misspelt one stands for."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable

_LONGEST = 100
"""Characters of a name that is compared; the time of a comparison grows with their square. Our choice."""
_MOST_COMPARED = 2000
"""Names that one is compared with. Our choice: as many as a large robot has."""


def closest_name(name: str, known: Iterable[str], *, cutoff: float = 0.6) -> str:
    """Return the known name that is most like a name, for a "did you mean"; "" where none is; see `close_names`."""
    return next(iter(close_names(name, known, most=1, cutoff=cutoff)), "")


def close_names(name: str, known: Iterable[str], *, most: int, cutoff: float = 0.6) -> list[str]:
    """Return the known names that are most like a name, the likest first.

    Args:
        name: What was written.
        known: What could have been meant.
        most: How many to return.
        cutoff: Least likeness, from 0 to 1, as `difflib` measures it.
    """
    if len(name) > _LONGEST:
        return []
    compared = sorted({other for other in known if len(other) <= _LONGEST})[:_MOST_COMPARED]
    return difflib.get_close_matches(name, compared, n=most, cutoff=cutoff)


def only_close_name(name: str, known: Iterable[str], *, cutoff: float = 0.6) -> str:
    """Return the one known name that is most like a name; "" where there is none, or another is as like."""
    found = close_names(name, known, most=2, cutoff=cutoff)
    likeness = [difflib.SequenceMatcher(None, name, other).ratio() for other in found]
    return found[0] if found and (len(found) == 1 or likeness[0] > likeness[1]) else ""


def one_slip_away(name: str, known: Collection[str]) -> str:
    """Return the only known name that differs by one slip; "" where there is none, or more than one.

    A slip is a letter too many, too few, wrong or swapped with its neighbour; letter case, "_" and "-" do not count.
    """
    same = [other for other in known if _plain(other) == _plain(name)]
    near = same or [other for other in known if _is_slip(_plain(name), _plain(other))]
    return near[0] if len(near) == 1 else ""


def _plain(name: str) -> str:
    return name.lower().replace("_", "").replace("-", "")


def _is_slip(wrong: str, right: str) -> bool:
    shorter = min(len(wrong), len(right))
    start = next((i for i in range(shorter) if wrong[i] != right[i]), shorter)
    tail, meant = wrong[start:], right[start:]
    return tail[1:] == meant[1:] or tail[1:] == meant or tail == meant[1:] or tail == meant[1:2] + meant[:1] + meant[2:]
