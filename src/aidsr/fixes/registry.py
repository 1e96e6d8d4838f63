"""All fixes, in the order in which they are applied."""

from __future__ import annotations

from typing import Any

from aidsr.fixes import contact, markup, motion, naming, parts, ranges, shapes, strength
from aidsr.fixes.record import EditDocument, Fix

ON_DOCUMENT: tuple[Fix[EditDocument], ...] = (
    *naming.FIXES,
    *shapes.FIXES,
    *ranges.FIXES,
    *contact.FIXES,
    *parts.FIXES,
    *motion.FIXES,
    *strength.FIXES,
)

FIXES: tuple[Fix[Any], ...] = (*markup.FIXES, *ON_DOCUMENT)
