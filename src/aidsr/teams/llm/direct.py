"""Direct prompting: one call turns the job into a robot. It is the baseline that the method must beat."""

from __future__ import annotations

from dataclasses import dataclass

from aidsr.core.artifacts import Brief, Concept, Robot
from aidsr.core.roles import Feedback
from aidsr.teams.llm.coder import CoderAgent
from aidsr.teams.llm.describe_environment import describe_environment
from aidsr.teams.llm.prompts import render


@dataclass(frozen=True)
class DirectDesigner:
    """A Designer without a language model: every concept has only a number."""

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return `count` empty concepts."""
        return tuple(self._empty(brief, number) for number in range(1, count + 1))

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        """Return the concept unchanged."""
        del brief, robot, feedback
        return concept

    def _empty(self, brief: Brief, number: int) -> Concept:
        return Concept(
            name=f"Direct prompt {number}",
            interpretation=brief.objective,
            morphology="Whatever one call makes of the job.",
            actuation="Likewise.",
            functional_part="Likewise.",
            family=f"direct {number}",
        )


@dataclass(frozen=True)
class DirectCoder:
    """A Coder that makes one call to a language model, without MJCF guide, concept or feedback."""

    coder: CoderAgent

    def write(self, brief: Brief, concept: Concept) -> Robot:
        """Return the robot that the model writes in one call.

        Raises:
            ReplyError: No reply could be used.
        """
        user = render("direct", brief=brief, environment=describe_environment(brief.summary), number=concept.name)
        return self.coder.write_from(brief, render("direct_system"), user)

    def repair(self, brief: Brief, concept: Concept, robot: Robot, feedback: Feedback) -> Robot:
        """Return the robot unchanged: there is no feedback."""
        del brief, concept, feedback
        return robot
