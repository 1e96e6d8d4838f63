"""A designer's tools: small functions that make and measure robots, used alike by teams, over MCP and from Python.

    from aidsr.tools import TOOLS, Workspace

    work = Workspace(Path("work"))
    print(TOOLS["validate"].call(work, {"mjcf": text, "functional_part": "tip"}).text)

tool        the record of a tool, and its result
workspace   the folder of robots, scenes and files under names
jobs        list_tasks, read_task, make_task
building    validate, edit, fix, assemble, look, read
measuring   play, probe, measure, sweep, train, evaluate
statics     bends, load, clearances: a body at rest
gaits       heading drift, velocity and first touch under random gaits

What compiles or steps a model does so in a limited child process.
"""

from aidsr.tools.catalogue import OWNER_TOOLS, TOOLS, tools_table
from aidsr.tools.tool import Result, Tool
from aidsr.tools.workspace import Job, Workspace

__all__ = ["OWNER_TOOLS", "TOOLS", "Job", "Result", "Tool", "Workspace", "tools_table"]
