"""Fixes of a text that is not well-formed XML: only errors with a single possible correction.

A text that is cut short, or that lacks a tag which could be in several places, is left to its author.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from aidsr.fixes.record import EditText, Fix
from aidsr.mjcf.schema import childless
from aidsr.mjcf.spans import CDATA, COMMENT, DOCTYPE, INSTRUCTION, blanked, replaced

_DASHES = re.compile(r"-{2,}|^-|-$")
_QUOTED = r"""(?:"[^"<]*+"|'[^'<]*+')"""
_TAG = re.compile(rf"""<[A-Za-z_](?:[^<>"']|{_QUOTED}|<(?=\s))*+>""")
"""A tag from < to >, including its quoted values; it may contain a stray < or &."""
_AMPERSAND = re.compile(r"&(?!(?:amp|lt|gt|quot|apos|#[0-9]{1,7}|#x[0-9A-Fa-f]{1,6});)")
_STRAY = re.compile(r"\s?<(?=\s)")
_NUMBER = r"[-+]?(?:[0-9]++(?:\.[0-9]*+)?|\.[0-9]++)(?:[eE][-+]?[0-9]++)?"
_BARE = re.compile(rf"(?<=\s)([A-Za-z_]\w*+)=({_NUMBER}(?:\s+{_NUMBER})*+|[A-Za-z_]\w*+)(?=\s|/?>)")
"""An attribute value without quotes: numbers up to the next name or the end of the tag, or one word."""
_ATTRIBUTE = re.compile(rf"(?<!\s)\s++([A-Za-z_][\w.:-]*+)\s*+=\s*+({_QUOTED})")
_NAME = re.compile(r"<([\w.:-]++)")
_AFTER_SPACE = re.compile(r"\s*+(\S{0,50})")


def dashes_in_comments(text: str) -> tuple[str, list[str]]:
    """Write "=" for the dashes that XML does not allow inside comments.

    Line and column numbers do not change.

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


def bare_ampersands(text: str) -> tuple[str, list[str]]:
    """Write `&amp;` for an & in a tag that begins no entity of XML."""
    return _in_tags(text, lambda tag, _: _AMPERSAND.sub("&amp;", tag), "wrote &amp; for &")


def stray_brackets(text: str) -> tuple[str, list[str]]:
    """Drop a < that stands in a tag before a space, outside of values: no tag begins with a space."""
    return _in_tags(text, lambda tag, _: tag[0] + _unquoted(tag[1:], _STRAY, ""), "dropped a stray <")


def bare_values(text: str) -> tuple[str, list[str]]:
    """Put a value of numbers or of one word in quotes."""
    return _in_tags(text, lambda tag, _: _unquoted(tag, _BARE, r'\1="\2"'), "put a value in quotes")


def repeated_attributes(text: str) -> tuple[str, list[str]]:
    """Drop an attribute that stands twice in a tag with the same value."""

    def once(tag: str, _: str) -> str:
        seen = set[tuple[str, str]]()

        def rewrite(found: re.Match[str]) -> str:
            said = found[1], found[2][1:-1]
            repeated = said in seen
            seen.add(said)
            return "" if repeated else found[0]

        return _ATTRIBUTE.sub(rewrite, tag)

    return _in_tags(text, once, "dropped an attribute that stood there twice, with one value")


def unclosed_elements(text: str) -> tuple[str, list[str]]:
    """Close an element that holds nothing in MJCF, where neither its tag is closed nor a closing tag follows it."""
    holds_nothing = childless()

    def close(tag: str, follows: str) -> str:
        name = _NAME.match(tag)
        if name is None or name[1] not in holds_nothing or tag.endswith("/>"):
            return tag
        return tag if follows.startswith(f"</{name[1]}") else f"{tag[:-1]}/>"

    return _in_tags(text, close, "closed, since it holds nothing")


def _in_tags(text: str, change: Callable[[str, str], str], done: str) -> tuple[str, list[str]]:
    """Return a text with its tags changed, and a sentence for each changed tag.

    Args:
        text: The text; comments and similar constructs are not changed.
        change: Function of a tag and of the first word after it that returns the new tag.
        done: Description of the change for the sentence.
    """
    pieces, notes, end = list[str](), list[str](), 0
    for found in _TAG.finditer(blanked(text, COMMENT, CDATA, INSTRUCTION, DOCTYPE)):
        follows = _AFTER_SPACE.match(text, found.end())
        tag = text[found.start() : found.end()]
        changed = change(tag, follows[1] if follows else "")
        if changed != tag:
            line, name = text.count("\n", 0, found.start()) + 1, _NAME.match(tag)
            notes.append(f"<{name[1] if name else ''}> in line {line}: {done}.")
            pieces += [text[end : found.start()], changed]
            end = found.end()
    return "".join([*pieces, text[end:]]), notes


def _unquoted(tag: str, pattern: re.Pattern[str], new: str) -> str:
    """Return a tag with a pattern replaced outside of quoted values."""
    parts = re.split(f"({_QUOTED})", tag)
    return "".join(part if k % 2 else pattern.sub(new, part) for k, part in enumerate(parts))


FIXES: tuple[Fix[EditText], ...] = tuple(
    Fix(each, cures=("xml_syntax",), safe=True)
    for each in (
        dashes_in_comments,
        bare_ampersands,
        stray_brackets,
        bare_values,
        repeated_attributes,
        unclosed_elements,
    )
)
"""Fixes in the order in which they are applied, each to the result of the one before, until the text can be parsed. If
it never can, it stays unchanged."""
