"""Definition of a robot of the corpus."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Grade = Literal["good", "near miss", "band", "bad"]
"""A good robot has no fault. The others have one injected fault, with a severity of at most half of the limit ("near
miss"), between half and twice the limit ("band"), or at least twice the limit ("bad")."""
Split = Literal["tuning", "held out", "third", "fourth"]
"""Rules and fixes may be developed with robots of the split "tuning"; the other splits are only measured, see
benchmarks/validator/README.md."""


@dataclass(frozen=True)
class Specimen:
    """One robot and what is known about it.

    Attributes:
        name: Unique name, which tells the origin.
        split: Split of the corpus.
        family: Kind of body: "arm", "hand", "crawler".
        style: Name of the writer.
        mjcf: MJCF of the robot.
        grade: Grade by the severity of its fault.
        code: Code of its only fault; empty for a good robot.
        change: Change made to the good robot that it comes from, in words.
        arguments: Arguments for its validation.
        severity: Measurement of the oracle / limit; None if the fault has no size.
        loads: Whether MuJoCo accepts the document.
        symptoms: For a good robot, symptoms of what cannot be built, by code: measurement / limit.
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
