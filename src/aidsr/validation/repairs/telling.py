"""How a repair is told: which element, where, what was done."""

from __future__ import annotations

from aidsr.mjcf.location import Element, line_of, words

__all__ = ["told"]


def told(element: Element, done: str) -> str:
    """Return a sentence on what was done to an element."""
    line = line_of(element)
    return f"{words(element)}{f' in line {line}' if line else ''}: {done}."
