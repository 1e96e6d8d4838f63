"""`aidsr mcp`."""

from __future__ import annotations

from pathlib import Path


def mcp(*, folder: Path = Path("scenes"), runs: Path = Path("runs")) -> int:
    """Give an agent of yours our physics: a Model Context Protocol server on standard input and output.

    Your agent starts this command itself; see docs/mcp.md for how to list it. It can then read tasks or make its own,
    validate robots, place them in environments, measure, train and look at them. Scenes it makes are kept as files for
    `aidsr view` and `aidsr train`.

        aidsr mcp --folder scenes

    Parameters
    ----------
    folder
        Where scenes are kept.
    runs
        Runs that it may read.
    """
    from aidsr.core.extras import require_extra

    require_extra("mcp", "the server")
    from aidsr.apps.mcp.server import build_server

    build_server(folder.absolute(), runs.absolute()).run("stdio")
    return 0
