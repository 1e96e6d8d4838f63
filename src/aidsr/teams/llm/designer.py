"""The Designer: interprets the task and thinks of bodies."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import combinations

from pydantic import Field

from aidsr.core.artifacts import ActuatorGroup, Artifact, Brief, Concept, Robot
from aidsr.core.errors import ReplyError
from aidsr.mjcf.condense import condense
from aidsr.teams.llm.conversation import Interview
from aidsr.teams.llm.describe_environment import describe_environment
from aidsr.teams.llm.prompts import as_json, render
from aidsr.teams.llm.replies import json_in, read_as

__all__ = ["DesignerAgent"]


_MOST_SHARED = 0.8
"""Share of common words above which two descriptions are of one idea. Our choice: one changed word in ten."""


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
    """A language model as the Designer.

    Attributes:
        interview: Who is asked, and how often again.
        condensed: Whether a robot is shown without its repetitions.
    """

    interview: Interview
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
            mjcf=((self.condensed and condense(robot.mjcf)) or robot.mjcf).strip() if robot else "",
            feedback=feedback.strip(),
        )
        (revised,) = self._concepts(user, 1)
        return revised

    def _concepts(self, user: str, count: int) -> tuple[Concept, ...]:
        return self.interview.ask("designer", render("designer"), user, _Reader(count).read)


class _Reader:
    """Reads the Designer's replies of one conversation; concepts that are too alike are asked for again once."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._asked_to_differ = False

    def read(self, reply: str) -> tuple[Concept, ...]:
        proposal = read_as(_Proposal, json_in(reply))
        if len(proposal.concepts) != self._count:
            raise ReplyError(f"It has {len(proposal.concepts)} concepts; exactly {self._count} asked for.")
        alike = next((pair for pair in combinations(proposal.concepts, 2) if _alike(*pair)), None)
        if alike and not self._asked_to_differ:
            self._asked_to_differ = True
            first, second = (idea.name for idea in alike)
            raise ReplyError(
                f'"{first}" and "{second}" are nearly the same robot. Keep the better one and put another in the place '
                "of the other, with another morphology and another actuation."
            )
        return tuple(Concept(interpretation=proposal.interpretation, **dict(idea)) for idea in proposal.concepts)


def _alike(one: _Idea, other: _Idea) -> bool:
    """Whether two ideas share a family, or say nearly the same of body and actuation."""
    if one.family.casefold() == other.family.casefold():
        return True
    return all(_shared(getattr(one, of), getattr(other, of)) > _MOST_SHARED for of in ("morphology", "actuation"))


def _shared(one: str, other: str) -> float:
    """Return the share of words that two texts have in common, numbers left out (Jaccard index)."""
    words = [set(re.findall(r"[a-z]{3,}", text.casefold())) for text in (one, other)]
    return len(words[0] & words[1]) / max(len(words[0] | words[1]), 1)
