"""Status of a run, computed from its files on each call and never stored."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime
from pathlib import Path
from typing import Literal, TypeVar

from aidsr.core.artifacts import Artifact, Decision, Outcome
from aidsr.core.calls import Usage
from aidsr.core.errors import UserError
from aidsr.runs.events import (
    DecisionUnreadable,
    Event,
    StepStarted,
    Stopped,
    Tried,
    Waiting,
    read_events,
    working_time_s,
)
from aidsr.runs.folders import DesignFolder, IterationFolder, Run, as_run
from aidsr.runs.record import RunRecord

Value = TypeVar("Value")
State = Literal["running", "waiting", "stopped", "finished"]
"""State of a run or a design: "waiting" for a person's decision; "stopped" by an error or an interrupt, can be resumed;
"finished"; "running" otherwise. After its process was killed the state stays "running", as files cannot show this."""


class DesignStatus(Artifact):
    """The status of one design."""

    number: int
    concept: str
    """Name of its current concept."""
    family: str
    state: State
    iteration: int
    """Number of the newest iteration, 0 before the first."""
    stands_at: int
    """Number of the current iteration: the one that waits for a person's decision, else the one that the outcome names,
    else the newest one; 0 before the first."""
    mechanical_repairs: int
    """Number of automatic fixes by code in all iterations; they cost neither a call nor an iteration."""
    round: int
    """1 plus the number of refinements that a person requested."""
    doing: str
    """The step that is running, empty if none is."""
    stable: bool | None
    """Whether the latest validated robot or scene up to the current iteration is stable; None before the first."""
    judged: bool | None
    """The Judge's latest verdict up to the current iteration; None before the first."""
    faults: tuple[str, ...]
    """Codes of the errors in the latest report, in its order, without duplicates."""
    outcome: Outcome | None
    stopped: Stopped | None
    """Reason why it stopped, if it did."""
    usage: Usage
    """Usage of its own calls and of an equal share of the Designer's calls for the run."""
    latency_s: float
    """Working time from start to outcome [s], including the Designer's call; without pauses between processes and
    without waiting for a person."""


class RunStatus(Artifact):
    """The status of a run."""

    record: RunRecord
    state: State
    designs: tuple[DesignStatus, ...]
    stopped: Stopped | None
    """Reason why the run itself stopped, as before there were concepts, if it did."""
    usage: Usage
    latency_s: float
    """Largest working time of a design, see `DesignStatus.latency_s` [s]."""

    @property
    def approved(self) -> int:
        """Number of approved designs."""
        return sum(design.outcome is not None and design.outcome.outcome == "approved" for design in self.designs)

    @property
    def why_unfinished(self) -> str:
        """Why a run that is not finished ended: what stopped it and its designs, else its state; without full stop."""
        reasons = [stopped for stopped in (self.stopped, *(each.stopped for each in self.designs)) if stopped]
        messages = dict.fromkeys(stopped.message.rstrip(".") for stopped in reasons)
        return "; ".join(messages) or f"the run is {self.state}"

    def design(self, number: int) -> DesignStatus:
        """Return a design by its number, which can differ from its position if folders were deleted.

        Raises:
            UserError: There is no design of that number.
        """
        found = next((design for design in self.designs if design.number == number), None)
        if found is None:
            there = ", ".join(str(design.number) for design in self.designs) or "none yet"
            raise UserError(f"this run has no design {number}; it has: {there}")
        return found


def read_status(run: str | Path | Run, now: datetime | None = None) -> RunStatus:
    """Return the status of a run from its files: its designs with state, faults, outcome, tokens, cost and time.

        status = aidsr.read_status("runs/2026-01-31_1002_button_pushing_7f3a")
        print(status.state, status.approved, status.usage.cost_usd)
        table = pandas.json_normalize([design.model_dump() for design in status.designs])

    Args:
        run: The run, or its folder.
        now: Time up to which running steps are counted; None counts up to the last event.

    Raises:
        TypeError: `run` has another type.
        UserError: The folder is not a run, or one of its files is damaged.
    """
    run = as_run(run)
    record = run.asked()
    events = read_events(run.events)
    proposing_s = _proposing_s(events, now)
    shared = _total(call.usage for call in run.calls)
    folders, stopped = run.designs, _stopped(events)
    designs = tuple(
        _design_status(folder, _share(shared, index, len(folders)), proposing_s, now, stopped)
        for index, folder in enumerate(folders)
    )
    return RunStatus(
        record=record,
        state=_run_state(events, designs, len(run.concepts.read() or ())),
        designs=designs,
        stopped=stopped,
        usage=_total(design.usage for design in designs) if designs else shared,
        latency_s=max((design.latency_s for design in designs), default=proposing_s),
    )


def _design_status(
    folder: DesignFolder, share: Usage, proposing_s: float, now: datetime | None, run_stopped: Stopped | None
) -> DesignStatus:
    """Return the status of a design; if its run was stopped while a step was at work, the design is stopped too."""
    events = read_events(folder.events)
    worked_s = working_time_s(events, None if run_stopped else now)
    if run_stopped and _state(events) == "running":
        events = (*events, run_stopped)
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
        latency_s=proposing_s + worked_s,
    )


def newest(values: Iterable[Value | None]) -> Value | None:
    """Return the first value that is not None, from values listed newest first."""
    return next((value for value in values if value is not None), None)


def decided(iteration: IterationFolder) -> Decision | None:
    """Return a person's decision; None where there is none, or it is incomplete or invalid."""
    try:
        return iteration.decision.read()
    except UserError:
        return None


def _proposing_s(events: Sequence[Event], now: datetime | None) -> float:
    """Return the time that the Designer worked on the concepts [s].

    Later events of the run's log do not count: the log continues while designs are made and wait.
    """
    last = max((at for at, event in enumerate(events) if isinstance(event, StepStarted)), default=-1)
    # a Designer that tries bodies writes an event for each of them
    end = next((at for at in range(last + 1, len(events)) if not isinstance(events[at], Tried)), None)
    return working_time_s(events if end is None else events[: end + 1], now if end is None else None)


def _state(events: Sequence[Event]) -> State:
    match events[-1] if events else None:
        case Stopped():
            return "stopped"
        case Waiting() | DecisionUnreadable():
            return "waiting"
        case _:
            return "running"


def _awaited(events: Sequence[Event]) -> int | None:
    """Return the number of the iteration that waits for a person; None if there is none."""
    last = events[-1] if events else None
    return last.iteration if isinstance(last, Waiting | DecisionUnreadable) else None


def _run_state(events: Sequence[Event], designs: Sequence[DesignStatus], expected: int) -> State:
    """Return the state of a run: "waiting" takes precedence, since a person can end it, then "running", then "stopped".

    It is "finished" if all its designs are.
    """
    if not designs or len(designs) < expected:
        return _state(events)
    states = {design.state for design in designs}
    order: tuple[State, ...] = ("waiting", "running", "stopped")
    return next((state for state in order if state in states), "finished")


def _stopped(events: Sequence[Event]) -> Stopped | None:
    last = events[-1] if events else None
    return last if isinstance(last, Stopped) else None


def _doing(events: Sequence[Event]) -> str:
    last = next((event for event in reversed(events) if not isinstance(event, Tried)), None)
    return last.step if isinstance(last, StepStarted) else ""


def _total(usages: Iterable[Usage]) -> Usage:
    return sum(usages, Usage())


def _share(usage: Usage, index: int, count: int) -> Usage:
    """Return part `index` of `count` equal parts of a usage; integers differ by at most one and add up to the whole.

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
