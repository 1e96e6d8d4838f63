"""The record of one fix, what it is given, and the result of fixing."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from aidsr.core.artifacts import Fault, Repairs
from aidsr.mjcf.edit import without_prefix
from aidsr.mjcf.elements import Element, describe, line_of


@dataclass(frozen=True)
class Request:
    """What a fix is asked for.

    Attributes:
        fault: The fault to cure, with the names of all faults of its code; None where all safe fixes are applied.
        kept_names: Names that others outside the document refer to, which safe fixes do not change.
    """

    fault: Fault | None = None
    kept_names: frozenset[str] = frozenset()

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the fault, as the robot's own document has them."""
        return tuple(map(without_prefix, self.fault.names)) if self.fault else ()


EditDocument = Callable[[Element, Request], Iterator[str]]
"""Changes a document in place and yields a sentence for each change; nothing where there is nothing to do."""

EditText = Callable[[str], tuple[str, list[str]]]
"""Returns a text changed before it is parsed, and a sentence for each change."""

Edit = TypeVar("Edit", bound=Callable[..., Any])


@dataclass(frozen=True)
class Fix(Generic[Edit]):
    """One way to change a document so that a fault is gone.

    Attributes:
        apply: Makes the change.
        cures: Codes of the faults that go; a code with several fixes tries them in the order of `FIXES`.
        safe: Whether the document can mean only one thing, so that the fix may be applied without confirmation.
    """

    apply: Edit
    cures: tuple[str, ...]
    safe: bool = False

    @property
    def name(self) -> str:
        """The name by which it is chosen and counted."""
        return self.apply.__name__

    @property
    def doc(self) -> str:
        """What it does, in a sentence."""
        return " ".join((inspect.getdoc(self.apply) or "").partition("\n\n")[0].split())


class FixResult(Repairs):
    """An MJCF text after its fixes; notes and counts say what they were, counted by the names of the fixes."""

    mjcf: str
    """The text; the very one that was given when nothing was done."""
    unfixed: tuple[str, ...] = ()
    """Codes of the faults that no fix changed anything about."""

    @property
    def repairs(self) -> Repairs:
        """What was done, without the text."""
        return Repairs(notes=self.notes, counts=self.counts)


def note(element: Element, done: str) -> str:
    """Return a sentence on what was done to an element: which, in which line, what."""
    line = line_of(element)
    return f"{describe(element)}{f' in line {line}' if line else ''}: {done}."
