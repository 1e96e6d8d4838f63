"""Fixes of a text that is not XML yet."""

from __future__ import annotations

import re

from aidsr.fixes.record import EditText, Fix
from aidsr.mjcf.spans import COMMENT, replaced

_DASHES = re.compile(r"-{2,}|^-|-$")


def dashes_in_comments(text: str) -> tuple[str, list[str]]:
    """Write "=" for the dashes that XML does not allow inside comments.

    Nothing moves: lines and columns stay what they were.

    Source: Extensible Markup Language (XML) 1.0, section 2.5, comments: "--" must not occur, nor "-" before the end.
    """
    notes = []

    def rewrite(line: int, comment: str) -> str:
        before = comment.removeprefix("<!--").removesuffix("-->")
        inside = _DASHES.sub(lambda dashes: "=" * len(dashes[0]), before)
        if inside != before:
            notes.append(f"The comment in line {line}: wrote = for dashes that XML does not allow in comments.")
        return f"<!--{inside}-->"

    return replaced(text, rewrite, COMMENT), notes


FIXES: tuple[Fix[EditText], ...] = (Fix(dashes_in_comments, cures=("xml_syntax",), safe=True),)
