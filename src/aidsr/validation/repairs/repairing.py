"""`repair`: what others call. Loads no simulator; the work is done in an isolated worker."""

from __future__ import annotations

from collections.abc import Collection

from aidsr.core.artifacts import Repairs
from aidsr.core.errors import IsolationError
from aidsr.sandbox.isolated import isolated

__all__ = ["REPAIRS", "Repaired", "leave_as_written", "repair"]

REPAIRS = (
    "dashes_in_comments",
    "misspelt_attributes",
    "missing_classes",
    "duplicate_names",
    "fromto_without_shape",
    "inherited_fromto",
    "fromto_and_pos",
    "repeated_guides",
    "missing_limit_flags",
    "inverted_ranges",
    "ball_ranges",
    "degrees_in_radians",
    "attached_overlaps",
)
"""Names of all repairs in the order in which they are made."""


class Repaired(Repairs):
    """An MJCF text after its mechanical repairs, and what they were, by their names in `REPAIRS`."""

    mjcf: str
    """The text; the very one that was given when nothing was done."""

    @property
    def repairs(self) -> Repairs:
        """What was done, without the text."""
        return Repairs(notes=self.notes, counts=self.counts)


def repair(mjcf: str, *, only: Collection[str] = REPAIRS, kept_names: Collection[str] = ()) -> Repaired:
    """Put right what has one possible meaning in an MJCF text.

    A text that cannot be read, or that no worker survives, comes back as it was: the validator says what is wrong with
    it.

    Args:
        mjcf: The text, as its author wrote it.
        only: The repairs that may be made, names from `REPAIRS`.
        kept_names: Names that others outside the text refer to, as a robot's functional part; they are not changed.

    Raises:
        ValueError: `only` names a repair that does not exist.
    """
    unknown = set(only) - set(REPAIRS)
    if unknown:
        raise ValueError(f"expected repairs out of {', '.join(REPAIRS)}; found {', '.join(sorted(unknown))}")
    try:
        return repair_in_worker(mjcf, [name for name in REPAIRS if name in only], list(kept_names))
    except IsolationError:
        return Repaired(mjcf=mjcf)


@isolated
def repair_in_worker(text: str, only: list[str], kept_names: list[str]) -> Repaired:
    """Do the work of `repair` in an isolated process."""
    from aidsr.validation.repairs.working import repair_text

    return repair_text(text, only, kept_names)


def leave_as_written(mjcf: str, *, kept_names: Collection[str] = ()) -> Repaired:
    """Repair nothing: what takes the place of `repair` where robots are to be seen as they were written."""
    del kept_names
    return Repaired(mjcf=mjcf)
