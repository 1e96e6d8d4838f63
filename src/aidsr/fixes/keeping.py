"""Application of a fix that leaves alone the parts of a robot that should be kept."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy

from aidsr.core.artifacts import Keep
from aidsr.fixes.record import EditDocument, Fix, Request
from aidsr.mjcf.elements import Element
from aidsr.mjcf.kept_parts import changes_between, parts_in


class Keeping:
    """Applies fixes to a document, and takes back those that change a part that should be kept."""

    def __init__(self, root: Element, keep: Sequence[Keep]) -> None:
        """Make one for a document.

        Args:
            root: Root element of the document, which is changed in place.
            keep: Parts that should not change; those that the document does not have are ignored.
        """
        self._root = root
        self._keep = parts_in(root, keep)
        self._left_out: dict[str, str] = {}

    @property
    def left_out(self) -> tuple[str, ...]:
        """One sentence for each fix that was taken back."""
        return tuple(self._left_out.values())

    def apply(self, fix: Fix[EditDocument], request: Request) -> list[str]:
        """Apply a fix and return its notes; empty if it changed nothing, or was taken back.

        A fix is taken back as a whole, because its changes of several elements may depend on each other.

        Args:
            fix: The fix.
            request: Its argument.
        """
        if not self._keep:
            return list(fix.apply(self._root, request))
        before = deepcopy(self._root)
        notes = list(fix.apply(self._root, request))
        changes = changes_between(before, self._root, self._keep) if notes else []
        if not changes:
            return notes
        self._left_out[fix.name] = f"Left out {fix.name}, which would change a part to keep: {changes[0]}"
        _restore(self._root, before)
        return []


def _restore(root: Element, before: Element) -> None:
    """Give a root element the attributes and children of its earlier copy; what stands around it stays."""
    tail = root.tail
    root.clear()
    root.attrib.update(before.attrib)
    root.text, root.tail = before.text, tail
    root.extend(list(before))
