"""`aidsr mcp`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def mcp(
    *,
    folder: Path = Path("scenes"),
    runs: Path = Path("runs"),
    config: Annotated[bool, Parameter(negative="", show_default=False)] = False,
) -> int:
    """Give an agent of yours our physics: a Model Context Protocol server on standard input and output.

    Your agent starts this command itself; see docs/mcp.md for how to list it. It can then read tasks or make its own,
    validate robots, place them in environments, measure, train and look at them. Scenes it makes are kept as files for
    `aidsr view` and `aidsr train`.

        aidsr mcp --folder scenes --config

    Parameters
    ----------
    folder
        Where scenes are kept.
    runs
        Runs that it may read.
    config
        Print the entry for your agent's list of servers, with whole paths, and serve nothing: an agent starts the
        server in a directory of its own, and without your shell's environment.
    """
    from aidsr.apps.cli.terminal import write_document
    from aidsr.core.extras import require_extra

    require_extra("mcp", "the server")
    from aidsr.apps.mcp.server import build_server

    if config:
        args = ["-m", "aidsr", "mcp", "--folder", str(folder.absolute()), "--runs", str(runs.absolute())]
        write_document(
            json.dumps({"mcpServers": {"aidsr": {"command": sys.executable, "args": args}}}, indent=2) + "\n"
        )
        return 0
    build_server(folder.absolute(), runs.absolute()).run("stdio")
    return 0
