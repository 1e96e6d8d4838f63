"""The measuring team: one language model that makes bodies and measures them with `aidsr.tools` until one does the job.

session      the conversation: replies, tool calls and results, until it finishes or its budget is used up
board        the summary of the work so far in each question: the last reply in full, the rest in lines written by code
toolbox      the tools of the session, the records of their calls, and the budget
own_tools    tools that only this team has
exploration  families of bodies and measured scenes, derived from the records
records      the record of a tool call
calls        tool calls in the text of a reply, for models without tool support
team         the four roles of a run, played by a session

Its prompts are in `aidsr.teams.llm`, with those of the other teams: measuring.md and measuring_*.md.
"""

from aidsr.teams.measuring.team import copy_measured, measuring_team
from aidsr.teams.measuring.toolbox import ToolBudget

__all__ = ["ToolBudget", "copy_measured", "measuring_team"]
