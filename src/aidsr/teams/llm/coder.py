"""The Coder: writes a concept down as MJCF, and repairs it."""

from __future__ import annotations

import json
from dataclasses import dataclass

from aidsr.core.artifacts import ActuatorGroup, Artifact, Brief, Concept, Critique, Robot
from aidsr.core.errors import MjcfError, ReplyError
from aidsr.core.roles import Feedback
from aidsr.mjcf.condense import condense
from aidsr.mjcf.kept_parts import changes_to
from aidsr.mjcf.schema import actuator_elements
from aidsr.teams.llm.conversation import Interview
from aidsr.teams.llm.describe_environment import describe_environment
from aidsr.teams.llm.feedback import describe_feedback
from aidsr.teams.llm.patch import apply_patch, patch_in
from aidsr.teams.llm.prompts import as_json, render
from aidsr.teams.llm.replies import has_json, json_in, mjcf_in, names_of, read_as

__all__ = ["CoderAgent"]

_MOST_CHANGES = 6
"""Changes to kept parts that are named in one complaint. Our choice: they mostly have one cause."""


class _Header(Artifact):
    functional_part: str
    actuator_groups: tuple[ActuatorGroup, ...] = ()
    notes: str = ""


@dataclass(frozen=True)
class CoderAgent:
    """A language model as the Coder.

    Attributes:
        interview: Who is asked, and how often again.
        edits: Whether repairs are asked for as edits of a shortened view of the robot. A robot that cannot be read is
            always asked for whole.
    """

    interview: Interview
    edits: bool = True

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
        return self.asked(brief, render("coder"), user)

    def asked(self, brief: Brief, system: str, user: str) -> Robot:
        """Return the robot that a model writes when it is told this.

        Raises:
            ReplyError: No reply could be used.
        """
        return self.interview.ask("coder", system, user, _Reader(brief).read)

    def repair(self, brief: Brief, concept: Concept, robot: Robot, feedback: Feedback) -> Robot:
        """Return the robot with the reported problems removed.

        Raises:
            ReplyError: No reply could be used.
        """
        shortened = condense(robot.mjcf) if self.edits else None
        by_edits = shortened is not None
        user = render(
            "coder_edit" if by_edits else "coder_repair",
            brief=brief,
            environment=describe_environment(brief.summary),
            concept=concept if by_edits else as_json(concept),
            header=as_json(robot, "mjcf"),
            mjcf=(shortened or robot.mjcf).strip(),
            critique=isinstance(feedback, Critique),
            feedback=describe_feedback(feedback),
        )
        system = render("coder_editor" if by_edits else "coder")
        return self.interview.ask("coder", system, user, _Reader(brief, robot if by_edits else None).read)


class _Reader:
    """Reads the Coder's replies of one conversation.

    The MJCF is the long part: once it has arrived, a wrong header can be put right by a header alone. Where there is a
    robot already, its header holds until another one is sent, and a patch of its MJCF is enough.
    """

    def __init__(self, brief: Brief, robot: Robot | None = None) -> None:
        self._brief = brief
        self._robot = robot
        self._mjcf = ""

    def read(self, reply: str) -> Robot:
        patch = patch_in(reply) if self._robot else None
        if self._robot and patch:
            self._mjcf = apply_patch(self._robot.mjcf, patch)
            reply = reply.replace(patch, "")
        else:
            self._mjcf = mjcf_in(reply) or self._mjcf
        if not self._mjcf:
            asked = "one <patch>" if self._robot else "a complete <mujoco> document in one fenced block"
            raise ReplyError(f"It has no MJCF; {asked} was asked for.")
        _check_kept(self._brief, self._mjcf)
        try:
            header = self._header(_without(reply, self._mjcf))
            _check_names(header, self._mjcf)
        except ReplyError as error:
            raise ReplyError(f"{error} The MJCF has arrived: the JSON header alone is enough now.") from None
        return Robot(mjcf=self._mjcf, **dict(header))

    def _header(self, rest: str) -> _Header:
        if self._robot and not has_json(rest):
            return _Header(**self._robot.model_dump(exclude={"mjcf"}))
        return read_as(_Header, json_in(rest))


def _check_kept(brief: Brief, mjcf: str) -> None:
    """Check that what a person wants to keep of the starting robot is as it was.

    Raises:
        ReplyError: Something of it changed. A document that cannot be read passes: its faults come first.
    """
    try:
        changes = changes_to(brief.starting_robot, mjcf, brief.keep) if brief.keep else []
    except MjcfError:
        return
    if changes:
        more = f" And {len(changes) - _MOST_CHANGES} more." if len(changes) > _MOST_CHANGES else ""
        raise ReplyError(" ".join(changes[:_MOST_CHANGES]) + more)


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
    actuators, used = names_of(mjcf, *actuator_elements()), set[str]()
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
