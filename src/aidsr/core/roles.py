"""The four roles that make a design, as protocols.

Two teams play them: `aidsr.teams.llm` asks a language model, `aidsr.teams.rules` follows rules. The loop in
`aidsr.loop` treats both alike.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from aidsr.core.artifacts import Brief, Concept, Critique, Placement, Robot, Scene, ValidationReport

Feedback = ValidationReport | Critique
"""What sends a robot or a placement back to its author: measured faults, or the Judge's issues."""


class Designer(Protocol):
    """Thinks of bodies for a job."""

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return `count` concepts that differ in morphology and actuation."""
        ...

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        """Return the concept changed as a person or the Judge asked, keeping what was not criticised.

        Raises:
            NoBetterDesignError: There is nothing new to try; a team of rules may say so.
        """
        ...


@dataclass(frozen=True)
class BodyTried:
    """A body that a Designer tried before proposing any."""

    name: str
    number: int
    """Which of those tried, from 1 on; a body keeps it where it is tried again."""
    most: int
    """How many are tried at most."""
    progress: float | None
    """How far it came, 0 to 1; None where it could not be played."""
    succeeded: bool
    seconds: float
    """How long that took."""
    refused: bool = False
    """Whether the Judge refused it before; it is tried again only where a resumed run ranks all bodies anew."""
    motions: int = 0
    """With how many motions it is tried again because it came far; 0 the first time."""


@runtime_checkable
class TriesBodies(Protocol):
    """A Designer that tries bodies, which may take minutes, and tells of each."""

    def telling(self, listen: Callable[[BodyTried], None]) -> Designer:
        """Return the same Designer, who calls `listen` with each body tried."""
        ...


class Coder(Protocol):
    """Writes a concept down as MJCF."""

    def write(self, brief: Brief, concept: Concept) -> Robot:
        """Return a first robot for the concept."""
        ...

    def repair(self, brief: Brief, concept: Concept, robot: Robot, feedback: Feedback) -> Robot:
        """Return the robot with the reported problems removed."""
        ...


class Integrator(Protocol):
    """Decides where a robot stands in the environment."""

    def place(self, brief: Brief, concept: Concept, robot: Robot) -> Placement:
        """Return a first placement."""
        ...

    def adjust(
        self, brief: Brief, concept: Concept, robot: Robot, placement: Placement, feedback: Feedback
    ) -> Placement:
        """Return the placement with the reported problems removed."""
        ...


class Judge(Protocol):
    """Decides whether a stable scene is worth training."""

    def judge(self, brief: Brief, concept: Concept, robot: Robot, scene: Scene, report: ValidationReport) -> Critique:
        """Return a pass, or a fail with issues that each blame a role."""
        ...


@dataclass(frozen=True)
class Team:
    """The four roles as used by one run."""

    designer: Designer
    coder: Coder
    integrator: Integrator
    judge: Judge
