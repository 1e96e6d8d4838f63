"""What kind of job an objective speaks of."""

from __future__ import annotations

import re
from typing import Literal

from aidsr.core.artifacts import BodySummary, Brief

__all__ = ["Kind", "first_family", "kind_of"]

Kind = Literal["reach", "brush", "conform", "insert", "grasp", "pull", "crawl", "squeeze"]

_WORDS: dict[Kind, str] = {
    "conform": "(?:lie|lay|drape|rest) (?:along|over|against)|conform|adapt to|rounded|curved",
    "grasp": "grasp|grip|pick|hold|catch|lift|grab|carry|retain",
    "pull": "open (?:it|the|a|all|each|one|two|three|both)\\b|pull|hook|drawer|handle|unlatch",
    "squeeze": "tunnel|squeeze|narrow|duct|through a pipe",
    "crawl": "crawl|walk|climb|locomot|forward|travel|cross|stair|roll|traverse|get past",
    "insert": "insert|pipe|tube|deep|borehole",
    "brush": "brush|wipe|sweep|scrub|polish",
    "reach": "reach|press|push|touch|point|follow|surface|button",
}
"""Beginnings of words that speak for a kind of job. Our choice, from the objectives of the 14 benchmark tasks."""

_FIRST: tuple[tuple[Kind, str, str, str], ...] = (
    ("crawl", "stair|steps?\\b|climb", "crawler", "legs are set down higher up, where a hoop rolls against a riser"),
    ("crawl", "gap\\b|ditch|trench", "ring", "a hoop rolls over an opening narrower than itself, which legs step into"),
    ("crawl", "obstacle|between|around|avoid", "crawler", "legs steer round what stands in the way, and a hoop cannot"),
    ("brush", "", "tentacle", "one beside the surface presses as hard as its cable pulls, however far away that is"),
    ("pull", "", "arm", "a short stiff hook holds a bar and comes off it again"),
    ("squeeze", "", "ring", "a small hoop is several times as fast as a worm"),
)
"""Which family of a kind is proposed first where the objective has one of these words, and why. Our choice: what the
families learned of the benchmark's tasks (benchmarks/builtin/results-60000.md and docs/builtin.md)."""

_GRASPABLE_M = 0.06
"""A free body no wider than twice this is taken for something to grasp. Our choice: what a hand of 0.2 m closes on."""


def kind_of(brief: Brief) -> tuple[Kind, str]:
    """Return the kind of job and what made the rules think so.

    A free base means a body that moves itself, whatever else the words say, and one that is held never does. Without a
    known word the environment decides, and the sentence says that a default was taken.
    """
    found = {kind: _spoken(words, brief.objective) for kind, words in _WORDS.items()}
    if brief.base == "free":
        because = "the robot's base is free, so the body has to carry itself"
        if found["squeeze"]:
            return "squeeze", f"{because}, and the objective speaks of {', '.join(found['squeeze'])}"
        return "crawl", because
    if brief.base != "any":
        found = {kind: words for kind, words in found.items() if kind not in ("crawl", "squeeze")}
    best = max(found, key=lambda kind: len(found[kind]))
    if found[best]:
        return best, f"the objective speaks of {', '.join(found[best])}"
    return _default(brief)


def first_family(kind: Kind, objective: str) -> tuple[str, str] | None:
    """Return the family to propose first, and why; None where none of a kind's families is known to be better."""
    for of_kind, words, family, because in _FIRST:
        if of_kind == kind and (not words or _spoken(words, objective)):
            return family, because
    return None


def _default(brief: Brief) -> tuple[Kind, str]:
    unknown = "the objective names no action known to the rules"
    loose = [body for body in brief.summary.bodies if body.free and _widest(body) <= _GRASPABLE_M]
    if loose:
        return "grasp", f"{unknown}; {loose[0].name} lies free and fits a hand"
    if brief.summary.mounts:
        return "reach", f"{unknown}; there is a mount, so an arm that reaches is assumed"
    return "crawl", f"{unknown} and there is no mount; a body that moves itself is assumed"


def _spoken(words: str, objective: str) -> list[str]:
    """Return the words of a kind that an objective uses, each once."""
    return list(dict.fromkeys(re.findall(rf"\b({words})", objective.lower())))


def _widest(body: BodySummary) -> float:
    return max((max(geom.size_m) for geom in body.geoms), default=0.0)
