"""The Coder: writes a concept down as MJCF, and repairs it."""

from __future__ import annotations

import json
from dataclasses import dataclass

from aidsr.agents.environment import describe_environment
from aidsr.agents.feedback import describe_feedback
from aidsr.agents.interview import Interview
from aidsr.agents.prompts import as_json, render
from aidsr.agents.replies import json_in, mjcf_in, names_of, read_as
from aidsr.artifacts import ActuatorGroup, Artifact, Brief, Concept, Robot
from aidsr.errors import ReplyError
from aidsr.roles import Feedback

__all__ = ["CoderAgent"]

_ACTUATORS = (
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "dcmotor",
)
"""Elements of MJCF's actuator section that need no plugin. Source: MuJoCo XML reference."""


class _Header(Artifact):
    functional_part: str
    actuator_groups: tuple[ActuatorGroup, ...] = ()
    notes: str = ""


@dataclass(frozen=True)
class CoderAgent:
    """A language model as the Coder."""

    interview: Interview

    def write(self, brief: Brief, concept: Concept) -> Robot:
        """Return a first robot for the concept.

        Raises:
            ReplyError: No reply could be used.
        """
        user = render(
            "coder_write",
            brief=brief,
            environment=describe_environment(brief.summary),
            concept=as_json(concept),
        )
        return self.interview.ask("coder", render("coder"), user, _Reader().read)

    def repair(self, brief: Brief, concept: Concept, robot: Robot, feedback: Feedback) -> Robot:
        """Return the robot with the reported problems removed.

        Raises:
            ReplyError: No reply could be used.
        """
        user = render(
            "coder_repair",
            brief=brief,
            environment=describe_environment(brief.summary),
            concept=as_json(concept),
            header=as_json(robot, "mjcf"),
            robot=robot,
            feedback=describe_feedback(feedback),
        )
        return self.interview.ask("coder", render("coder"), user, _Reader().read)


class _Reader:
    """Reads the Coder's replies of one conversation.

    The MJCF is the long part: once it has arrived, a wrong header can be put right by a header alone.
    """

    def __init__(self) -> None:
        self._mjcf = ""

    def read(self, reply: str) -> Robot:
        self._mjcf = mjcf_in(reply) or self._mjcf
        if not self._mjcf:
            raise ReplyError("It has no MJCF; a complete <mujoco> document in one fenced block was asked for.")
        try:
            header = read_as(_Header, json_in(_without(reply, self._mjcf)))
            _check_names(header, self._mjcf)
        except ReplyError as error:
            raise ReplyError(f"{error} The MJCF has arrived: the JSON header alone is enough now.") from None
        return Robot(mjcf=self._mjcf, **dict(header))


def _without(reply: str, mjcf: str) -> str:
    """Return the reply without its MJCF, so that nothing inside it is taken for the header."""
    return reply.replace(mjcf.strip(), "")


def _check_names(header: _Header, mjcf: str) -> None:
    """Check that what the header names is in the MJCF.

    Raises:
        ReplyError: A name is not, or an actuator acts in two groups. What exists is listed.
    """
    parts = names_of(mjcf, "body", "site")
    if header.functional_part not in parts:
        raise ReplyError(_no_such("functional_part", header.functional_part, "body or site", parts))
    actuators, used = names_of(mjcf, *_ACTUATORS), set[str]()
    for name in (name for group in header.actuator_groups for name in group.actuators):
        if name not in actuators:
            raise ReplyError(_no_such("actuator_groups", name, "actuator", actuators))
        if name in used:
            raise ReplyError(f'The actuator "{name}" is in two places of actuator_groups; it can be in one.')
        used.add(name)


def _no_such(field: str, name: str, kind: str, known: frozenset[str]) -> str:
    return f"{field} names {json.dumps(name)}, but no {kind} of the MJCF has that name; it has {_listed(known)}."


def _listed(names: frozenset[str]) -> str:
    """Return names for a sentence, at most 40 of them."""
    shown = sorted(names)[:40]
    return (", ".join(shown) or "none") + (f" and {len(names) - 40} more" if len(names) > 40 else "")
