"""The server of the web app."""

from __future__ import annotations

import hashlib
import secrets
import socket
import sys
import threading
import webbrowser
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import uvicorn
from fastapi import FastAPI
from nicegui import app, ui
from nicegui.storage import Storage

from aidsr.apps.web.errors import add_error_pages
from aidsr.apps.web.frame import ASSETS
from aidsr.apps.web.guard import LOOPBACK, Guard
from aidsr.apps.web.pages import add_pages
from aidsr.apps.web.routes import routes
from aidsr.apps.web.site import Site
from aidsr.core.directory_lock import DirectoryLock
from aidsr.core.errors import UserError
from aidsr.core.storage_errors import storage_errors
from aidsr.runs.files import replace_file


def serve(
    runs: Path,
    *,
    studies: Sequence[Path] = (),
    host: str = "127.0.0.1",
    port: int = 8080,
    token: str = "",
    browser: bool = True,
) -> None:
    """Serve the web app until interrupted.

    Args:
        runs: Folder of the runs.
        studies: Folders of studies outside the folder of runs.
        host: Address to listen on.
        port: Port to listen on.
        token: Secret that a browser must present; required unless `host` is a loopback address.
        browser: Whether to open the web app in the default browser.

    Raises:
        UserError: Another machine could reach the web app and there is no token, another web app serves the folder, or
            the port is taken.
    """
    alone = host in {name.strip("[]") for name in LOOPBACK}
    if not alone and len(token) < _SHORTEST_TOKEN:
        raise UserError(
            f"cannot listen on {host} without a --token of at least {_SHORTEST_TOKEN} characters: any client could "
            "execute code; give a --token, which the web app then asks for, or omit --host"
        )
    address = f"http://{f'[{host}]' if ':' in host else host}:{port}/"
    with _alone(runs), _listening(host, port) as door, suppress(KeyboardInterrupt):
        server = uvicorn.Server(
            uvicorn.Config(
                build(runs, studies, hosts=LOOPBACK if alone else frozenset(), token=token),
                log_level="warning",
                ws="websockets-sansio",
                timeout_graceful_shutdown=3,
            )
        )
        if browser:
            app.on_startup(lambda: threading.Timer(0.3, webbrowser.open, (address,)).start())
        app.on_startup(
            lambda: (
                sys.stdout.write(f"AID-SR is running at {address} (Control-C stops the web app; runs continue)\n")
                and sys.stdout.flush()
            )
        )
        server.run(sockets=[door])


_SHORTEST_TOKEN = 16
"""Minimum length of a token in characters. Our choice: too long to be guessed over a network."""


@contextmanager
def _alone(runs: Path) -> Iterator[None]:
    """Keep other web apps from serving a folder of runs: each would overwrite what was typed in the other.

    Raises:
        UserError: Another web app serves the folder.
    """
    own = Site.at(runs).own
    with storage_errors(own):
        own.mkdir(parents=True, exist_ok=True)
        try:
            lock = DirectoryLock(own)
        except UserError:
            raise UserError(
                f"another aidsr web serves {runs}; open that one (its terminal shows the address) or stop it, or serve "
                "another folder with --runs"
            ) from None
    try:
        yield
    finally:
        lock.release()


def _listening(host: str, port: int) -> socket.socket:
    """Return a listening socket.

    Raises:
        UserError: This machine does not have the address, or the port is taken.
    """
    try:
        return socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
    except OSError as error:
        raise UserError(
            f"cannot listen on port {port} of {host}: {error.strerror}; choose another with --port"
        ) from None


def build(runs: Path, studies: Sequence[Path] = (), *, hosts: frozenset[str] = LOOPBACK, token: str = "") -> FastAPI:
    """Return the application for a folder of runs and some studies, protected by `Guard`."""
    site = Site.at(runs, studies)
    site.own.mkdir(parents=True, exist_ok=True)
    here = hashlib.sha256(str(site.own).encode()).hexdigest()[:8]  # cookies are shared by all ports of a host
    Storage.path = site.own / "people"
    application = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    application.include_router(routes(site))
    app.add_static_files("/assets", ASSETS)
    add_pages(site)
    ui.run_with(
        application,
        title="AID-SR",
        favicon=ASSETS / "icon.svg",
        dark=None,
        language="en-US",
        tailwind=False,
        storage_secret=_secret(site.own / "secret"),
        session_middleware_kwargs={"session_cookie": f"aidsr_session_{here}"},
        show_welcome_message=False,
        reconnect_timeout=20,
    )
    app.config.quasar_config["loadingBar"] = {"skipHijack": True}  # no accessible name for screen readers
    add_error_pages(application)
    application.add_middleware(Guard, hosts=hosts, token=token, cookie=f"aidsr_token_{here}")
    return application


def _secret(path: Path) -> str:
    """Return the key that signs cookies, kept in a file so that visitors stay signed in after a restart."""
    if not path.exists() or not path.stat().st_size:  # a server that was killed may have left it empty
        path.touch(mode=0o600)
        replace_file(path, secrets.token_hex(32).encode("ascii"))
    return path.read_text(encoding="ascii")
