"""AID-SR's physics for a person's own agent, over the Model Context Protocol.

    server         the tools: read a task, validate, assemble a scene, probe, render
    scene_folder   the scenes an agent has assembled, as files that every other command takes

Needs the extra "mcp"; nothing outside this package imports it.
"""
