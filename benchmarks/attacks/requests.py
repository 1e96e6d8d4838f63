"""Requests to the web app and messages to the MCP server that no well-behaved browser or agent sends."""

from __future__ import annotations

import contextlib
import json
import os
import re
import select
import signal
import socket
import subprocess
import time
import urllib.request
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import IO, Any

from benchmarks.attacks.tries import LIMIT_S, WALL_S, Outcome, contents, end, start, workers_of

from foreign_texts import unpack

_SECRET = "what nobody outside may read"
_CROSS = "Host: 127.0.0.1:PORT\r\nOrigin: http://evil.example\r\nSec-Fetch-Site: cross-site\r\n"
_SOCKET = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: eA==\r\n"

_POST = b"POST / HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\n"


def _get(path: str, headers: str = "Host: 127.0.0.1:PORT\r\n") -> bytes:
    return f"GET {path} HTTP/1.1\r\n{headers}\r\n".encode("latin-1", "replace")


def _post(path: str, body: bytes, headers: str = "Host: 127.0.0.1:PORT\r\n") -> bytes:
    return f"POST {path} HTTP/1.1\r\n{headers}Content-Length: {len(body)}\r\n\r\n".encode() + body


WEB: dict[str, bytes] = {
    "a path outside": _get("/files/RUN/../../secret.txt"),
    "a path outside, encoded": _get("/files/RUN/..%2f..%2f..%2fsecret.txt"),
    "a path outside, encoded twice": _get("/files/RUN/%252e%252e%252f%252e%252e%252fsecret.txt"),
    "an absolute path": _get("/files/RUN//etc/passwd"),
    "a run outside": _get("/files/..%2f/secret.txt"),
    "a null byte": _get("/files/RUN/run.json%00.png"),
    "a path of 60,000 characters": _get("/" + "a/" * 30_000),
    "another host": _get("/", "Host: evil.example\r\n"),
    "no host": _get("/", ""),
    "another site": _get("/", _CROSS),
    "a post from another site": _post("/_nicegui/upload", b"x" * 1000, _CROSS),
    "a WebSocket from another site": _get("/_nicegui_ws/socket.io/?transport=websocket", _CROSS + _SOCKET),
    "a body of 50 MB": _post("/sign-in", b"x" * 50_000_000),
    "a length past all bounds": _POST + b"Content-Length: " + b"9" * 40 + b"\r\n\r\n",
    "a negative length": _POST + b"Content-Length: -1\r\n\r\n",
    "chunks that are none": _POST + b"Transfer-Encoding: chunked\r\n\r\nzz\r\n" + b"x" * 99,
    "headers of 200 kB": _get("/", "Host: 127.0.0.1:PORT\r\n" + "X: " + "x" * 200_000 + "\r\n"),
    "a request that never ends": b"GET / HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\nX: ",
    "bytes": bytes(range(256)) * 100,
    "a thumbnail of what is none": _get("/thumbnails/RUN/designs/1/final.xml"),
}  # fmt: skip


def _call(tool: str, **arguments: Any) -> str:
    params = {"name": tool, "arguments": arguments}
    return json.dumps({"jsonrpc": "2.0", "id": 7, "method": "tools/call", "params": params})


_WORLD = "<mujoco><worldbody>{}</worldbody></mujoco>"
MCP: dict[str, str] = {
    "no JSON": "hello",
    "JSON of 100,000 levels": "[" * 100_000,
    "a line of 8 MB": '{"jsonrpc": "2.0", "id": 7, "method": "' + "x" * 8_000_000 + '"}',
    "an unknown method": json.dumps({"jsonrpc": "2.0", "id": 7, "method": "evil/run"}),
    "an unknown tool": _call("run_shell", command="rm -rf /"),
    "a number past all bounds": '{"jsonrpc": "2.0", "id": ' + "9" * 5000 + ', "method": "tools/list"}',
    "half of a character": '{"jsonrpc": "2.0", "id": 7, "method": "\\ud800"}',
    "arguments of other kinds": _call("validate", functional_part=3, mjcf=[1], mount={"a": 1}),
    "a file for a robot": _call("validate", mjcf="/etc/passwd", functional_part="/etc/passwd"),
    "a task outside": _call("read_task", task="../../etc/passwd"),
    "an include": _call("validate", mjcf='<mujoco><include file="/etc/passwd"/></mujoco>'),
    "entities": _call("validate", mjcf='<!DOCTYPE m [<!ENTITY a SYSTEM "file:///etc/passwd">]><mujoco>&a;</mujoco>'),
    "a million bodies": _call("validate", mjcf=_WORLD.format('<replicate count="1000000"><body/></replicate>')),
    "comments without an end": _call("validate", mjcf="<mujoco>" + "<!--" * 60_000),
    "200,000 openings": _call("validate", mjcf="<mujoco><" * 200_000),
    "numbers that are none": _call("validate", mjcf=_WORLD.format('<geom size="nan(1) 1e999"/>')),
    "a scene outside": _call("read", name="../../secret"),
    "a scene with a null byte": _call("probe", scene="a\x00b"),
    "a document of 5 MB": _call("validate", mjcf=_WORLD.format("<geom size='1'/>" * 300_000)),
    "terminal codes": _call("validate", mjcf="\x1b]0;owned\x07<mujoco/>"),
}


def tries(place: Path) -> Iterator[tuple[str, Callable[[], Outcome]]]:
    """Yield the name and the function of each try."""
    for name, request in WEB.items():
        yield f"web: {name}", partial(_web, place, name, request)
    for name, message in MCP.items():
        yield f"mcp: {name}", partial(_mcp, place, name, message)


class WebApp:
    """Web app for a folder with one run. It is started once, and again after it ended."""

    def __init__(self, place: Path) -> None:
        self.home = place / "web"
        self.runs = self.home / "runs"
        self.runs.mkdir(parents=True)
        (self.home / "secret.txt").write_text(_SECRET)
        self.run = unpack(self.runs)[0].path
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = int(free.getsockname()[1])
        self.process: subprocess.Popen[str] | None = None

    def start(self) -> None:
        """Start the app unless it is running, and wait until it answers."""
        if self.process is not None and self.process.poll() is None:
            return
        words = ("web", "--runs", str(self.runs), "--port", str(self.port), "--no-browser")
        self.process = start(self.home, words, stdout=subprocess.DEVNULL, stderr=(self.home / "log").open("a"))
        while self.answer(5.0) is None:
            assert self.process.poll() is None, (self.home / "log").read_text()

    def answer(self, wait_s: float) -> float | None:
        """Return the time until the start page is received [s]; None if it is not received within `wait_s`."""
        began_s = time.monotonic()
        while time.monotonic() < began_s + wait_s:
            with contextlib.suppress(OSError):
                urllib.request.urlopen(f"http://127.0.0.1:{self.port}/", timeout=wait_s).read()
                return time.monotonic() - began_s
            time.sleep(0.1)
        return None

    def send(self, request: bytes) -> bytes:
        """Send bytes; return the answer received until the connection closes or two seconds pass without data."""
        request = request.replace(b"PORT", str(self.port).encode()).replace(b"RUN", self.run.name.encode())
        received = b""
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 2.0) as one:
            with contextlib.suppress(OSError):
                one.sendall(request)
            while piece := one.recv(65_536):
                received += piece
        return received


_opened: dict[Path, WebApp] = {}


def _web(place: Path, name: str, request: bytes) -> Outcome:
    outcome = Outcome("requests", f"web: {name}")
    if place not in _opened:
        _opened[place] = WebApp(place)
    app = _opened[place]
    app.start()
    before = contents(app.runs)
    received = app.send(request)
    outcome.notes["answer"] = received[:40].decode("latin-1")
    took_s = app.answer(WALL_S)
    if took_s is None:
        outcome.hang = "the web app answers nothing more"
    elif took_s > 2 * LIMIT_S:
        outcome.hang = f"the next page took {took_s:.0f} s"
    if _SECRET.encode() in received or b"root:" in received:
        outcome.failed = "a foreign file was sent"
    if app.process is None or app.process.poll() is not None:
        outcome.failed = "the web app ended"
    if "Traceback" in (app.home / "log").read_text():
        outcome.failed = "traceback in its log"
        (app.home / "log").write_text("")
    if contents(app.runs) != before:
        outcome.lost = "the run changed"
    return outcome


def _mcp(place: Path, name: str, message: str) -> Outcome:
    outcome = Outcome("requests", f"mcp: {name}")
    home = place / "".join(letter if letter.isalnum() else "_" for letter in name)
    (home / "scenes").mkdir(parents=True)
    (home / "secret").write_text(_SECRET)
    process = start(home, ("mcp", "--folder", "scenes"), stdin=subprocess.PIPE)
    assert process.stdin is not None
    assert process.stdout is not None
    opening = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "a", "version": "1"}}
    said = ""
    try:
        for line in (
            json.dumps({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": opening}),
            json.dumps({"jsonrpc": "2.0", "method": "notifications/initialized"}),
            message,
            json.dumps({"jsonrpc": "2.0", "id": "after", "method": "tools/list"}),
        ):
            process.stdin.write(line.replace("\n", " ") + "\n")
            process.stdin.flush()
        said = _until(process.stdout, WALL_S / 2, '"id":"after"', *(['"id":7'] if '"tools/call"' in message else []))
    except OSError as error:
        outcome.failed = f"the server ended: {error}"
    if '"id":"after"' not in said:
        outcome.hang = "the server answers nothing more" if process.poll() is None else ""
        outcome.failed = outcome.failed or ("" if outcome.hang else "the server ended")
    end(process)
    _, errors = process.communicate()
    if _SECRET in said or "root:" in said:
        outcome.failed = "a foreign file was sent"
    if re.search(r'Error executing tool \w+:?\s*"', said) or "Traceback" in errors:
        outcome.failed = f"an error that is no sentence: {(said + errors)[-200:]}"
    outside = [name for name in contents(home) if not name.startswith(("scenes/", "settings/"))]
    if outside != ["secret"] or (home / "secret").read_text() != _SECRET:
        outcome.lost = f"files outside its folder: {outside}"
    return outcome


def _until(stream: IO[str], limit_s: float, *wanted: str) -> str:
    """Return the text of a stream, read until it contains all wanted texts, it ends, or the time limit is reached."""
    said, ends_s = b"", time.monotonic() + limit_s
    while time.monotonic() < ends_s and not all(word.encode() in said for word in wanted):
        ready, _, _ = select.select([stream], [], [], 0.5)
        piece = os.read(stream.fileno(), 2**20) if ready else None
        if piece == b"":
            break
        said += piece or b""
    return said.decode("utf-8", "replace")


def killed_tries(place: Path) -> Iterator[tuple[str, Callable[[], Outcome]]]:
    """Yield the kills of the web app and of the MCP server, and of their workers."""
    for number in range(3):
        yield f"kill parent of web {number}", partial(_killed_web, place / f"killed web {number}")
    for number in range(3):
        whom = "parent" if number % 2 else "workers"
        yield f"kill {whom} of mcp {number}", partial(_killed_mcp, place / f"killed mcp {number}", whom)


def _killed_web(place: Path) -> Outcome:
    outcome = Outcome("kills", "parent of web")
    app = WebApp(place)
    app.start()
    before = contents(app.runs)
    assert app.process is not None
    os.kill(app.process.pid, signal.SIGKILL)
    app.process.wait()
    app.start()
    if contents(app.runs) != before:
        outcome.lost = "the run changed"
    end(app.process)
    return outcome


def _killed_mcp(place: Path, whom: str) -> Outcome:
    outcome = Outcome("kills", f"{whom} of mcp")
    place.mkdir(parents=True)
    process = start(place, ("mcp", "--folder", "scenes"), stdin=subprocess.PIPE)
    assert process.stdin is not None
    assert process.stdout is not None
    opening = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "a", "version": "1"}}
    for line in (
        json.dumps({"jsonrpc": "2.0", "id": 1, "method": "initialize", "params": opening}),
        json.dumps({"jsonrpc": "2.0", "method": "notifications/initialized"}),
        _call("read_task", task="button_pushing"),
    ):
        process.stdin.write(line + "\n")
        process.stdin.flush()
    _until(process.stdout, WALL_S / 2, '"id":7')
    if whom == "parent":
        workers = workers_of(process.pid)
        os.kill(process.pid, signal.SIGKILL)
        process.communicate()
        ends_s = time.monotonic() + LIMIT_S
        while any(Path(f"/proc/{pid}").exists() for pid in workers) and time.monotonic() < ends_s:
            time.sleep(0.1)
        if any(Path(f"/proc/{pid}").exists() for pid in workers):
            outcome.failed = "its workers were left behind"
        return outcome
    for pid in workers_of(process.pid):
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    process.stdin.write(_call("validate", mjcf=_WORLD.format("")).replace(": 7", ': "again"') + "\n")
    process.stdin.flush()
    said = _until(process.stdout, WALL_S / 2, '"id":"again"')
    outcome.hang = "" if "again" in said else "no answer after its worker was killed"
    outcome.notes["said"] = said[-100:]
    end(process)
    process.communicate()
    return outcome
