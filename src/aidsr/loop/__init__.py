"""The method: the loop for one concept, concepts side by side, going on after a stop, and the human step."""

from aidsr.loop.parts import Parts
from aidsr.loop.run import BUILTIN, brief_for, design, give_budget, parts_of, resume, start
from aidsr.loop.runner import Listen, work

__all__ = ["BUILTIN", "Listen", "Parts", "brief_for", "design", "give_budget", "parts_of", "resume", "start", "work"]
