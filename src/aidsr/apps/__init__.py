"""User interfaces: command line, web app, MCP server."""
