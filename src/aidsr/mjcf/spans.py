"""Comments and the like in a text that need not be XML, found in a time proportional to the text.

A pattern such as `<!--.*?-->` alone looks through the whole rest of the text for each opening that is never closed:
80 kB of them take half a minute.
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
"""What follows an opening, up to the end of the construct."""


def spans(text: str, *openings: str) -> Iterator[tuple[int, int]]:
    """Yield start and end of each construct with one of these openings; one that is never closed is left out."""
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
    """Return a text with spaces in place of these constructs; lines and columns stay what they were."""
    return replaced(text, lambda _, inside: re.sub(r"[^\n]", " ", inside), *openings)


def without(text: str, *openings: str) -> str:
    """Return a text without these constructs."""
    return replaced(text, lambda _, _inside: "", *openings)


def replaced(text: str, replacement: Callable[[int, str], str], *openings: str) -> str:
    """Return a text with each of these constructs replaced.

    Args:
        text: The text.
        replacement: Called with the line in which a construct begins, from 1, and its text.
        openings: Which constructs.
    """
    pieces, end, line = list[str](), 0, 1
    for start, stop in spans(text, *openings):
        line += text.count("\n", end, start)
        pieces += [text[end:start], replacement(line, text[start:stop])]
        line += text.count("\n", start, stop)
        end = stop
    return "".join([*pieces, text[end:]])
