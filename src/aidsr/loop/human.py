"""The human step. The decision is a file, so it can come from a terminal, an editor, a browser or a test."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from aidsr.core.artifacts import Decision
from aidsr.core.errors import IsolationError, MjcfError, UserError
from aidsr.core.suggestions import close_names
from aidsr.loop.parts import Halt
from aidsr.loop.steps import HaltedError
from aidsr.mjcf.elements import join
from aidsr.mjcf.kept_parts import part_names
from aidsr.runs import DesignFolder, EventLog, IterationFolder
from aidsr.runs.events import Decided, DecisionUnreadable, Waiting
from aidsr.runs.status import newest


def approve(iteration: IterationFolder, log: EventLog, halt: Halt) -> Decision:
    """Approve a scene that the Judge passed, without a person and without a file."""
    del iteration, log, halt
    return Decision(verdict="approve")


@dataclass(frozen=True)
class DecisionFile:
    """Waits for decision.json in the folder of the iteration."""

    poll_s: float = 0.5

    def __call__(self, iteration: IterationFolder, log: EventLog, halt: Halt) -> Decision:
        """Return the decision as soon as it can be read; log each new reason why the file cannot be read.

        A decision to keep a part that the robot does not have counts as one that cannot be read.
        """
        known = cache(lambda: _part_names(iteration))
        decision, problem = _read_decision(iteration, known)
        if decision is not None:
            return decision
        log.write(Waiting(iteration=iteration.number))
        reported = ""
        while decision is None:
            if problem and problem != reported:
                reported = problem
                log.write(DecisionUnreadable(iteration=iteration.number, reason=problem))
            if halt():
                raise HaltedError
            time.sleep(self.poll_s)
            decision, problem = _read_decision(iteration, known)
        log.write(Decided(iteration=iteration.number, verdict=decision.verdict))
        return decision


@dataclass(frozen=True)
class PresetFeedback:
    """Gives feedback that was written before the run, once for each design, and writes it to decision.json."""

    text: str

    def __call__(self, iteration: IterationFolder, log: EventLog, halt: Halt) -> Decision:
        """Return a refinement with the preset text for the first scene of a design, and approval for all later ones."""
        del halt
        written = iteration.decision.read()
        if written is not None:
            return written
        earlier = [path for path in iteration.path.parent.glob("*/decision.json") if path.parent != iteration.path]
        if earlier:
            return Decision(verdict="approve")
        decision = Decision(verdict="refine", text=self.text)
        iteration.decision.write(decision)
        log.write(Decided(iteration=iteration.number, verdict=decision.verdict))
        return decision


def _read_decision(
    iteration: IterationFolder, known_parts: Callable[[], list[str] | None]
) -> tuple[Decision | None, str]:
    """Return the decision, or the problem of the file; neither while the file is missing or being written.

    An editor empties a file before it fills it, so a problem counts only if the file did not change in the meantime.

    Args:
        iteration: The iteration that waits.
        known_parts: Returns the names of the robot's parts, None if they are not known.
    """
    before = _content(iteration)
    if not before:
        return None, ""
    try:
        decision = iteration.decision.read()
    except UserError as error:
        return None, str(error) if _content(iteration) == before else ""
    unknown = _unknown_part(decision, known_parts) if decision else ""
    return (None, unknown) if unknown else (decision, "")


def _unknown_part(decision: Decision, known_parts: Callable[[], list[str] | None]) -> str:
    """Return a sentence about the first part to keep that the robot does not have; "" if it has all of them."""
    known = known_parts() if decision.verdict == "refine" and decision.keep else None
    name = next((each.name for each in decision.keep if known is not None and each.name not in known), None)
    if known is None or name is None:
        return ""
    there = join(dict.fromkeys([*close_names(name, known, most=3), *known])) or "no named part"
    return f'keep names "{name}", which the robot does not have; it has {there}; correct decision.json'


def _part_names(iteration: IterationFolder) -> list[str] | None:
    """Return the names of the parts of an iteration's robot; None without a robot that can be read in time."""
    robot = newest(it.robot.read() for it in DesignFolder(iteration.path.parent).leading_to(iteration.number))
    try:
        return part_names(robot.mjcf) if robot else None
    except (MjcfError, IsolationError):
        return None


def _content(iteration: IterationFolder) -> bytes:
    path = iteration.decision.path
    return path.read_bytes() if path.exists() else b""
