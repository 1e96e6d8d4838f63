"""The ways in: command line, web app, MCP server."""
