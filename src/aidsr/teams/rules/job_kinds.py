"""The kinds of job that the rules know, one record each, and which of them an objective describes."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from aidsr.core.artifacts import BodySummary, Brief

JobKindName = Literal["reach", "brush", "conform", "insert", "grasp", "pull", "crawl", "squeeze"]


@dataclass(frozen=True)
class JobKind:
    """One kind of job."""

    words: str
    """Regular expression of word beginnings that indicate it. Our choice, from the objectives of the 14 benchmark
    tasks."""
    demand: str
    """What the job demands of a body, as a clause that concepts quote."""


JOB_KINDS: dict[JobKindName, JobKind] = {
    "conform": JobKind(
        "(?:lie|lay|drape|rest) (?:along|over|against)|conform|adapt to|rounded|curved",
        "Half the body has to lie along the surface, so it has to bend towards it and back again on the way",
    ),
    "grasp": JobKind(
        "grasp|grip|pick|hold|catch|lift|grab|carry|retain",
        "An object has to be enclosed from several sides and kept while the mount moves",
    ),
    "pull": JobKind(
        "open (?:it|the|a|all|each|one|two|three|both)\\b|pull|hook|drawer|handle|unlatch",
        "Something has to be hooked or held behind its handle, because friction alone would slip, and drawn back",
    ),
    "squeeze": JobKind(
        "tunnel|squeeze|narrow|duct|through a pipe",
        "The body has to carry and move itself and stay narrow and low",
    ),
    "crawl": JobKind(
        "crawl|walk|climb|locomot|forward|travel|cross|stair|roll|traverse|get past",
        "The body has to carry and move itself on the ground, with the same friction in every direction",
    ),
    "insert": JobKind(
        "insert|pipe|tube|deep|borehole",
        "A slender body has to go in lengthwise and give way where the way bends",
    ),
    "brush": JobKind(
        "brush|wipe|sweep|scrub|polish",
        "The functional part has to be led over a surface and press on it, neither too little nor too much",
    ),
    "reach": JobKind(
        "reach|press|push|touch|point|follow|surface|button",
        "The functional part has to be brought to a place beside the mount and press there",
    ),
}
"""Kinds of job by name. If an objective has equally many words of several kinds, the first of these counts."""

_GRASPABLE_M = 0.06
"""Half width up to which a free body counts as an object to grasp [m]. Our choice: what a hand of 0.2 m closes on."""


def kind_of(brief: Brief) -> tuple[JobKindName, str]:
    """Return the kind of job and the reason for it.

    With a free base the job is always locomotion; with a held base it never is. Without a known word the environment
    decides, and the reason says that a default was taken.
    """
    found = {name: words_in(brief.objective, kind.words) for name, kind in JOB_KINDS.items()}
    if brief.base == "free":
        because = "the robot's base is free, so the body has to carry itself"
        if found["squeeze"]:
            return "squeeze", f"{because}, and the objective speaks of {', '.join(found['squeeze'])}"
        return "crawl", because
    if brief.base != "any":
        found = {name: words for name, words in found.items() if name not in ("crawl", "squeeze")}
    best = max(found, key=lambda name: len(found[name]))
    if found[best]:
        return best, f"the objective speaks of {', '.join(found[best])}"
    return _default(brief)


def _default(brief: Brief) -> tuple[JobKindName, str]:
    unknown = "the objective names no action known to the rules"
    loose = [body for body in brief.summary.bodies if body.free and _width_m(body) <= _GRASPABLE_M]
    if loose:
        return "grasp", f"{unknown}; {loose[0].name} lies free and fits a hand"
    if brief.summary.mounts:
        return "reach", f"{unknown}; there is a mount, so an arm that reaches is assumed"
    return "crawl", f"{unknown} and there is no mount; a body that moves itself is assumed"


def words_in(objective: str, pattern: str) -> list[str]:
    """Return the word beginnings in an objective that match a pattern, each once."""
    return list(dict.fromkeys(re.findall(rf"\b({pattern})", objective.lower())))


def _width_m(body: BodySummary) -> float:
    return max((max(geom.size_m) for geom in body.geoms), default=0.0)
