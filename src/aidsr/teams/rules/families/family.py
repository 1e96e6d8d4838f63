"""What every morphology family supplies: parameters, how to choose them for a job, how to write them as MJCF."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from aidsr.core.artifacts import Artifact, Concept, Robot
from aidsr.teams.rules.job import Job

__all__ = ["Family", "Parameters", "Texts"]


class Parameters(Artifact):
    """Numbers that fix a robot of a family, SI units in their names; each field gives its range."""

    variation: int = 0
    """How often the Coder had to give up repairing and made the robot sturdier."""


P = TypeVar("P", bound=Parameters)


@dataclass(frozen=True)
class Texts:
    """What a concept says about itself."""

    name: str
    morphology: str
    actuation: str
    rationale: str


@dataclass(frozen=True)
class Family(Generic[P]):
    """A morphology family.

    Attributes:
        label: Value of Concept.family.
        variants: Ways to build it that differ in kind, not only in numbers.
        parameters: Its parameter class.
        sample: Chooses parameters for a job; the same generator state gives the same parameters.
        write: Writes the robot.
        describe: Says in words what the numbers mean.
        sturdier: Parameters of a stronger, stiffer, calmer relative, for when no repair is known.
    """

    label: str
    variants: tuple[str, ...]
    parameters: type[P]
    sample: Callable[[Job, np.random.Generator, str], P]
    write: Callable[[P], Robot]
    describe: Callable[[P, Job], Texts]
    sturdier: Callable[[P], P]

    def read(self, concept: Concept) -> P:
        """Return the parameters a concept fixes."""
        return self.parameters.model_validate(concept.parameters)

    def write_concept(self, concept: Concept) -> Robot:
        """Write the robot a concept describes."""
        return self.write(self.read(concept))
