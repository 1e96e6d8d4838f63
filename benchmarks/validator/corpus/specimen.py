"""What a robot of the corpus is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Grade = Literal["good", "near miss", "band", "bad"]
"""A good robot has no fault; the others have one injected: at most half as large as its limit allows, between half and
twice, or at least twice as large."""
Split = Literal["tuning", "held out", "third", "fourth"]
"""Rules and fixes may be looked at with the first; the others are only measured, see benchmarks/validator/README.md."""


@dataclass(frozen=True)
class Specimen:
    """One robot and what is known about it.

    Attributes:
        name: Says where it comes from, unique in the corpus.
        split: Whether rules may be looked at with it.
        family: What kind of body: "arm", "hand", "crawler".
        style: Which writer wrote it.
        mjcf: The robot.
        grade: How bad it is.
        code: The one fault it has; empty for a good robot.
        change: What was done to the good robot it comes from, in words.
        arguments: How it is to be validated.
        severity: What was measured by the oracle / the limit; None where a fault has no size.
        loads: Whether MuJoCo accepts it.
        symptoms: Of a good robot, what could not be built, by code: measured / limit.
    """

    name: str
    split: Split
    family: str
    style: str
    mjcf: str
    grade: Grade = "good"
    code: str = ""
    change: str = ""
    arguments: Mapping[str, Any] = field(default_factory=dict)
    severity: float | None = None
    loads: bool = True
    symptoms: Mapping[str, float] = field(default_factory=dict)
