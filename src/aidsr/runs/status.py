"""The status of a run: computed from its files on each call, never stored."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Literal, TypeVar

from aidsr.core.artifacts import Artifact, Decision, Outcome
from aidsr.core.calls import Usage
from aidsr.core.errors import UserError
from aidsr.runs.events import (
    DecisionUnreadable,
    Event,
    StepStarted,
    Stopped,
    Waiting,
    read_events,
    working_time_s,
)
from aidsr.runs.folders import DesignFolder, IterationFolder, Run
from aidsr.runs.record import RunRecord

Value = TypeVar("Value")
State = Literal["running", "waiting", "stopped", "finished"]
"""Of a run or a design: "waiting" for a person's decision; "stopped" by an error or an interrupt, to be resumed;
"running" otherwise, until it is finished. A process killed outright leaves "running" behind: files cannot show it."""


class DesignStatus(Artifact):
    """The status of one design."""

    number: int
    concept: str
    """Name of the concept it stands at."""
    family: str
    state: State
    iteration: int
    """Number of the newest iteration, 0 before the first."""
    stands_at: int
    """Number of the iteration that a person is asked about, else of that its outcome names, else of the newest one."""
    mechanical_repairs: int
    """Made by code, over all iterations; they cost neither a call nor an iteration."""
    round: int
    """1, and one more for each refinement a person asked for."""
    doing: str
    """The step at work, empty when none is."""
    stable: bool | None
    """Whether the robot or scene it stands at is stable; None before one was validated."""
    judged: bool | None
    """The Judge's verdict on it, or the one before; None before the first."""
    faults: tuple[str, ...]
    """Codes of the errors in that report, worst first, without repeats."""
    outcome: Outcome | None
    stopped: Stopped | None
    """Why it stopped, where it did."""
    usage: Usage
    """Its own calls and an even share of the Designer's."""
    latency_s: float
    """From start to outcome, the Designer's call included; without pauses and without waiting for a person [s]."""


class RunStatus(Artifact):
    """The status of a run."""

    record: RunRecord
    state: State
    designs: tuple[DesignStatus, ...]
    stopped: Stopped | None
    """Why the run stopped before there were concepts, where it did."""
    usage: Usage
    latency_s: float
    """Like a design's: from start to the last outcome [s]."""

    @property
    def approved(self) -> int:
        """How many designs are approved."""
        return sum(design.outcome is not None and design.outcome.outcome == "approved" for design in self.designs)

    def design(self, number: int) -> DesignStatus:
        """Return one design by its number, which need not be its place: folders before it may have been deleted.

        Raises:
            UserError: There is none of that number.
        """
        found = next((design for design in self.designs if design.number == number), None)
        if found is None:
            there = ", ".join(str(design.number) for design in self.designs) or "none yet"
            raise UserError(f"this run has no design {number}; it has: {there}")
        return found


def read_status(run: Run, now: datetime | None = None) -> RunStatus:
    """Return the state of a run from its files.

    Args:
        run: The run.
        now: Count the time of steps still at work up to this moment; without it, up to the last event.

    Raises:
        UserError: The folder is not a run, or one of its files is damaged.
    """
    record = run.asked()
    events = read_events(run.events)
    proposing_s = _proposing_s(events, now)
    shared = _total(call.usage for call in run.calls)
    folders = run.designs
    designs = tuple(
        _design_status(folder, _share(shared, index, len(folders)), proposing_s, now)
        for index, folder in enumerate(folders)
    )
    return RunStatus(
        record=record,
        state=_run_state(events, designs, len(run.concepts.read() or ())),
        designs=designs,
        stopped=_stopped(events),
        usage=_total(design.usage for design in designs) if designs else shared,
        latency_s=max((design.latency_s for design in designs), default=proposing_s),
    )


def _design_status(folder: DesignFolder, share: Usage, proposing_s: float, now: datetime | None) -> DesignStatus:
    events = read_events(folder.events)
    iterations, waiting = folder.iterations, _awaited(events)
    shown = folder.leading_to(waiting)
    concept = newest(it.concept.read() for it in shown)
    report = newest(it.scene_report.read() or it.robot_report.read() for it in shown)
    critique = newest(it.critique.read() for it in shown)
    outcome = folder.outcome.read()
    folder.require_whole()
    return DesignStatus(
        number=folder.number,
        concept=concept.name if concept else "",
        family=concept.family if concept else "",
        state="finished" if outcome else _state(events),
        iteration=iterations[-1].number if iterations else 0,
        stands_at=shown[0].number if shown else 0,
        mechanical_repairs=sum(repairs.total for it in iterations if (repairs := it.repairs.read())),
        round=1 + sum(found.verdict == "refine" for it in iterations[:-1] if (found := decided(it))),
        doing=_doing(events),
        stable=report.stable if report else None,
        judged=critique.passed if critique else None,
        faults=tuple(dict.fromkeys(fault.code for fault in report.errors)) if report else (),
        outcome=outcome,
        stopped=_stopped(events),
        usage=_total((share, *(call.usage for iteration in iterations for call in iteration.calls))),
        latency_s=proposing_s + working_time_s(events, now),
    )


def newest(values: Iterable[Value | None]) -> Value | None:
    """The first value that is there, of values listed newest first."""
    return next((value for value in values if value is not None), None)


def decided(iteration: IterationFolder) -> Decision | None:
    """A person's decision; None where there is none, or it is half written or invalid."""
    try:
        return iteration.decision.read()
    except UserError:
        return None


def _proposing_s(events: Sequence[Event], now: datetime | None) -> float:
    """How long the Designer worked on the concepts [s]; the run's log continues while designs are made and wait."""
    last = max((at for at, event in enumerate(events) if isinstance(event, StepStarted)), default=-1)
    return working_time_s(events[: last + 2], now if last == len(events) - 1 else None)


def _state(events: Sequence[Event]) -> State:
    match events[-1] if events else None:
        case Stopped():
            return "stopped"
        case Waiting() | DecisionUnreadable():
            return "waiting"
        case _:
            return "running"


def _awaited(events: Sequence[Event]) -> int | None:
    """Return the iteration that waits for a person; None if there is none."""
    last = events[-1] if events else None
    return last.iteration if isinstance(last, Waiting | DecisionUnreadable) else None


def _run_state(events: Sequence[Event], designs: Sequence[DesignStatus], expected: int) -> State:
    """Waiting counts most, because a person can end it; a run is finished when all its designs are."""
    if not designs or len(designs) < expected:
        return _state(events)
    states = {design.state for design in designs}
    order: tuple[State, ...] = ("waiting", "running", "stopped")
    return next((state for state in order if state in states), "finished")


def _stopped(events: Sequence[Event]) -> Stopped | None:
    last = events[-1] if events else None
    return last if isinstance(last, Stopped) else None


def _doing(events: Sequence[Event]) -> str:
    last = events[-1] if events else None
    return last.step if isinstance(last, StepStarted) else ""


def _total(usages: Iterable[Usage]) -> Usage:
    return sum(usages, Usage())


def _share(usage: Usage, index: int, count: int) -> Usage:
    """Return part `index` of `count` even parts; the parts add up to the whole, so whole numbers differ by at most one.

    Source: AID-SR splits the Designer's call evenly over its concepts.
    """

    def part(whole: int) -> int:
        return whole * (count - index) // count - whole * (count - index - 1) // count

    return Usage(
        calls=part(usage.calls),
        input_tokens=part(usage.input_tokens),
        cached_input_tokens=part(usage.cached_input_tokens),
        output_tokens=part(usage.output_tokens),
        tokens_estimated=usage.tokens_estimated,
        cost_usd=None if usage.cost_usd is None else usage.cost_usd / count,
        replayed_cost_usd=None if usage.replayed_cost_usd is None else usage.replayed_cost_usd / count,
        latency_s=usage.latency_s / count,
        retries=part(usage.retries),
    )
