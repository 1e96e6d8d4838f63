"""Attribution of a failure: the phase of a task in which a robot fails, and the role that can change it.

The finding is an issue as the Judge writes one, with bodies, times and numbers, so every team that understands its
Judge understands it. Components are named as the Judge names them.
"""

from __future__ import annotations

from typing import Literal

from aidsr.core.artifacts import CritiqueIssue
from aidsr.core.formatting import format_number
from aidsr.learn.openloop.trace import Trace
from aidsr.tasks import GoalTask, Task
from aidsr.tasks.goals import Goal
from aidsr.tasks.goals.touch import Touch
from aidsr.tasks.readings import TOUCH_N

Phase = Literal["never_reached", "no_force", "wrong_way", "slipped", "unstable", "not_forward"]
_LOST = 0.1
"""Loss of progress that counts as a slip. Our choice: more than the progress of an episode fluctuates."""
_FIRM_N = 0.5
"""Sustained force from which a robot does not count as weak, whatever its target needs [N]. Our choice: more than the
weight of a limb."""
_MOVED_M = 0.002
"""Displacement of a target that contacts and play alone can explain [m]. Our choice: a quarter of the shortest travel
in a task."""
_ONWARD = 0.02
"""Smallest progress of a free robot that counts as moving forward. Our choice: more than swaying in place yields."""
_HARDLY_M = 0.02
"""Distance below which a free robot counts as not having moved [m]. Our choice: below a tenth of any robot's length."""


def attribute_failure(task: Task, trace: Trace) -> tuple[Phase, CritiqueIssue]:
    """Return the phase in which an unsuccessful episode ended, and an issue for the role that should change something.

    Args:
        task: Task of the episode.
        trace: Recorded episode with the best motion.
    """
    end = trace.steps[-1]
    if trace.outcomes.diverged[0]:
        return "unstable", CritiqueIssue(
            blame="coder",
            component=end.fastest,
            problem=f"the simulation breaks down after {_s(end.time_s)}, when {end.fastest} moves fastest",
            suggestion="more damping, less pull, heavier or softer parts there",
        )
    if not trace.nearest.nearest:
        return "not_forward", _not_forward(trace) if trace.free else _held(task, trace)
    if _is_to_reach(task) or trace.hardest.force_n < TOUCH_N:
        return "never_reached", _never_reached(task, trace)
    if trace.best.progress - end.progress > _LOST and end.force_n < TOUCH_N:
        return "slipped", _slipped(trace)
    wanted_n = _wanted_n(task) or max(trace.required_n, _FIRM_N)
    if trace.sustained_n < wanted_n:
        return "no_force", _no_force(task, trace)
    return "wrong_way", _wrong_way(task, trace)


def _goal_of(task: Task) -> Goal | None:
    return task.goal if isinstance(task, GoalTask) else None


def _is_to_reach(task: Task) -> bool:
    """Whether the goal of the task consists of points only."""
    goal = _goal_of(task)
    return goal is not None and bool(goal.points) and not goal.bodies


def _wanted_n(task: Task) -> float | None:
    goal = _goal_of(task)
    return goal.wanted_n if goal else None


def _touch(trace: Trace) -> str:
    """Return a clause that says which bodies touch which targets first, and when."""
    first = next(step for step in trace.steps if step.force_n >= TOUCH_N)
    return f"{', '.join(first.touching)} touches {', '.join(first.touched)} first at {_s(first.time_s)}"


def _slipped(trace: Trace) -> CritiqueIssue:
    hardest = trace.hardest
    held = trace.best if trace.best.touching else hardest
    last = max(step.time_s for step in trace.steps if step.force_n >= TOUCH_N)
    return CritiqueIssue(
        blame="coder",
        component=", ".join(held.touching),
        problem=f"touches {', '.join(held.touched)} with up to {_n(hardest.force_n)} at {_s(hardest.time_s)} and loses "
        f"it at {_s(last)}",
        suggestion="a wider, softer or more frictional surface there, and a grip from more sides",
    )


def _no_force(task: Task, trace: Trace) -> CritiqueIssue:
    enough = f", where {_n(trace.required_n)} would move it" if trace.required_n else ""
    if wanted_n := _wanted_n(task):
        enough = f", where {_n(wanted_n)} is wanted"
    return CritiqueIssue(
        blame="coder",
        component="actuator_too_weak",
        problem=f"{_touch(trace)}, and presses with no more than {_n(trace.sustained_n)} for longer than an impact"
        f"{enough}",
        suggestion="more pull or a larger cable offset, so that the limb presses harder where it touches",
    )


def _wrong_way(task: Task, trace: Trace) -> CritiqueIssue:
    """Return the issue of a sustained force without effect: the target does not move, or not as the task requires."""
    stands = f"nothing is gained after {_s(trace.best.time_s)}"
    if isinstance(goal := _goal_of(task), Touch):
        by = "by its functional part" if goal.part == "functional_part" else "in one direction"
        return CritiqueIssue(
            blame="designer",
            component="grip",
            problem=f"{_touch(trace)}; it presses with {_n(trace.sustained_n)}, but too little of that {by}: {stands}",
            suggestion="let the part that is to touch come first, and press from one side",
        )
    enough = f", where {_n(trace.required_n)} would be enough to move it" if trace.required_n else ""
    moved_m = max(step.moved_m for step in trace.steps)
    effect = f"moves no target by more than {_mm(moved_m)}" if moved_m > _MOVED_M else "moves no target"
    return CritiqueIssue(
        blame="designer",
        component="grip",
        problem=f"{_touch(trace)}; it presses with {_n(trace.sustained_n)}{enough}, and {effect}: {stands}",
        suggestion="let the part that works reach farther round or behind what it touches, so that its force acts as "
        "the job asks, and all the way, not against what cannot give way",
    )


def _never_reached(task: Task, trace: Trace) -> CritiqueIssue:
    nearest = trace.nearest
    reach_m = max(step.reach_m for step in trace.steps)
    came, near_m = f"comes no nearer to {nearest.nearest} than {_mm(nearest.gap_m)}, at {_s(nearest.time_s)}", 0.0
    if (goal := _goal_of(task)) and _is_to_reach(task):
        near_m = goal.near_m
        came += f", where {_mm(near_m)} is near enough"
    far = f"it gets {_mm(reach_m)} from its root, and {nearest.nearest} is {_mm(trace.needed_m)} away"
    if reach_m < trace.needed_m - near_m:
        longer = "make it longer, or let it travel nearer" if trace.free else "make it longer"
        return CritiqueIssue(
            blame="designer", component="reach", problem=f"{came}; {far}: too short", suggestion=longer
        )
    return CritiqueIssue(
        blame="integrator",
        component="placement",
        problem=f"{came}, although {far}",
        suggestion="turn or move it so that it bends towards its target",
    )


def _held(task: Task, trace: Trace) -> CritiqueIssue:
    """Return the issue of a held robot without targets: it gains progress only by bending, or by being freed."""
    travelled_m = max(step.travelled_m for step in trace.steps)
    moved = f"its root is held, and its centre of mass moves by no more than {_mm(travelled_m)}"
    if (goal := _goal_of(task)) and goal.robot_travels and task.base in ("any", "free"):
        return CritiqueIssue(
            blame="integrator",
            component="placement",
            problem=f"{moved} in {_s(trace.steps[-1].time_s)}",
            suggestion='place it with base "free", so that it can travel',
        )
    return CritiqueIssue(
        blame="designer",
        component="reach",
        problem=f"{moved}: nothing is gained after {_s(trace.best.time_s)}",
        suggestion="let it bend farther, or another way",
    )


def _not_forward(trace: Trace) -> CritiqueIssue:
    travelled_m = max(step.travelled_m for step in trace.steps)
    if travelled_m < _HARDLY_M:
        problem = f"it moves its body by no more than {_mm(travelled_m)} in {_s(trace.steps[-1].time_s)}"
        return CritiqueIssue(
            blame="coder", component="actuator_too_weak", problem=problem, suggestion="more pull, or lighter"
        )
    if trace.best.progress >= _ONWARD:
        return CritiqueIssue(
            blame="designer",
            component="gait",
            problem=f"it moves forward, but by no more than {_mm(travelled_m)} in {_s(trace.steps[-1].time_s)}",
            suggestion="longer strokes, or less slip on their way back: feet that lift, or that grip one way",
        )
    return CritiqueIssue(
        blame="designer",
        component="gait",
        problem=f"it moves by up to {_mm(travelled_m)} in {_s(trace.steps[-1].time_s)}, but not forward",
        suggestion="let its strokes push back along its way more than they pull forward: limbs that lift, or a body "
        "that grips at one end while the other moves",
    )


def _mm(length_m: float) -> str:
    return f"{format_number(1000 * length_m)} mm"


def _s(time_s: float) -> str:
    return f"{format_number(time_s)} s"


def _n(force_n: float) -> str:
    return f"{format_number(force_n)} N"
