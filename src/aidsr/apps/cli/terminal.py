"""Terminal output. All commands print through this module, so that no name, reply or path can send control codes."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from typing import TextIO

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

_UNSAFE = re.compile(
    "["
    "\x00-\x08\x0b-\x1f\x7f-\x9f"  # control characters except tab and newline: colours, titles, clipboard, overwriting
    "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"  # text direction: can show a name in another order
    "\u2028\u2029"  # line and paragraph separators
    "\ud800-\udfff"  # surrogates (for example undecodable bytes of a file name): cannot be encoded
    "]"
)
_SHOWN = "\ufffd"


def printable(text: str) -> str:
    """Return text with each character that could control a terminal replaced by U+FFFD."""
    return _UNSAFE.sub(_SHOWN, text.replace("\r\n", "\n"))


def write(text: str, *, to: TextIO | None = None) -> None:
    """Write a message to standard output, or to another stream, without control characters."""
    (to or sys.stdout).write(printable(text))


def write_document(text: str) -> None:
    """Write MJCF, JSON or Markdown to standard output: unchanged to a file or pipe, made printable in a terminal."""
    if sys.stdout.isatty():
        write(text)
    else:
        sys.stdout.write(text)


class _SafeConsole(Console):
    """Console that makes all text printable; only rich's own control codes (colours, progress bars) are sent."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield the segments of a renderable with printable text."""
        for text, style, control in super().render(renderable, options):
            yield Segment(text if control else printable(text), style, control)


def make_console(*, to_stderr: bool = False, soft_wrap: bool = False) -> Console:
    """Return a console for standard output or standard error, without automatic highlighting.

    Args:
        to_stderr: Whether to print to standard error.
        soft_wrap: Whether lines are never wrapped at the width of the terminal.
    """
    return _SafeConsole(stderr=to_stderr, highlight=False, soft_wrap=soft_wrap)
