"""The repairs inside the worker: text in, text and notes out."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from functools import partial

from lxml import etree

from aidsr.core.errors import MjcfError
from aidsr.mjcf.location import Element
from aidsr.mjcf.read import Document, check_safety, parse_document
from aidsr.validation.repairs import attachment, markup, naming, ranges, shapes
from aidsr.validation.repairs.repairing import Repaired

__all__ = ["repair_text"]

_ON_DOCUMENT: dict[str, Callable[[Element], Iterator[str]]] = {
    "misspelt_attributes": naming.misspelt_attributes,
    "missing_classes": naming.missing_classes,
    "fromto_without_shape": shapes.fromto_without_shape,
    "inherited_fromto": shapes.inherited_fromto,
    "fromto_and_pos": shapes.fromto_and_pos,
    "repeated_guides": shapes.repeated_guides,
    "missing_limit_flags": ranges.missing_limit_flags,
    "inverted_ranges": ranges.inverted_ranges,
    "ball_ranges": ranges.ball_ranges,
    "degrees_in_radians": ranges.degrees_in_radians,
    "attached_overlaps": attachment.attached_overlaps,
}
"""Each changes the document it is given and yields a sentence for each change."""


def repair_text(written: str, only: Sequence[str], kept_names: Collection[str]) -> Repaired:
    """Do the work of `aidsr.validation.repairs.repair`."""
    text = written
    done: dict[str, list[str]] = {}
    document = _parsed(text)
    if document is None and "dashes_in_comments" in only:
        text, notes = markup.without_dashes_in_comments(text)
        document = _parsed(text)
        if document is None:
            return Repaired(mjcf=written)
        done["dashes_in_comments"] = notes
    if document is None or check_safety(document):
        return Repaired(mjcf=written)
    changes = _ON_DOCUMENT | {"duplicate_names": partial(naming.duplicate_names, kept_names=frozenset(kept_names))}
    changed = {name: list(changes[name](document.root)) for name in only if name in changes}
    if any(changed.values()):
        text = etree.tostring(document.root.getroottree(), encoding="unicode")
    done |= {name: notes for name, notes in changed.items() if notes}
    return Repaired(
        mjcf=text,
        notes=tuple(note for notes in done.values() for note in notes),
        counts={name: len(notes) for name, notes in done.items()},
    )


def _parsed(text: str) -> Document | None:
    try:
        return parse_document(text)
    except MjcfError:
        return None
