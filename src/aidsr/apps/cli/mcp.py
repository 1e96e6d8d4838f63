"""`aidsr mcp`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

from aidsr.apps.cli.flag import Flag


def mcp(
    *,
    folder: Path = Path("scenes"),
    runs: Path = Path("runs"),
    config: Flag = False,
) -> int:
    """Give your own agent access to the simulation tools: an MCP server on standard input and output.

    Your agent starts this command itself; docs/mcp.md describes the setup. The agent can then read tasks or create its
    own, validate robots, place them in environments, measure and train them, and get pictures of them. Its scenes are
    stored as files for `aidsr view` and `aidsr train`.

        aidsr mcp --folder scenes --config

    Parameters
    ----------
    folder
        Folder in which the agent's robots, scenes and own tasks are stored; it is created when it is needed.
    runs
        Folder of the runs that the agent may read.
    config
        Print the entry for your agent's list of servers, with absolute paths, and exit. The paths are absolute because
        an agent starts the server in its own directory and without your shell's environment.
    """
    from aidsr.apps.cli.terminal import write_document
    from aidsr.core.errors import UserError
    from aidsr.core.extras import require_extra

    require_extra("mcp", "the server")
    for option, path in (("--folder", folder), ("--runs", runs)):
        if path.is_file():
            raise UserError(f"{option} {path} is a file; give a folder")
    from aidsr.apps.mcp.server import build_server

    if config:
        args = ["-m", "aidsr", "mcp", "--folder", str(folder.absolute()), "--runs", str(runs.absolute())]
        write_document(
            json.dumps({"mcpServers": {"aidsr": {"command": sys.executable, "args": args}}}, indent=2) + "\n"
        )
        return 0
    build_server(folder.absolute(), runs.absolute()).run("stdio")
    return 0
