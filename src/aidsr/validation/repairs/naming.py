"""Repairs of names: of attributes, of classes, of things."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Iterator

from aidsr.mjcf.defaults import default_classes
from aidsr.mjcf.location import Element, attributes, elements
from aidsr.mjcf.names import named, references
from aidsr.mjcf.schema import Grammar, mjcf_grammar
from aidsr.validation.repairs.telling import told

__all__ = ["duplicate_names", "missing_classes", "misspelt_attributes"]


def misspelt_attributes(root: Element) -> Iterator[str]:
    """Rename attributes that no element of MJCF has and that are one slip away from exactly one that fits here.

    A slip is a letter too many, too few, wrong or swapped with its neighbour; letter case, "_" and "-" do not count.
    """
    everywhere = {name for grammar in mjcf_grammar().walk() for name in grammar.attributes}
    yield from _respell(root, mjcf_grammar(), everywhere)


def missing_classes(root: Element) -> Iterator[str]:
    """Drop references to default classes that do not exist: such a class gives nothing.

    A name one slip away from exactly one class means that class.
    """
    classes = default_classes(root)
    for element in elements(root):
        for attribute in ("class", "childclass"):
            name = element.get(attribute, "")
            if not name or name in classes or name == "main" or element.tag == "default":
                continue
            near = _one_slip_away(name, classes)
            if near:
                element.set(attribute, near)
                yield told(element, f"wrote {attribute} '{near}' for '{name}', which does not exist")
            else:
                del element.attrib[attribute]
                yield told(element, f"dropped {attribute} '{name}', which does not exist")


def duplicate_names(root: Element, kept_names: Collection[str] = ()) -> Iterator[str]:
    """Rename things whose name another of their kind bears, where nothing refers to that name.

    Args:
        root: The document.
        kept_names: Names that others outside the document refer to.
    """
    taken: dict[str, set[str]] = defaultdict(set)
    for element, kind in named(root):
        taken[kind].add(element.get("name", ""))
    referred = {(kind, name) for _, kind, name in references(root)}
    seen: Counter[tuple[str, str]] = Counter()
    for element, kind in list(named(root)):
        name = element.get("name", "")
        seen[kind, name] += 1
        if seen[kind, name] == 1 or (kind, name) in referred or name in kept_names or _is_replicated(element):
            continue
        number = seen[kind, name]
        while f"{name}_{number}" in taken[kind] or (kind, f"{name}_{number}") in referred:
            number += 1
        taken[kind].add(f"{name}_{number}")
        sentence = told(element, f"renamed to '{name}_{number}', since another {kind} bears this name")
        element.set("name", f"{name}_{number}")
        yield sentence


def _is_replicated(element: Element) -> bool:
    return next(element.iterancestors("replicate"), None) is not None


def _respell(element: Element, grammar: Grammar, everywhere: Collection[str]) -> Iterator[str]:
    for attribute in [str(name) for name in element.attrib]:
        if attribute in grammar.attributes or attribute in everywhere:
            continue
        meant = _one_slip_away(attribute, grammar.attributes)
        if meant and meant not in element.attrib:
            _rename(element, attribute, meant)
            yield told(element, f"wrote {meant} for {attribute}")
    for child in element:
        inside = grammar.children.get(child.tag) if isinstance(child.tag, str) else None
        if inside is not None:
            yield from _respell(child, inside, everywhere)


def _rename(element: Element, attribute: str, right: str) -> None:
    """Rename an attribute where it stands, so that a reader finds it in its place."""
    written = attributes(element)
    element.attrib.clear()
    for name, value in written:
        element.set(right if name == attribute else name, value)


def _one_slip_away(name: str, right: Collection[str]) -> str:
    """Return the one right name that differs by a slip, or nothing when there is none or more than one."""
    same = [other for other in right if _plain(other) == _plain(name)]
    near = same or [other for other in right if _is_slip(_plain(name), _plain(other))]
    return near[0] if len(near) == 1 else ""


def _plain(name: str) -> str:
    return name.lower().replace("_", "").replace("-", "")


def _is_slip(wrong: str, right: str) -> bool:
    """Whether two names differ by one letter added, left out, replaced or swapped with its neighbour."""
    shorter = min(len(wrong), len(right))
    start = next((i for i in range(shorter) if wrong[i] != right[i]), shorter)
    tail, meant = wrong[start:], right[start:]
    return tail[1:] == meant[1:] or tail[1:] == meant or tail == meant[1:] or tail == meant[1:2] + meant[:1] + meant[2:]
