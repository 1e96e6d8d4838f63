"""The grammar of MJCF, as the installed MuJoCo prints it: which element may stand where, with which attributes."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache

_ROW = re.compile(
    r'padding-left:(?P<indent>\d+)"[^>]*class="el">(?P<name>[^<]*)</td>\s*'
    r'<td class="ty">(?P<times>.)</td>\s*<td class="at">(?P<attributes>.*?)</td>',
    re.DOTALL,
)
_NO_ATTRIBUTES = re.compile(r"<span.*")
_FIRST_INDENT, _INDENT = 5, 15

_ORIENTATION = frozenset({"quat", "axisangle", "xyaxes", "zaxis", "euler"})
_LIKE_BODY = {
    "frame": frozenset({"name", "childclass", "pos", "scale", "scaling", "massscale"}) | _ORIENTATION,
    "replicate": frozenset({"count", "offset", "euler", "sep", "childclass"}),
}
"""MuJoCo lets these stand wherever a body may and ignores attributes of theirs that it does not know, so they are the
one part of the grammar that has to be written down. Source: MuJoCo XML reference, "frame", "replicate", version 3.17.
"""


@dataclass(frozen=True, eq=False)
class Grammar:
    """What one element may hold."""

    name: str
    once: bool
    """Whether it may stand at most once in its parent."""
    attributes: frozenset[str]
    children: dict[str, Grammar] = field(default_factory=dict)

    def walk(self) -> Iterator[Grammar]:
        """Yield this grammar and that of everything that can stand inside, each once."""
        seen: set[Grammar] = set()
        waiting = [self]
        while waiting:
            grammar = waiting.pop()
            if grammar not in seen:
                seen.add(grammar)
                waiting.extend(grammar.children.values())
                yield grammar


@cache
def mjcf_grammar() -> Grammar:
    """Return the grammar of a whole document, from its root <mujoco>.

    Source: `mujoco.mj_printSchema` of the installed version.
    """
    import mujoco

    path: list[Grammar] = []
    for row in _ROW.finditer(mujoco.mj_printSchema(True, True)):
        del path[(int(row["indent"]) - _FIRST_INDENT) // _INDENT :]
        attributes = frozenset(_NO_ATTRIBUTES.sub("", row["attributes"]).split())
        grammar = Grammar(row["name"].replace("(world)", ""), row["times"] in "!?", attributes)
        if path:
            path[-1].children[grammar.name] = grammar
        if row["times"] == "R":
            grammar.children[grammar.name] = grammar
        path.append(grammar)
    root = path[0]
    body = root.children.pop("body")
    for name, attributes in _LIKE_BODY.items():
        body.children[name] = Grammar(name, once=False, attributes=attributes, children=body.children)
    root.children["worldbody"] = Grammar("worldbody", once=False, attributes=body.attributes, children=body.children)
    return root


@cache
def actuator_elements() -> tuple[str, ...]:
    """Return the elements that describe an actuator, sorted, without those of plugins."""
    return tuple(sorted(mjcf_grammar().children["actuator"].children.keys() - {"plugin"}))


@cache
def range_flags() -> dict[tuple[str, str], str]:
    """Return which attribute says whether a range holds, by element and range: limited for the range of a joint."""
    return {
        (grammar.name, name): flag
        for grammar in mjcf_grammar().walk()
        for name in grammar.attributes
        if name.endswith("range") and (flag := name.removesuffix("range") + "limited") in grammar.attributes
    }
