"""Suggestions of known names for misspelt ones."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable

_LONGEST = 100
"""Maximum characters of a compared name; the time of a comparison grows with their square. Our choice."""
_MOST_COMPARED = 2000
"""Maximum number of names that a name is compared with. Our choice: as many as a large robot has."""


def closest_name(name: str, known: Iterable[str], *, cutoff: float = 0.6) -> str:
    """Return the known name most similar to a name, for "did you mean"; "" if none is similar; see `close_names`."""
    return next(iter(close_names(name, known, most=1, cutoff=cutoff)), "")


def close_names(name: str, known: Iterable[str], *, most: int, cutoff: float = 0.6) -> list[str]:
    """Return the known names that are similar to a name, the most similar first.

    Args:
        name: Name as written; above 100 characters, nothing is returned.
        known: Names that could have been meant.
        most: Maximum number of names to return.
        cutoff: Least similarity, 0 to 1, as measured by `difflib`.
    """
    if len(name) > _LONGEST:
        return []
    compared = sorted({other for other in known if len(other) <= _LONGEST})[:_MOST_COMPARED]
    return difflib.get_close_matches(name, compared, n=most, cutoff=cutoff)


def only_close_name(name: str, known: Iterable[str], *, cutoff: float = 0.6) -> str:
    """Return the known name most similar to a name; "" if none is similar, or two are equally similar."""
    found = close_names(name, known, most=2, cutoff=cutoff)
    likeness = [difflib.SequenceMatcher(None, name, other).ratio() for other in found]
    return found[0] if found and (len(found) == 1 or likeness[0] > likeness[1]) else ""


def one_slip_away(name: str, known: Collection[str]) -> str:
    """Return the only known name that differs by one typing error; "" if there is none, or more than one.

    A typing error is one letter too many, too few or wrong, or two neighbouring letters swapped. Letter case, "_" and
    "-" are ignored.
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
