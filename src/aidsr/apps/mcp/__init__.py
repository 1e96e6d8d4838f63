"""Model Context Protocol (MCP) server that offers the tools of `aidsr.tools` and resources to a user's own agent.

Requires the extra "mcp". Outside this package, only the command `aidsr mcp` imports it, when it is called.
"""
