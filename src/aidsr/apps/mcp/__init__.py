"""AID-SR's physics for a person's own agent, over the Model Context Protocol: `aidsr.tools`, and how to read a task.

Needs the extra "mcp"; nothing outside this package imports it.
"""
