"""What earlier runs measured, kept as lessons and told to the next: off unless a run names a memory."""

from aidsr.memory.collecting import lessons_of
from aidsr.memory.lesson import Lesson
from aidsr.memory.store import Memory, elites

__all__ = ["Lesson", "Memory", "elites", "lessons_of"]
