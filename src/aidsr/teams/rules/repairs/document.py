"""Repairs of the document itself: names and attributes that MJCF does not know, where there is no doubt."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from aidsr.core.artifacts import Fault
from aidsr.mjcf.location import line_of
from aidsr.mjcf.names import REFERENCES, duplicate_names
from aidsr.mjcf.schema import Grammar, mjcf_grammar
from aidsr.teams.rules.edit import Element

__all__ = ["correct_attributes", "correct_references", "drop_contradictions", "rename_duplicates"]

_SURE = 0.8
"""Likeness from which a name is taken for a misspelt one. Our choice: one wrong letter in six."""

_OPTIONAL = ("sensor", "contact", "equality")
"""Sections whose entries a robot can do without."""


def _nearest(name: str, right: Iterable[str]) -> str | None:
    """Return the one right name a misspelt one stands for; None where there is none, or more than one is as near."""
    found = difflib.get_close_matches(name, sorted(set(right)), n=2, cutoff=_SURE)
    likeness = [difflib.SequenceMatcher(None, name, other).ratio() for other in found]
    return found[0] if found and (len(found) == 1 or likeness[0] > likeness[1]) else None


def correct_attributes(root: Element, fault: Fault) -> str | None:
    """Spell attributes right where the right one is plain, and drop those MJCF does not have."""
    del fault
    done: list[str] = []
    _correct(root, mjcf_grammar(), done)
    return ", ".join(dict.fromkeys(done)) or None


def _correct(element: Element, grammar: Grammar, done: list[str]) -> None:
    for attribute in [str(name) for name in element.attrib if name not in grammar.attributes]:
        value = element.attrib.pop(attribute)
        right = _nearest(attribute.lower().replace("_", ""), grammar.attributes)
        if right and right not in element.attrib:
            element.set(right, str(value))
        done.append(f"{attribute} -> {right}" if right else f"dropped {attribute} of <{element.tag}>")
    for child in element:
        inside = grammar.children.get(child.tag) if isinstance(child.tag, str) else None
        if inside is not None:
            _correct(child, inside, done)


def correct_references(root: Element, fault: Fault) -> str | None:
    """Point references to the one name they nearly are; drop sensors, excludes and equalities that name nothing."""
    done = []
    known = {str(item.get("name")) for item in root.iter() if isinstance(item.tag, str) and item.get("name")}
    classes = {str(item.get("class")) for item in root.iter("default") if item.get("class")}
    for item in [item for item in root.iter() if isinstance(item.tag, str)]:
        for attribute in [str(name) for name in item.attrib if name in (*REFERENCES, "objname", "refname")]:
            name = str(item.get(attribute))
            if name not in fault.names or name in (classes if attribute in ("class", "childclass") else known):
                continue
            right = _nearest(name, classes if attribute in ("class", "childclass") else known)
            parent = item.getparent()
            if right:
                item.set(attribute, right)
                done.append(f"{name} -> {right}")
            elif attribute in ("class", "childclass", "material"):
                item.attrib.pop(attribute)
                done.append(f"dropped the {attribute} {name}")
            elif parent is not None and parent.tag in _OPTIONAL:
                parent.remove(item)
                done.append(f"dropped the {item.tag} of {name}")
                break
    return ", ".join(dict.fromkeys(done)) or None


def rename_duplicates(root: Element, fault: Fault) -> str | None:
    """Give the second of two things of one name another; references keep meaning the first."""
    del fault
    lines = {found.line for found in duplicate_names(root)}
    named = [item for item in root.iter() if isinstance(item.tag, str) and item.get("name")]
    repeated = [item for item in named if line_of(item) in lines]
    for number, item in enumerate(repeated, start=2):
        item.set("name", f"{item.get('name')}_{number}")
    return f"renamed {len(repeated)} repeated names" if repeated else None


def drop_contradictions(root: Element, fault: Fault) -> str | None:
    """Drop what does not fit a shape: fromto where there is a pos, or on a shape that has no ends."""
    del fault
    changed = 0
    for item in root.iter("geom", "site"):
        ends = item.get("type") in ("capsule", "cylinder", "box", "ellipsoid")
        if item.get("fromto") and item.get("pos"):
            item.attrib.pop("pos")
            changed += 1
        if item.get("fromto") and item.get("type") and not ends:
            item.attrib.pop("fromto")
            changed += 1
        orientations = [name for name in ("quat", "axisangle", "xyaxes", "zaxis", "euler") if item.get(name)]
        for name in orientations[1:]:
            item.attrib.pop(name)
            changed += 1
    return f"dropped {changed} attributes that contradict others" if changed else None
