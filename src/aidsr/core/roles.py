"""The four roles that make a design, as protocols.

Two teams implement them: `aidsr.teams.llm` calls a language model, `aidsr.teams.rules` applies built-in rules. The loop
in `aidsr.loop` treats both alike.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from aidsr.core.artifacts import Brief, Concept, Critique, Placement, Robot, Scene, ValidationReport

Feedback = ValidationReport | Critique
"""Reason to send a robot or a placement back to its author: a report with faults, or the Judge's issues."""


class Designer(Protocol):
    """Role that proposes robot concepts for a job."""

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return `count` concepts that differ in morphology and actuation."""
        ...

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        """Return the concept, changed according to the feedback of a person or the Judge; the rest is kept.

        Raises:
            NoBetterDesignError: There is nothing new to try; only built-in rules raise it.
        """
        ...


@dataclass(frozen=True)
class BodyTried:
    """Result of one trial of a robot body that a Designer made before proposing concepts."""

    name: str
    number: int
    """Number of the body, from 1; it stays the same if the body is tried again."""
    most: int
    """Maximum number of bodies."""
    progress: float | None
    """Progress, 0 to 1; None if the trial could not be run."""
    succeeded: bool
    seconds: float
    """Duration of the trial [s]."""
    refused: bool = False
    """Whether the Judge rejected this body before; such a body is tried again only if a resumed run ranks all bodies
    anew."""
    motions: int = 0
    """Number of motions of a repeated trial of a promising body; 0 for the first trial."""


@runtime_checkable
class TriesBodies(Protocol):
    """A Designer that tries bodies, which may take minutes, and reports each trial."""

    def with_listener(self, listen: Callable[[BodyTried], None]) -> Designer:
        """Return the same Designer, which calls `listen` after each trial."""
        ...


class Coder(Protocol):
    """Role that writes a concept as MJCF."""

    def write(self, brief: Brief, concept: Concept) -> Robot:
        """Return a first robot for the concept."""
        ...

    def repair(self, brief: Brief, concept: Concept, robot: Robot, feedback: Feedback) -> Robot:
        """Return the robot with the reported problems removed."""
        ...


class Integrator(Protocol):
    """Role that decides where a robot is placed in the environment."""

    def place(self, brief: Brief, concept: Concept, robot: Robot) -> Placement:
        """Return a first placement."""
        ...

    def adjust(
        self, brief: Brief, concept: Concept, robot: Robot, placement: Placement, feedback: Feedback
    ) -> Placement:
        """Return the placement with the reported problems removed."""
        ...


class Judge(Protocol):
    """Role that decides whether a stable scene is worth training."""

    def judge(self, brief: Brief, concept: Concept, robot: Robot, scene: Scene, report: ValidationReport) -> Critique:
        """Return a passing critique, or a failing one with issues that each name the responsible role."""
        ...


@dataclass(frozen=True)
class Team:
    """The four roles of one run."""

    designer: Designer
    coder: Coder
    integrator: Integrator
    judge: Judge
    places_with_robot: bool = False
    """Whether robot and placement are made together: feedback on either goes to the Coder first, and the Scene
    Integrator then returns the placement that belongs to the new robot."""
