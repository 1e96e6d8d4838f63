"""Search for comments, CDATA and similar constructs in a text that may not be valid XML, in linear time.

A simple pattern such as `<!--.*?-->` searches the whole rest of the text for each opening that is never closed: 80 kB
of such openings take half a minute.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

COMMENT, CDATA, INSTRUCTION, DOCTYPE = "<!--", "<![CDATA[", "<?", "<!DOCTYPE"
_RESTS = {
    COMMENT: re.compile(r".*?-->", re.DOTALL),
    CDATA: re.compile(r".*?\]\]>", re.DOTALL),
    INSTRUCTION: re.compile(r".*?\?>", re.DOTALL),
    DOCTYPE: re.compile(r"[^\[>]*+(?:>|\[.*?\]\s*+>)", re.DOTALL),
}
"""Patterns of the text from after the opening to the end of the construct."""


def spans(text: str, *openings: str) -> Iterator[tuple[int, int]]:
    """Yield start and end of each construct with one of these openings; constructs that are not closed are skipped."""
    wanted = re.compile("|".join(map(re.escape, openings)))
    unclosed = set[str]()
    position = 0
    while opening := wanted.search(text, position):
        position = opening.end()
        rest = None if opening[0] in unclosed else _RESTS[opening[0]].match(text, position)
        if rest is None:
            unclosed.add(opening[0])
        else:
            position = rest.end()
            yield opening.start(), position


def blanked(text: str, *openings: str) -> str:
    """Return a text with these constructs replaced by spaces, so that line and column numbers do not change."""
    return replaced(text, lambda _, inside: re.sub(r"[^\n]", " ", inside), *openings)


def without(text: str, *openings: str) -> str:
    """Return a text without these constructs."""
    return replaced(text, lambda _, _inside: "", *openings)


def replaced(text: str, replacement: Callable[[int, str], str], *openings: str) -> str:
    """Return a text with each of these constructs replaced.

    Args:
        text: Text to search.
        replacement: Function of the construct's first line number, from 1, and its text that returns the new text.
        openings: Openings of the constructs to replace.
    """
    pieces, end, line = list[str](), 0, 1
    for start, stop in spans(text, *openings):
        line += text.count("\n", end, start)
        pieces += [text[end:start], replacement(line, text[start:stop])]
        line += text.count("\n", start, stop)
        end = stop
    return "".join([*pieces, text[end:]])
