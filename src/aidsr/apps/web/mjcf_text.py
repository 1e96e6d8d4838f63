"""MJCF as HTML: highlighted, with line numbers, marks and differences. Everything that was in the text is escaped."""

from __future__ import annotations

import difflib
import itertools
import re
from collections.abc import Iterator, Mapping
from html import escape

_TOKEN = re.compile(
    r"(?P<comment><!--(?:(?!<!--).)*?-->)|(?P<tag></?[\w:.-]+|/?>)|(?P<name>(?<![\w:.-])[\w:.-]++(?==))"
    r"|(?P<value>\"[^\"]*\"|'[^']*')",
    re.DOTALL,
)
"""Takes a time proportional to the text, whatever a model wrote: no character is looked at from many starts."""
_CLASSES = {"comment": "c", "tag": "t", "name": "a", "value": "v"}
_MOST_LINES = 6000
"""Lines that are shown. Our choice: several times what a robot of many segments takes."""
_CONTEXT_LINES = 3


def highlighted(mjcf: str, marks: Mapping[int, str] | None = None) -> str:
    """Return a text with line numbers.

    Args:
        mjcf: The text.
        marks: Notes on lines, by number from 1.
    """
    marks = marks or {}
    rows = [_row(line, str(number), "mark", marks.get(number, "")) for number, line in _lines(mjcf)]
    return "".join(rows)


def difference(before: str, after: str) -> str:
    """Return what differs between two texts, with a few lines around it; empty where nothing does."""
    rows = []
    changed = difflib.unified_diff(before.splitlines(), after.splitlines(), n=_CONTEXT_LINES, lineterm="")
    for line in itertools.islice(changed, 2, None):  # what comes first are names of files
        if line.startswith("@@"):
            rows.append(f'<div class="hunk">{escape(line)}</div>')
        else:
            kind = {"+": "plus", "-": "minus"}.get(line[0], "")
            rows.append(f'<div class="{kind}"><span class="ln">{escape(line[0])}</span>{_coloured(line[1:])}</div>')
        if len(rows) > _MOST_LINES:
            rows.append('<div class="hunk">… truncated</div>')
            break
    return "".join(rows)


def _lines(mjcf: str) -> Iterator[tuple[int, str]]:
    for number, line in enumerate(mjcf.splitlines(), 1):
        if number > _MOST_LINES:
            yield number, f"… {len(mjcf.splitlines()) - _MOST_LINES} more lines"
            return
        yield number, line


def _row(line: str, number: str, kind: str, note: str) -> str:
    marked = f' class="{kind}" title="{escape(note)}"' if note else ""
    return f'<div{marked}><span class="ln">{number}</span>{_coloured(line)}</div>'


def _coloured(line: str) -> str:
    """Return one line as HTML; each piece of it is escaped separately."""
    pieces, end = [], 0
    for found in _TOKEN.finditer(line):
        kind = _CLASSES[found.lastgroup or "value"]
        pieces.append(escape(line[end : found.start()]))
        pieces.append(f'<span class="{kind}">{escape(found.group())}</span>')
        end = found.end()
    pieces.append(escape(line[end:]))
    return "".join(pieces) or " "
