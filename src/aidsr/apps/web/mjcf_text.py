"""MJCF as HTML: highlighted, with line numbers, marks and differences. All text of the document is escaped."""

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
"""Tokens to highlight. Matching takes time proportional to the length of the text, whatever a model wrote: no character
is scanned from many start positions."""
_CLASSES = {"comment": "c", "tag": "t", "name": "a", "value": "v"}
_MOST_LINES = 6000
"""Maximum number of lines shown. Our choice: several times what a robot with many segments takes."""
_CONTEXT_LINES = 3


def highlighted(mjcf: str, marks: Mapping[int, str] | None = None) -> str:
    """Return a text as HTML with line numbers.

    Args:
        mjcf: MJCF text.
        marks: Notes on lines, by line number from 1.
    """
    marks = marks or {}
    rows = [_row(line, str(number), "mark", marks.get(number, "")) for number, line in _lines(mjcf)]
    return "".join(rows)


def difference(before: str, after: str) -> str:
    """Return the differences between two texts as HTML, with a few lines of context; empty where there are none."""
    rows = []
    changed = difflib.unified_diff(before.splitlines(), after.splitlines(), n=_CONTEXT_LINES, lineterm="")
    for line in itertools.islice(changed, 2, None):  # the first two lines are file names
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
