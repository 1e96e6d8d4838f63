"""Tools of a designer: small functions that make and measure robots, for use by teams, over MCP and from Python.

    from aidsr.tools import TOOLS, Workspace

    work = Workspace(Path("work"))
    print(TOOLS["validate"].call(work, {"mjcf": text, "functional_part": "tip"}).text)

tool        definition of a tool, and its result
workspace   folder of named robots, scenes, tasks and files
jobs        list_tasks, read_task, make_task
building    validate, edit, fix, assemble, look, read
measuring   play, probe, measure, sweep, train, evaluate
statics     bends, load, clearances: a body at rest
gaits       heading drift, velocity and first touch under random gaits

Models are compiled and simulated only in a child process with limits.
"""

from aidsr.tools.catalogue import OWNER_TOOLS, TOOLS, tools_table
from aidsr.tools.tool import Result, Tool
from aidsr.tools.workspace import Job, Workspace

__all__ = ["OWNER_TOOLS", "TOOLS", "Job", "Result", "Tool", "Workspace", "tools_table"]
