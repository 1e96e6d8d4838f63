"""Check for forbidden content in an untrusted document: anything that opens a file, a network address or a library."""

from __future__ import annotations

import re
from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.mjcf.elements import Element, attributes, elements, load_fault

FORBIDDEN_ELEMENTS = {
    "include": ("opens another file", "put its content here (`aidsr import` does)"),
    "model": ("opens another file", "put its bodies here (`aidsr import` does)"),
    "attach": ("attaches a model from another file", "put its bodies here (`aidsr import` does)"),
    "extension": ("loads a native library", "model the mechanism with joints and tendons"),
    "plugin": ("calls a native library", "model the mechanism with joints and tendons"),
}
"""Forbidden elements: the effect of each, and what to write instead."""
_ATTRIBUTE = re.compile(r"file\w*|(asset|mesh|texture)dir|content_type")
"""Attributes of the schema that name a file, a folder or the type of a file."""


def check_forbidden(root: Element) -> Iterator[Fault]:
    """Yield a fault for each element and attribute that refers to something outside the document."""
    for element in elements(root):
        if element is not root and element.tag in FORBIDDEN_ELEMENTS:
            does, instead = FORBIDDEN_ELEMENTS[element.tag]
            yield load_fault("forbidden", element, f"not allowed, because it {does}", cure=f"remove it; {instead}")
            continue
        for attribute, _ in attributes(element):
            if _ATTRIBUTE.fullmatch(attribute):
                problem = f"attribute '{attribute}' is not allowed, because models here use no files"
                cure = (
                    "remove it and build shapes from primitive geoms; `aidsr import` converts a robot of several files"
                )
                yield load_fault("forbidden", element, problem, cure=cure)
