"""A goal in sentences, with its own numbers: what those who design for it are told."""

from __future__ import annotations

from aidsr.tasks.goal import AnyGoal, Lift, Reach, Touch, Travel

__all__ = ["differs", "unwanted", "wanted"]


def differs(goal: AnyGoal) -> str:
    """Return what differs between episodes."""
    ways = [f"{way:g} m along {axis}" for way, axis in zip(goal.vary_m, "xyz", strict=True) if way]
    if not ways:
        return "Nothing: each begins as described here."
    return f"Where {goal.target} is: up to {', '.join(ways)}, to either side of where it is described here."


def wanted(goal: AnyGoal) -> str:
    """Return what success is."""
    match goal:
        case Reach():
            return f"The point with which the functional part works is at most {goal.within_m:g} m from {goal.target}."
        case Lift():
            return f"The centre of mass of {goal.target} is at least {goal.by_m:g} m higher than it was at the start."
        case Travel():
            moved = f"The centre of mass of {goal.target}" if goal.target else "The robot's centre of mass"
            way = " ".join(f"{number:g}" for number in goal.direction)
            return f"{moved} is at least {goal.distance_m:g} m along {way} (world axes) from where it was at the start."
        case Touch():
            part = "the functional part" if goal.part == "functional_part" else "any part of the robot"
            most = "" if goal.at_most_n is None else f" and at most {goal.at_most_n:g} N"
            return f"The net force on {goal.target} by {part} is at least {goal.force_n:g} N{most}."


def unwanted(goal: AnyGoal) -> str:
    """Return what counts against it."""
    if isinstance(goal, Touch) and goal.at_most_n is not None:
        return f"More than {goal.at_most_n:g} N on {goal.target} at any moment."
    return "Nothing."
