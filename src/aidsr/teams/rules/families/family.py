"""The record of a family of robots: the jobs it suits, and how it is sized, written, described and mounted.

docs/add_a_family.md has a worked example.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeVar

import numpy as np

from aidsr.core.artifacts import Artifact, Concept, Robot
from aidsr.teams.rules.job import Job
from aidsr.teams.rules.job_kinds import JobKindName
from aidsr.teams.rules.orientation import STRAIGHT, Orientation

Quantity = Literal[
    "length", "stiffness", "tension", "thickness", "width", "tip width", "damping", "density", "mass", "count"
]
"""Quantities that feedback in plain words can change: "longer", "stiffer", "lighter", "more legs" ..."""


@dataclass(frozen=True)
class Is:
    """Annotation of a parameter with its quantity, by which feedback finds the parameter."""

    quantity: Quantity


class Parameters(Artifact):
    """Parameters of a robot of a family, with SI units in their names; each field gives its range."""

    variation: int = 0
    """How often the Coder ran out of repairs and reinforced the robot."""

    def count_step(self, name: str) -> int:
        """Return the step by which "more" or "fewer" changes a number of parts, such as `fingers`."""
        del name
        return 1


P = TypeVar("P", bound=Parameters)


@dataclass(frozen=True)
class Preference:
    """A reason to propose a family before the others that suit a job."""

    words: str
    """Regular expression of word beginnings in the objective; empty for any objective."""
    because: str
    """Reason, as a clause that concepts quote."""
    rank: int = 100
    """Rank of the preference; if several match, the lowest rank counts."""


@dataclass(frozen=True)
class Suits:
    """How a family suits one kind of job."""

    variants: tuple[str, ...]
    """Variants of the family that differ in kind, not only in numbers."""
    rank: int = 100
    """Position among the families of the job before they are shuffled; it keeps the designs of a seed the same."""
    preferred: tuple[Preference, ...] = ()


@dataclass(frozen=True)
class Description:
    """The texts of a concept."""

    name: str
    morphology: str
    actuation: str
    rationale: str


def straight(job: Job, parameters: Mapping[str, Any]) -> Orientation:
    """Return no rotation: the robot's axes are those of its mount."""
    del job, parameters
    return STRAIGHT


@dataclass(frozen=True, kw_only=True)
class Family(Generic[P]):
    """A family of robots, all of one morphology."""

    name: str
    """Value of `Concept.family`, one word."""
    doc: str
    """Description of the family in one sentence."""
    jobs: Mapping[JobKindName, Suits]
    """Kinds of job it suits."""
    parameters: type[P]
    size: Callable[[Job, np.random.Generator, str], P]
    """Function that chooses the parameters of a variant for a job; they depend only on the arguments and the state of
    the generator."""
    write: Callable[[P], Robot]
    """Function that writes the robot: MJCF, functional part and groups of actuators that act together."""
    describe: Callable[[P, Job], Description]
    """Function that describes the parameters in words."""
    reinforce: Callable[[P], P]
    """Function that returns the parameters of a stiffer, more damped robot, for faults without a known repair."""
    orient: Callable[[Job, Mapping[str, Any]], Orientation] = straight
    """Function that returns the robot's rotation on its mount from `Concept.parameters`, which other Designers may
    leave empty."""

    @property
    def variants(self) -> tuple[str, ...]:
        """All variants, each once."""
        return tuple(dict.fromkeys(variant for suits in self.jobs.values() for variant in suits.variants))

    def read(self, concept: Concept) -> P:
        """Return the parameters in a concept."""
        return self.parameters.model_validate(concept.parameters)

    def write_concept(self, concept: Concept) -> Robot:
        """Write the robot that a concept describes."""
        return self.write(self.read(concept))

    def concept(self, parameters: P, job: Job, interpretation: str = "") -> Concept:
        """Return the concept of parameters, with texts that describe them."""
        description, robot = self.describe(parameters, job), self.write(parameters)
        return Concept(
            name=description.name,
            interpretation=interpretation,
            morphology=description.morphology,
            actuation=description.actuation,
            functional_part=robot.functional_part,
            family=self.name,
            parameters=parameters.model_dump(),
            actuator_groups=robot.actuator_groups,
            rationale=f"{description.rationale} Chosen by the built-in rules, not by a language model.",
        )
