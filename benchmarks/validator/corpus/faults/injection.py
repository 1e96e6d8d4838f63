"""What a change is that makes a good robot bad in one way."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
from benchmarks.validator.corpus.specimen import Grade

TextChange = Callable[[str, np.random.Generator, float], tuple[str, str]]
"""(MJCF, generator, size) -> (changed MJCF, what was done in words)."""
SpecChange = Callable[[mujoco.MjSpec, np.random.Generator, float], str]
"""The same on a specification, in place."""
Sizes = Mapping[Grade, tuple[float, float]]


class UnsuitableError(Exception):
    """The robot has nothing that this change could be made to."""


@dataclass(frozen=True)
class Injection:
    """One way to make a good robot bad.

    Attributes:
        code: The fault that should be found.
        change: What is done to the robot.
        sizes: Between which sizes the change is drawn for each grade; how bad it came out is measured afterwards.
        arguments: How the changed robot is to be validated.
    """

    code: str
    change: TextChange
    sizes: Sizes
    arguments: Mapping[str, Any] = field(default_factory=dict)

    def draw_size(self, grade: Grade, rng: np.random.Generator) -> float:
        """Return a size for a grade, drawn evenly on a logarithmic scale."""
        low, high = self.sizes[grade]
        return math.exp(rng.uniform(math.log(low), math.log(high)))


def present() -> Sizes:
    """Sizes of a fault that is there or not."""
    return {"bad": (1.0, 1.0)}


def of_spec(change: SpecChange) -> TextChange:
    """Return a change of MuJoCo's specification as a change of text."""

    def changed(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
        spec = mujoco.MjSpec.from_string(mjcf)
        words = change(spec, rng, size)
        # MjSpec writes documents only of what it has compiled
        spec.compile()
        return spec.to_xml(), words

    return changed
