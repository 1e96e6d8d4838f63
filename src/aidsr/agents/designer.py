"""The Designer: interprets the task and thinks of bodies."""

from __future__ import annotations

from dataclasses import dataclass

from pydantic import Field

from aidsr.agents.environment import describe_environment
from aidsr.agents.interview import Interview
from aidsr.agents.prompts import as_json, render
from aidsr.agents.replies import json_in, read_as
from aidsr.artifacts import ActuatorGroup, Artifact, Brief, Concept, Robot
from aidsr.errors import ReplyError

__all__ = ["DesignerAgent"]


class _Idea(Artifact):
    """A concept as the Designer writes it: the interpretation is said once for all of them."""

    name: str
    family: str
    morphology: str
    actuation: str
    functional_part: str
    parameters: dict[str, float] = Field(default_factory=dict)
    actuator_groups: tuple[ActuatorGroup, ...] = ()
    rationale: str = ""


class _Proposal(Artifact):
    interpretation: str
    concepts: tuple[_Idea, ...]


@dataclass(frozen=True)
class DesignerAgent:
    """A language model as the Designer."""

    interview: Interview

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return `count` concepts that differ in morphology and actuation.

        Raises:
            ReplyError: No reply could be used.
        """
        environment = describe_environment(brief.summary)
        user = render("designer_propose", brief=brief, environment=environment, count=count)
        return self._concepts(user, count)

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        """Return the concept changed as a person or the Judge asked, keeping what was not criticised.

        Raises:
            ReplyError: No reply could be used.
        """
        user = render(
            "designer_revise",
            brief=brief,
            environment=describe_environment(brief.summary),
            concept=as_json(concept),
            robot=robot,
            feedback=feedback.strip(),
        )
        (revised,) = self._concepts(user, 1)
        return revised

    def _concepts(self, user: str, count: int) -> tuple[Concept, ...]:
        return self.interview.ask("designer", render("designer"), user, lambda reply: _read(reply, count))


def _read(reply: str, count: int) -> tuple[Concept, ...]:
    proposal = read_as(_Proposal, json_in(reply))
    if len(proposal.concepts) != count:
        raise ReplyError(f"It has {len(proposal.concepts)} concepts; exactly {count} asked for.")
    return tuple(Concept(interpretation=proposal.interpretation, **dict(idea)) for idea in proposal.concepts)
