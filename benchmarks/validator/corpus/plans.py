"""Plan of the corpus: the number of robots of each kind."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.validator.corpus.faults import INJECTIONS, Injection
from benchmarks.validator.corpus.specimen import Grade, Split


@dataclass(frozen=True)
class Plan:
    """Number of robots of each kind in a split.

    Attributes:
        good: Number of good robots by writer.
        graded: Number of robots of each injection, by grade.
        bad_of_code: Smallest number of bad robots of each code, in the splits "tuning" and "held out" together five. If
            `graded` gives fewer, injections make a second batch.
        largest: Largest number of degrees of freedom of a robot that is made bad; larger robots only cost time.
        patience: Attempts per robot.
    """

    good: dict[str, int]
    graded: dict[Grade, int]
    bad_of_code: int
    largest: int = 30
    patience: int = 8

    def bad_of(self, injection: Injection, among: Sequence[Injection]) -> int:
        """Return the number of bad robots that one injection must make, so that all of its code make enough."""
        return math.ceil(self.bad_of_code / sum(other.code == injection.code for other in among))

    def batches(self, injection: Injection, grade: Grade) -> list[range]:
        """Return the batches of an injection: the numbers of the robots that are made together."""
        first = self.graded[grade]
        wanted = self.bad_of(injection, INJECTIONS) if grade == "bad" else first
        return [range(first), *([range(first, wanted)] if wanted > first else [])]


PLANS: dict[Split, Plan] = {
    "tuning": Plan(
        {"hinges": 12, "balls": 10, "tapered": 10, "discs": 9, "ground": 12, "loops": 5, "own": 4, "styles": 22},
        {"bad": 1},
        bad_of_code=3,
    ),
    "held out": Plan(
        {
            "hinges": 4,
            "balls": 4,
            "tapered": 4,
            "discs": 4,
            "ground": 4,
            "loops": 3,
            "own": 2,
            "styles": 8,
            "hands": 5,
            "frames": 4,
        },
        {"bad": 1, "near miss": 1},
        bad_of_code=2,
    ),
    "third": Plan(
        {
            "hinges": 2,
            "balls": 2,
            "tapered": 2,
            "discs": 2,
            "ground": 2,
            "loops": 1,
            "own": 1,
            "styles": 3,
            "hands": 3,
            "frames": 2,
        },
        {"bad": 1},
        bad_of_code=1,
        largest=20,
    ),
    "fourth": Plan(
        {
            "hinges": 7,
            "balls": 7,
            "tapered": 7,
            "discs": 6,
            "ground": 7,
            "loops": 3,
            "own": 3,
            "styles": 12,
            "hands": 8,
            "frames": 6,
        },
        {"bad": 1},
        bad_of_code=1,
        largest=20,
    ),
}
"""Plan of each split. benchmarks/validator/README.md says what was known of a split when it was measured."""
