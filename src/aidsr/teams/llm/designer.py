"""The Designer: interprets the task and proposes concepts."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import combinations

from pydantic import Field

from aidsr.core.artifacts import ActuatorGroup, Artifact, Brief, Concept, Robot
from aidsr.core.errors import ReplyError
from aidsr.mjcf.condense import condense
from aidsr.teams.llm.conversation import Conversation
from aidsr.teams.llm.describe_environment import describe_environment
from aidsr.teams.llm.prompts import as_json, render
from aidsr.teams.llm.replies import parse_json, validate_as

_MAX_SIMILARITY = 0.8
"""Share of common words above which two descriptions count as one concept. Our choice: one changed word in ten."""


class _ConceptReply(Artifact):
    """A concept in the Designer's reply, which has one interpretation for all concepts."""

    name: str
    family: str
    morphology: str
    actuation: str
    functional_part: str
    parameters: dict[str, float] = Field(default_factory=dict)
    actuator_groups: tuple[ActuatorGroup, ...] = ()
    rationale: str = ""


class _DesignerReply(Artifact):
    interpretation: str
    concepts: tuple[_ConceptReply, ...]


@dataclass(frozen=True)
class DesignerAgent:
    """A language model as the Designer.

    Attributes:
        conversation: The model, and how often it is asked again after an unusable reply.
        condensed: Whether the MJCF of a robot is shown in condensed form.
    """

    conversation: Conversation
    condensed: bool = True

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return `count` concepts that differ in morphology and actuation.

        Raises:
            ReplyError: No reply could be used.
        """
        environment = describe_environment(brief.summary)
        user = render("designer_propose", brief=brief, environment=environment, count=count)
        return self._concepts(user, count)

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        """Return the concept changed as a user or the Judge requested; what was not criticised stays unchanged.

        Raises:
            ReplyError: No reply could be used.
        """
        user = render(
            "designer_revise",
            brief=brief,
            environment=describe_environment(brief.summary),
            concept=as_json(concept),
            robot=robot,
            mjcf=((self.condensed and condense(robot.mjcf)) or robot.mjcf).strip() if robot else "",
            feedback=feedback.strip(),
        )
        (revised,) = self._concepts(user, 1)
        return revised

    def _concepts(self, user: str, count: int) -> tuple[Concept, ...]:
        return self.conversation.ask("designer", render("designer"), user, _Reader(count).read)


class _Reader:
    """A parser of the Designer's replies in one conversation; it rejects concepts that are too similar once."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._asked_to_differ = False

    def read(self, reply: str) -> tuple[Concept, ...]:
        proposal = validate_as(_DesignerReply, parse_json(reply))
        if len(proposal.concepts) != self._count:
            raise ReplyError(f"It has {len(proposal.concepts)} concepts; exactly {self._count} asked for.")
        alike = next((pair for pair in combinations(proposal.concepts, 2) if _are_similar(*pair)), None)
        if alike and not self._asked_to_differ:
            self._asked_to_differ = True
            first, second = (idea.name for idea in alike)
            raise ReplyError(
                f'"{first}" and "{second}" are nearly the same robot. Keep the better one and put another in the place '
                "of the other, with another morphology and another actuation."
            )
        return tuple(Concept(interpretation=proposal.interpretation, **dict(idea)) for idea in proposal.concepts)


def _are_similar(one: _ConceptReply, other: _ConceptReply) -> bool:
    """Whether two concepts share a family, or have nearly the same morphology and actuation."""
    if one.family.casefold() == other.family.casefold():
        return True
    return all(
        _similarity(getattr(one, of), getattr(other, of)) > _MAX_SIMILARITY for of in ("morphology", "actuation")
    )


def _similarity(one: str, other: str) -> float:
    """Return the share of words of three or more letters that two texts have in common (Jaccard index)."""
    words = [set(re.findall(r"[a-z]{3,}", text.casefold())) for text in (one, other)]
    return len(words[0] & words[1]) / max(len(words[0] | words[1]), 1)
