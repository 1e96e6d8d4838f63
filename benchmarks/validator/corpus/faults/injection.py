"""Definition of a change that makes a good robot bad in one way."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
from benchmarks.validator.corpus.specimen import Grade

TextChange = Callable[[str, np.random.Generator, float], tuple[str, str]]
"""(MJCF, generator, size) -> (changed MJCF, the change in words)."""
SpecChange = Callable[[mujoco.MjSpec, np.random.Generator, float], str]
"""(specification, generator, size) -> the change in words; changes the specification in place."""
Sizes = Mapping[Grade, tuple[float, float]]


class UnsuitableError(Exception):
    """The robot lacks the parts that this change needs."""


@dataclass(frozen=True)
class Injection:
    """One way to make a good robot bad.

    Attributes:
        code: Code of the fault that should be found.
        change: Function that changes the robot.
        sizes: Range of sizes for each grade. The severity that results is measured afterwards.
        arguments: Arguments for the validation of the changed robot.
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
    """Return the sizes of a fault that is either present or not."""
    return {"bad": (1.0, 1.0)}


def of_spec(change: SpecChange) -> TextChange:
    """Return a change of MuJoCo's specification as a change of text."""

    def changed(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
        spec = mujoco.MjSpec.from_string(mjcf)
        words = change(spec, rng, size)
        # MjSpec writes a document only after it has compiled it
        spec.compile()
        return spec.to_xml(), words

    return changed
