"""The Coder: writes the MJCF of a concept, and repairs it."""

from __future__ import annotations

from dataclasses import dataclass

from aidsr.core.artifacts import ActuatorGroup, Artifact, Brief, Concept, Critique, Robot
from aidsr.core.errors import IsolationError, MjcfError, ReplyError
from aidsr.core.roles import Feedback
from aidsr.mjcf.condense import condense
from aidsr.mjcf.kept_parts import changes_in_words, changes_to_kept_parts
from aidsr.teams.llm.conversation import Conversation
from aidsr.teams.llm.describe_environment import describe_environment
from aidsr.teams.llm.feedback import describe_feedback
from aidsr.teams.llm.patch import apply_patch, extract_patch
from aidsr.teams.llm.prompts import as_json, render
from aidsr.teams.llm.replies import check_groups, check_part, extract_mjcf, has_json, parse_json, validate_as


class _CoderHeader(Artifact):
    functional_part: str
    actuator_groups: tuple[ActuatorGroup, ...] = ()
    notes: str = ""


@dataclass(frozen=True)
class CoderAgent:
    """A language model as the Coder.

    Attributes:
        conversation: The model, and how often it is asked again after an unusable reply.
        edits: Whether repairs are patches of a condensed view of the robot. A robot that cannot be parsed is always
            rewritten completely.
    """

    conversation: Conversation
    edits: bool = True

    def write(self, brief: Brief, concept: Concept) -> Robot:
        """Return the first robot for a concept.

        Raises:
            ReplyError: No reply could be used.
        """
        user = render(
            "coder_write",
            brief=brief,
            environment=describe_environment(brief.summary),
            concept=as_json(concept),
        )
        return self.write_from(brief, render("coder"), user)

    def write_from(self, brief: Brief, system: str, user: str) -> Robot:
        """Return the robot that a model writes for these prompts.

        Raises:
            ReplyError: No reply could be used.
        """
        return self.conversation.ask("coder", system, user, _Reader(brief).read)

    def repair(self, brief: Brief, concept: Concept, robot: Robot, feedback: Feedback) -> Robot:
        """Return the robot with the reported problems removed.

        Raises:
            ReplyError: No reply could be used.
        """
        condensed = condense(robot.mjcf) if self.edits else None
        by_patch = condensed is not None
        user = render(
            "coder_edit" if by_patch else "coder_repair",
            brief=brief,
            environment=describe_environment(brief.summary),
            concept=concept if by_patch else as_json(concept),
            header=as_json(robot, "mjcf", "script"),
            mjcf=(condensed or robot.mjcf).strip(),
            critique=isinstance(feedback, Critique),
            feedback=describe_feedback(feedback),
        )
        system = render("coder_editor" if by_patch else "coder")
        return self.conversation.ask("coder", system, user, _Reader(brief, robot if by_patch else None).read)


class _Reader:
    """A parser of the Coder's replies in one conversation.

    The MJCF is the long part of a reply: after it has arrived, the model can correct a wrong header by the header
    alone. In a repair, a patch of the robot's MJCF is enough, and a reply without a header keeps the robot's header.
    """

    def __init__(self, brief: Brief, robot: Robot | None = None) -> None:
        self._brief = brief
        self._robot = robot
        self._mjcf = ""

    def read(self, reply: str) -> Robot:
        patch = extract_patch(reply) if self._robot else None
        if self._robot and patch:
            self._mjcf = apply_patch(self._robot.mjcf, patch)
            reply = reply.replace(patch, "")
        else:
            self._mjcf = extract_mjcf(reply) or self._mjcf
        if not self._mjcf:
            wanted = "one <patch>" if self._robot else "a complete <mujoco> document in one fenced block"
            raise ReplyError(f"It has no MJCF; {wanted} was asked for.")
        _check_kept(self._brief, self._mjcf)
        try:
            header = self._header(_without(reply, self._mjcf))
            check_part(self._mjcf, header.functional_part)
            check_groups(self._mjcf, header.actuator_groups)
        except ReplyError as error:
            raise ReplyError(f"{error} The MJCF has arrived: the JSON header alone is enough now.") from None
        return Robot(mjcf=self._mjcf, **dict(header))

    def _header(self, rest: str) -> _CoderHeader:
        if self._robot and not has_json(rest):
            return _CoderHeader(**self._robot.model_dump(include=set(_CoderHeader.model_fields)))
        return validate_as(_CoderHeader, parse_json(rest))


def _check_kept(brief: Brief, mjcf: str) -> None:
    """Check that the kept parts of the starting robot are unchanged.

    Raises:
        ReplyError: A kept part changed. A document that cannot be parsed or takes too long is not checked, because
            those faults have to be corrected first.
    """
    try:
        changes = changes_to_kept_parts(brief.starting_robot, mjcf, brief.keep) if brief.keep else []
    except (MjcfError, IsolationError):
        return
    if changes:
        raise ReplyError(changes_in_words(changes))


def _without(reply: str, mjcf: str) -> str:
    """Return the reply without its MJCF, which may contain braces."""
    return reply.replace(mjcf.strip(), "")
