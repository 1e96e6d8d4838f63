"""`aidsr web`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from cyclopts.validators import Number


def web(
    *,
    runs: Path = Path("runs"),
    studies: Annotated[list[Path] | None, Parameter(negative="", consume_multiple=True)] = None,
    port: Annotated[int, Parameter(validator=Number(gte=1, lte=65_535))] = 8080,
    host: str = "127.0.0.1",
    token: Annotated[str, Parameter(env_var="AIDSR_WEB_TOKEN", show_default=False)] = "",
    browser: Annotated[bool, Parameter(negative="--no-browser")] = True,
) -> int:
    """Open the web app: set up and watch runs, review and train designs.

    Runs are separate processes and continue when the web app is closed. Only this machine can reach the web app unless
    you give --host, which requires --token.

        aidsr web

        aidsr web --runs /data/runs --port 9000 --no-browser

    Parameters
    ----------
    runs
        Folder of the runs; new runs are created in it.
    studies
        Additional folders of studies to list; studies in the folder of the runs are always listed.
    port
        Port to listen on.
    host
        Address to listen on. With any address other than the default, others can reach the web app and start runs.
    token
        Password of the web app, at least 16 characters. Use the environment variable to keep it out of the list of
        processes.
    browser
        Open the web app in a browser.
    """
    from aidsr.core.extras import require_extra

    require_extra("web", "the web app")
    from aidsr.apps.web.server import serve

    serve(runs, studies=studies or (), host=host, port=port, token=token, browser=browser)
    return 0
