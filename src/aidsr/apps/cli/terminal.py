"""Text for the terminal. Every command prints through here: no name, reply or path can send control codes."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from typing import TextIO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

_UNSAFE = re.compile(
    "["
    "\x00-\x08\x0b-\x1f\x7f-\x9f"  # control characters but tab and newline: colours, titles, the clipboard, overwriting
    "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"  # the direction of text: shows a name in another order than it has
    "\u2028\u2029"  # separators of lines and paragraphs
    "\ud800-\udfff"  # bytes of a file name that are no text, and halves of characters: cannot be encoded
    "]"
)
_SHOWN = "\ufffd"


def printable(text: str) -> str:
    """Return text in which each character that would control a terminal is replaced by U+FFFD."""
    return _UNSAFE.sub(_SHOWN, text.replace("\r\n", "\n"))


def write(text: str, *, to: TextIO | None = None) -> None:
    """Write a message to standard output, or to another stream, made printable."""
    (to or sys.stdout).write(printable(text))


def write_document(text: str) -> None:
    """Write MJCF, JSON or Markdown to standard output: as it is to a file or pipe, made printable in a terminal."""
    if sys.stdout.isatty():
        write(text)
    else:
        sys.stdout.write(text)


class _SafeConsole(Console):
    """Prints what it is given printable; only rich's own controls, as of colours and progress bars, are sent."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Return the pieces of text that are printed for a renderable."""
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else printable(text), style, control)


def make_console(*, to_stderr: bool = False, soft_wrap: bool = False) -> Console:
    """Return a console for standard output or error that highlights nothing by itself.

    Args:
        to_stderr: Whether it prints to standard error.
        soft_wrap: Whether lines are left whole, however narrow the terminal is.
    """
    return _SafeConsole(stderr=to_stderr, highlight=False, soft_wrap=soft_wrap)
