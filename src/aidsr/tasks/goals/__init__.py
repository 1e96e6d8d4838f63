"""Goals in files: success criteria for any environment. The modules define the kinds; docs/goals.md describes them."""

from __future__ import annotations

from aidsr.tasks.goals.goal import GOAL_VERSION, Goal
from aidsr.tasks.goals.goal_task import GoalTask, goal_task
from aidsr.tasks.goals.reading import KINDS, AnyGoal, parse_goal, read_goal

__all__ = ["GOAL_VERSION", "KINDS", "AnyGoal", "Goal", "GoalTask", "goal_task", "parse_goal", "read_goal"]
