"""The measuring team: one language model that makes bodies and measures them with `aidsr.tools` until one does the job.

session    the conversation: replies, calls of tools, results, until it finishes or its budget is used up
board      what a question tells of the work so far: the last reply in full, the rest in lines that code keeps
toolbox    the tools it has, what each call brought on record, and what it may still call
calls      calls of tools in the text of a reply, for models that take none
team       the four roles of a run, played by a session

Its prompts are beside the others, in `aidsr.teams.llm`: measuring.md and measuring_*.md.
"""

from aidsr.teams.measuring.team import copy_measured, measuring_team
from aidsr.teams.measuring.toolbox import ToolBudget

__all__ = ["ToolBudget", "copy_measured", "measuring_team"]
