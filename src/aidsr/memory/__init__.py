"""What earlier runs measured, kept as lessons and told to the next: off unless a run names a memory.

Lessons come out of runs by `aidsr.memory.collecting`, which loads what reads every kind of run; a run that is told
lessons does without.
"""

from aidsr.memory.lesson import Lesson
from aidsr.memory.store import Memory, elites

__all__ = ["Lesson", "Memory", "elites"]
