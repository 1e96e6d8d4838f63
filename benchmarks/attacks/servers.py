"""A hostile or broken server of a language model, which answers a whole design run of one concept."""

from __future__ import annotations

import gzip
import itertools
import json
import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.attacks.tries import Outcome, contents, environment, run

from loopback import Act, Cut, Drop, Fail, Hang, Loopback, Raw, Received, Say, Serve

KEY = "sk-attack-0123456789abcdef"
_PATIENCE = {"AIDSR_ATTEMPTS": "2", "AIDSR_ATTEMPT_TIMEOUT_S": "2", "AIDSR_DEADLINE_S": "6", "AIDSR_FIRST_WAIT_S": "0"}
_JSON = {"Content-Type": "application/json"}


def _chat(**changes: Any) -> bytes:
    """Return a reply of the Chat Completions API with some fields replaced."""
    reply: dict[str, Any] = {
        "id": "c", "object": "chat.completion", "created": 1, "model": "m",
        "choices": [{"index": 0, "message": {"role": "assistant", "content": "hello"}, "finish_reason": "stop"}],
        "usage": {"prompt_tokens": 1, "completion_tokens": 1, "total_tokens": 2},
    }  # fmt: skip
    return json.dumps({**reply, **changes}).encode()


def _choice(**message: Any) -> bytes:
    whole = {"role": "assistant", "content": "x", **message}
    return _chat(choices=[{"index": 0, "message": whole, "finish_reason": "stop"}])


def _usage(tokens: Any) -> bytes:
    return _chat(usage={"prompt_tokens": tokens, "completion_tokens": tokens, "total_tokens": tokens})


def _slowly(piece: bytes, pause_s: float, count: int) -> Iterator[bytes]:
    for _ in range(count):
        yield piece
        time.sleep(pause_s)


def _bomb(size: int, layers: int = 1) -> bytes:
    packed = b"0" * size
    for _ in range(layers):
        packed = gzip.compress(packed)
    return packed


def _serve(pieces: Callable[[], Iterable[bytes]], status: int = 200, **headers: str) -> Serve:
    return Serve(pieces, status, {**_JSON, **{name.replace("_", "-"): value for name, value in headers.items()}})


def _say(text: str, **more: Any) -> Say:
    return Say(text, **more)


MODES: dict[str, Callable[[str], Act]] = {
    # errors
    **{f"status {status}": partial(lambda status, _url: Fail(status), status)
       for status in (400, 401, 402, 403, 404, 408, 409, 413, 418, 422, 425, 429, 500, 502, 503, 504, 529, 599)},
    "429 for a year": lambda _: Fail(429, headers={"Retry-After": "31536000"}),
    "429 with a hostile Retry-After": lambda _: Fail(429, headers={"Retry-After": "-1e999"}),
    "an error that repeats the key": lambda _: Fail(400, f"your key {KEY} is bad"),
    "an error with terminal codes": lambda _: Fail(400, "\x1b]0;owned\x07\x1b[2J"),
    "an error of a megabyte": lambda _: Fail(500, "x" * 2**20),
    # redirects
    "redirect to itself": lambda url: _serve(lambda: [], 302, Location=f"{url}/v1/chat/completions"),
    "redirect to another host": lambda _: _serve(lambda: [], 307, Location="http://127.0.0.2:9/v1"),
    "redirect to a file": lambda _: _serve(lambda: [], 301, Location="file:///etc/passwd"),
    # nothing, or half
    "no reply": lambda _: Hang(),
    "connection dropped": lambda _: Drop(),
    "half a reply": lambda _: Cut(Say("half")),
    "an empty body": lambda _: Raw(b""),
    "a body of spaces": lambda _: Raw(b" " * 100_000),
    "null": lambda _: Raw(b"null"),
    "a number": lambda _: Raw(b"3"),
    "a list": lambda _: Raw(b"[]"),
    "an empty object": lambda _: Raw(b"{}"),
    # wrong kinds
    "bytes": lambda _: Raw(bytes(range(256)) * 100),
    "HTML": lambda _: Raw(b"<html><script>alert(1)</script></html>", "text/html"),
    "a picture": lambda _: Raw(b"\x89PNG\r\n\x1a\n" + b"\0" * 1000, "image/png"),
    "JSON in UTF-16": lambda _: Raw(_chat().decode().encode("utf-16")),
    "JSON of 5,000 levels": lambda _: Raw(b'{"choices":' + b"[" * 5000 + b"]" * 5000 + b"}"),
    "an event stream": lambda _: Raw(b'data: {"x": 1}\n\n' * 1000, "text/event-stream"),
    # much
    "a gzip bomb of 100 MB": lambda _: _serve(lambda: [_bomb(100 * 2**20)], Content_Encoding="gzip"),
    "a gzip bomb in a gzip bomb": lambda _: _serve(lambda: [_bomb(50 * 2**20, 2)], Content_Encoding="gzip"),
    "gzip that is none": lambda _: _serve(lambda: [b"not packed"], Content_Encoding="gzip"),
    "an unknown encoding": lambda _: _serve(lambda: [_chat()], Content_Encoding="zstd, br, x"),
    "bytes without end": lambda _: _serve(lambda: itertools.repeat(b"0" * 65_536)),
    "a byte a second": lambda _: _serve(lambda: _slowly(b"{", 0.5, 60)),
    "a huge header": lambda _: _serve(lambda: [_chat()], X_Large="x" * 60_000),
    "a thousand headers": lambda _: _serve(lambda: [_chat()], **{f"X_{number}": "x" for number in range(1000)}),
    "a text of 4 MB": lambda _: _say("x" * 4_000_000),
    "a text of 15 MB": lambda _: _say("y " * 7_500_000),
    # lies
    "tokens past all bounds": lambda _: Raw(_usage(10**400)),
    "negative tokens": lambda _: Raw(_usage(-5)),
    "tokens as text": lambda _: Raw(_usage("many")),
    "a cost past all bounds": lambda _: _say("x", cost_usd=1e300),
    "the key in a good reply": lambda _: _say(f"here is {KEY} again"),
    "half of a character": lambda _: _say("\ud800 x"),
    "no choices": lambda _: Raw(_chat(choices=[])),
    "choices of other kinds": lambda _: Raw(_chat(choices={"a": 1})),
    "a tool call": lambda _: Raw(_choice(tool_calls=[{"id": "1", "type": "function",
                                                      "function": {"name": "os.system", "arguments": "rm"}}])),
    "content that is a list": lambda _: Raw(_choice(content=[{"type": "text", "text": "x"}])),
    "openings without an end": lambda _: _say("<mujoco><" * 60_000),
    "objects without an end": lambda _: _say("{}\n" * 120_000),
}  # fmt: skip


def tries(place: Path) -> Iterator[tuple[str, Callable[[], Outcome]]]:
    """Yield the name and the function of each try."""
    for name, mode in MODES.items():
        yield f"server: {name}", partial(_attempt, place, name, mode)


def _attempt(place: Path, name: str, mode: Callable[[str], Act]) -> Outcome:
    outcome = Outcome("servers", name)
    home = place / "".join(letter if letter.isalnum() else "_" for letter in name)
    home.mkdir(parents=True)
    url: list[str] = []

    def answer(_received: Received) -> Act:
        return mode(url[0])

    with Loopback(answer) as server:
        url.append(server.url)
        env = environment(home, **_PATIENCE, OPENAI_COMPATIBLE_API_KEY=KEY, OPENAI_API_KEY=KEY)
        env["OPENAI_BASE_URL"] = f"{server.url}/v1"
        ended = run(home, "design", "--task", "button_pushing", "--concepts", "1", "--model", "openai:gpt-5", env=env)
        outcome.notes = {"code": ended.code, "requests": len(server.requests), "cpu_s": round(ended.cpu_s, 1)}
    outcome.hang, outcome.failed = ended.problem()
    kept = [path for path in contents(home) if KEY.encode() in (home / path).read_bytes()]
    if KEY in ended.out + ended.error or kept:
        outcome.failed = f"the key is in {kept or 'the output'}"
    if any(code in ended.out + ended.error for code in "\x1b\x07\x9b"):
        outcome.failed = "terminal codes in the output"
    if not list(home.glob("runs/*/run.json")):
        outcome.lost = "the run"
    return outcome
