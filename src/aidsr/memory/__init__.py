"""Memory: measurements of earlier runs, stored as lessons for the designers of later runs. Off unless a run names one.

`aidsr.memory.collecting` extracts lessons from runs. It imports the readers of every kind of run and is therefore not
imported here: a run that only uses lessons does not need it.
"""

from aidsr.memory.lesson import Lesson
from aidsr.memory.store import Memory, elites

__all__ = ["Lesson", "Memory", "elites"]
