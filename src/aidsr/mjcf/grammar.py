"""Elements and attributes that MJCF does not know where they stand, with the nearest right name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator

from aidsr.core.artifacts import Fault
from aidsr.mjcf.forbidden import FORBIDDEN_ELEMENTS
from aidsr.mjcf.location import Element, join, load_fault
from aidsr.mjcf.schema import Grammar, mjcf_grammar


def check_grammar(root: Element) -> Iterator[Fault]:
    """Yield a fault for each element, attribute and repetition that the grammar of MJCF does not allow."""
    yield from _check(root, mjcf_grammar())


def _check(element: Element, grammar: Grammar) -> Iterator[Fault]:
    for attribute in element.attrib:
        if attribute not in grammar.attributes:
            yield _unknown_attribute(element, str(attribute), grammar)
    seen: set[str] = set()
    for child in element:
        if not isinstance(child.tag, str) or child.tag in FORBIDDEN_ELEMENTS:
            continue
        inside = grammar.children.get(child.tag)
        if inside is None:
            yield _unknown_element(child, grammar)
            continue
        if inside.once and child.tag in seen:
            yield load_fault("bad_value", child, f"stands more than once in <{element.tag}>", cure="keep one of them")
        seen.add(child.tag)
        yield from _check(child, inside)


def _unknown_attribute(element: Element, attribute: str, grammar: Grammar) -> Fault:
    everywhere = {name for other in mjcf_grammar().walk() for name in other.attributes}
    near = _nearest(attribute, grammar.attributes)
    elsewhere = _nearest(attribute, everywhere)
    if near and attribute not in everywhere:
        cure = f"did you mean '{near}'?"
    elif elsewhere:
        homes = sorted({other.name for other in mjcf_grammar().walk() if elsewhere in other.attributes})
        cure = f"'{elsewhere}' belongs to {_tags(homes)}"
    else:
        cure = "remove it; no element of MJCF has such an attribute"
    return load_fault("unknown_attribute", element, f"has no attribute '{attribute}'", cure=cure)


def _unknown_element(element: Element, grammar: Grammar) -> Fault:
    tag = str(element.tag)
    homes = sorted({other.name for other in mjcf_grammar().walk() if tag in other.children})
    if homes:
        return load_fault(
            "unknown_element", element, f"cannot stand in <{grammar.name}>", cure=f"it belongs in {_tags(homes)}"
        )
    near = _nearest(tag, grammar.children) or _nearest(tag, {other.name for other in mjcf_grammar().walk()})
    cure = f"did you mean <{near}>?" if near else f"<{grammar.name}> may hold {_tags(sorted(grammar.children))}"
    return load_fault("unknown_element", element, "is not an element of MJCF", cure=cure)


def _nearest(name: str, right: Iterable[str]) -> str:
    """Return the right name that a misspelt one most likely stands for, or nothing.

    Our choice of 0.75: it joins ctrl_range to ctrlrange and stifness to stiffness, and keeps mass and class apart.
    """
    found = difflib.get_close_matches(name.lower().replace("_", ""), sorted(right), n=1, cutoff=0.75)
    return found[0] if found else ""


def _tags(names: list[str]) -> str:
    return join(f"<{name}>" for name in names)
