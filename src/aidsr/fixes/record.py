"""The record of one fix, its request, and the result of fixing."""

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
    """Argument of a fix.

    Attributes:
        fault: Fault to cure, with the names of all faults of its code; None if all safe fixes are applied.
        kept_names: Names that are referred to outside the document; safe fixes do not change them.
    """

    fault: Fault | None = None
    kept_names: frozenset[str] = frozenset()

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the fault as they are in the robot's own document, without the prefix of a scene."""
        return tuple(map(without_prefix, self.fault.names)) if self.fault else ()


EditDocument = Callable[[Element, Request], Iterator[str]]
"""Function that changes a document in place and yields a sentence for each change; nothing if it changes nothing."""

EditText = Callable[[str], tuple[str, list[str]]]
"""Function that changes a text before it is parsed; returns the new text and a sentence for each change."""

Edit = TypeVar("Edit", bound=Callable[..., Any])


@dataclass(frozen=True)
class Fix(Generic[Edit]):
    """One way to change a document so that a fault disappears.

    Attributes:
        apply: Function that makes the change. The first paragraph of its docstring describes the fix in the docs.
        cures: Codes of the faults that it cures; several fixes for a code are tried in the order of `FIXES`.
        safe: Whether the document has only one possible meaning, so that the fix may be applied without confirmation.
    """

    apply: Edit
    cures: tuple[str, ...]
    safe: bool = False

    @property
    def name(self) -> str:
        """Name by which the fix is selected and counted."""
        return self.apply.__name__

    @property
    def doc(self) -> str:
        """Description of the fix in a sentence."""
        return " ".join((inspect.getdoc(self.apply) or "").partition("\n\n")[0].split())


class FixResult(Repairs):
    """An MJCF text after fixing; `notes` describe the changes, and `counts` has their number by name of the fix."""

    mjcf: str
    """The fixed text; identical to the given text if nothing was changed."""
    unfixed: tuple[str, ...] = ()
    """Codes of the faults for which no fix changed anything."""

    @property
    def repairs(self) -> Repairs:
        """Notes and counts of the changes, without the text."""
        return Repairs(notes=self.notes, counts=self.counts)


def note(element: Element, done: str) -> str:
    """Return a sentence about a change of an element, with its description and line.

    Args:
        element: Changed element.
        done: Description of the change.
    """
    line = line_of(element)
    return f"{describe(element)}{f' in line {line}' if line else ''}: {done}."
