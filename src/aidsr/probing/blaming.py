"""Where a body stops on its way through a task, and whose work that is.

What a probe found is told in phases, each with bodies, times and numbers, as a critique: so every team that understands
its Judge understands the task. Components are named as the Judge names them.
"""

from __future__ import annotations

from typing import Literal

from aidsr.artifacts import Critique, CritiqueIssue, TaskReport
from aidsr.probing.tracing import Trace
from aidsr.tasks import Task
from aidsr.tasks.readings import TOUCH_N
from aidsr.wording import written

__all__ = ["judge_trace", "targets_of"]

_Stop = Literal["never_reached", "no_force", "slipped", "unstable", "not_forward"]
_ENOUGH = 0.5
"""Progress at which a task without stages counts as begun well. Our choice."""
_LOST = 0.1
"""Progress that is lost again after a slip. Our choice: more than an episode wavers by."""
_HARDLY_M = 0.02
"""A free robot that travelled less has not moved. Our choice: below a tenth of any body's length."""


def targets_of(task: Task) -> tuple[str, ...]:
    """Return the bodies of the environment that a task measures the robot's touch with."""
    touched = [sensor.target for sensor in task.sensors if sensor.quantity in ("contact_force", "contacts")]
    return tuple(dict.fromkeys(touched)) if task.base != "free" else ()


def judge_trace(task: Task, trace: Trace, tried: int) -> TaskReport:
    """Return the phase in which the best motion ends, and who should change what.

    Args:
        task: What was tried.
        trace: The best motion, watched.
        tried: How many motions were tried to find it.
    """
    won = bool(trace.course.succeeded[0])
    progress = float(trace.course.best_progress[0])
    reached = f"{task.reached(progress, won=won)} (progress {progress:.2f}, best of {tried} open-loop motions)"
    if won or progress >= _good_enough(task):
        summary = f"Without learning the body comes so far: {reached}."
        return TaskReport(
            phase="solved" if won else "partial", progress=progress, critique=Critique(passed=True, summary=summary)
        )
    phase, issue = _stopped(task, trace)
    critique = Critique(passed=False, summary=f"Tried on its task it comes so far: {reached}.", issues=(issue,))
    return TaskReport(phase=phase, progress=progress, critique=critique)


def _good_enough(task: Task) -> float:
    """Return the progress from which training is left to show the rest: moving forward, or more than being there."""
    starts = [start for start, _ in task.stages]
    if not starts:
        return _ENOUGH
    return starts[0] if task.base == "free" else starts[min(1, len(starts) - 1)]


def _stopped(task: Task, trace: Trace) -> tuple[_Stop, CritiqueIssue]:
    best, hardest, end = trace.best, trace.hardest, trace.looks[-1]
    if trace.course.diverged[0]:
        return "unstable", CritiqueIssue(
            blame="coder",
            component=end.fastest,
            problem=f"the simulation breaks down after {_s(end.time_s)}, when {end.fastest} moves fastest",
            suggestion="more damping, less pull, heavier or softer parts there",
        )
    if task.base == "free":
        return "not_forward", _not_forward(trace)
    if hardest.force_n < TOUCH_N:
        return "never_reached", _never_reached(trace)
    if best.progress - end.progress > _LOST and end.force_n < TOUCH_N:
        last = max(look.time_s for look in trace.looks if look.force_n >= TOUCH_N)
        holding = ", ".join(best.touching or hardest.touching)
        return "slipped", CritiqueIssue(
            blame="coder",
            component=holding,
            problem=f"touches {hardest.nearest} with up to {_n(hardest.force_n)} at {_s(hardest.time_s)} and loses it "
            f"at {_s(last)}",
            suggestion="a wider, softer or more frictional surface there, and a grip from more sides",
        )
    return "no_force", CritiqueIssue(
        blame="coder",
        component="actuator_too_weak",
        problem=f"{', '.join(hardest.touching)} touches {hardest.nearest} at {_s(hardest.time_s)} with no more than "
        f"{_n(hardest.force_n)}, which moves the task no further",
        suggestion="more pull or a larger cable offset, so that the limb presses harder where it touches",
    )


def _never_reached(trace: Trace) -> CritiqueIssue:
    nearest = trace.nearest
    reach_m = max(look.reach_m for look in trace.looks)
    came = f"comes no nearer to {nearest.nearest} than {_mm(nearest.gap_m)}, at {_s(nearest.time_s)}"
    far = f"it gets {_mm(reach_m)} from its root, and {nearest.nearest} is {_mm(trace.needed_m)} away"
    if reach_m < trace.needed_m:
        return CritiqueIssue(
            blame="designer", component="reach", problem=f"{came}; {far}: too short", suggestion="make it longer"
        )
    return CritiqueIssue(
        blame="integrator",
        component="placement",
        problem=f"{came}, although {far}",
        suggestion="turn or move it so that it bends towards its target",
    )


def _not_forward(trace: Trace) -> CritiqueIssue:
    travelled_m = max(look.travelled_m for look in trace.looks)
    if travelled_m < _HARDLY_M:
        problem = f"it moves its body by no more than {_mm(travelled_m)} in {_s(trace.looks[-1].time_s)}"
        return CritiqueIssue(
            blame="coder", component="actuator_too_weak", problem=problem, suggestion="more pull, or lighter"
        )
    return CritiqueIssue(
        blame="designer",
        component="gait",
        problem=f"it moves by up to {_mm(travelled_m)} in {_s(trace.looks[-1].time_s)}, but not forward",
        suggestion="let its strokes push back along its way more than they pull forward: limbs that lift, or a body "
        "that grips at one end while the other moves",
    )


def _mm(length_m: float) -> str:
    return f"{written(1000 * length_m)} mm"


def _s(time_s: float) -> str:
    return f"{written(time_s)} s"


def _n(force_n: float) -> str:
    return f"{written(force_n)} N"
