"""AID-SR's physics for a person's own agent, over the Model Context Protocol.

    server   the tools: read a task, validate, place a robot in an environment, draw
    desk     the scenes an agent has made, kept as files that every other command takes

Needs the extra "mcp"; nothing outside this package imports it.
"""
