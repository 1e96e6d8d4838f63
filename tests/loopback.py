"""A language model provider on this machine, scripted: what it answers, and every way it can fail.

It speaks the wire formats of OpenAI (Chat Completions and Responses), Anthropic (Messages) and Google
(generateContent), whichever a request's path asks for, and keeps every request as it arrived.
"""

from __future__ import annotations

import contextlib
import json
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any


@dataclass(frozen=True)
class Say:
    """A reply in words."""

    text: str
    finish: str = "stop"
    input_tokens: int = 100
    output_tokens: int = 20
    cached_tokens: int = 0
    cost_usd: float | None = None
    """What a router reports; providers themselves report no cost."""
    counted: bool = True
    """Whether tokens are reported at all; some servers of one's own report none."""
    calls: tuple[tuple[str, dict[str, Any]], ...] = ()
    """Tools that are called after the text: name and arguments; their ids are "call_1", "call_2" …"""


@dataclass(frozen=True)
class Fail:
    """An HTTP error."""

    status: int
    message: str = "no luck"
    headers: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Raw:
    """A reply with any bytes for a body."""

    body: bytes
    content_type: str = "application/json"


class Hang:
    """No reply until the server closes."""


class Drop:
    """The connection closes without a reply."""


@dataclass(frozen=True)
class Cut:
    """Half of a reply; then the connection closes."""

    say: Say
    meanwhile: Callable[[], None] = lambda: None
    """Done when half of the reply is on its way."""


@dataclass(frozen=True)
class Serve:
    """Any response, piece by piece, as fast as the pieces come; its end is the end of the connection."""

    pieces: Callable[[], Iterable[bytes]]
    status: int = 200
    headers: dict[str, str] = field(default_factory=dict)


Act = Say | Fail | Raw | Hang | Drop | Cut | Serve


@dataclass(frozen=True)
class Received:
    """A request as it arrived."""

    path: str
    headers: dict[str, str]
    body: dict[str, Any]


class Loopback:
    """The server; a context manager.

    Args:
        script: What to do with each request, in order; or a function of the request, called in several threads.
    """

    def __init__(self, script: Iterable[Act] | Callable[[Received], Act]) -> None:
        self.requests: list[Received] = []
        self.sent: list[str] = []
        """Texts of all replies that were sent to their last byte."""
        self._answer = script if callable(script) else _in_order(list(script))
        self._closing = threading.Event()
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(self))
        self._server.daemon_threads = True
        self.url = f"http://127.0.0.1:{self._server.server_port}"

    def __enter__(self) -> Loopback:
        threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closing.set()
        self._server.shutdown()
        self._server.server_close()

    def act(self, received: Received) -> Act:
        self.requests.append(received)
        return self._answer(received)

    def is_closing(self) -> bool:
        return self._closing.is_set()

    def wait_for_closing(self) -> None:
        self._closing.wait()


def _in_order(acts: list[Act]) -> Callable[[Received], Act]:
    def next_act(_: Received) -> Act:
        return acts.pop(0) if acts else Fail(418, "the script has no further reply")

    return next_act


def _handler(loopback: Loopback) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            act = loopback.act(Received(self.path, {k.lower(): v for k, v in self.headers.items()}, body))
            match act:
                case Say():
                    self._send(200, json.dumps(reply_of(self.path, act)).encode())
                    loopback.sent.append(act.text)
                case Fail():
                    self._send(act.status, json.dumps({"error": {"message": act.message}}).encode(), act.headers)
                case Raw():
                    self._send(200, act.body, {"Content-Type": act.content_type})
                case Hang():
                    loopback.wait_for_closing()
                case Drop():
                    self.close_connection = True
                case Cut():
                    body = json.dumps(reply_of(self.path, act.say)).encode()
                    self._send(200, body[: len(body) // 2], length=len(body))
                    act.meanwhile()
                    self.close_connection = True
                case Serve():
                    self._serve(act)

        def _serve(self, act: Serve) -> None:
            self.close_connection = True
            self.send_response(act.status)
            for key, value in ({"Content-Type": "application/json"} | act.headers).items():
                self.send_header(key, value)
            self.end_headers()
            with contextlib.suppress(ConnectionError):
                for piece in act.pieces():
                    if loopback.is_closing():
                        break
                    self.wfile.write(piece)
                    self.wfile.flush()

        def _send(
            self, status: int, body: bytes, headers: dict[str, str] | None = None, length: int | None = None
        ) -> None:
            self.send_response(status)
            for key, value in ({"Content-Type": "application/json"} | (headers or {})).items():
                self.send_header(key, value)
            self.send_header("Content-Length", str(len(body) if length is None else length))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            pass

    return Handler


def reply_of(path: str, say: Say) -> dict[str, Any]:
    """Return a reply in the wire format that belongs to a path."""
    shape = _counted_shape(path, say)
    return shape if say.counted else {key: value for key, value in shape.items() if not key.startswith("usage")}


def _counted_shape(path: str, say: Say) -> dict[str, Any]:
    if path.endswith("/chat/completions"):
        return _chat_completion(say)
    if path.endswith("/responses"):
        return _response(say)
    if path.split("?", maxsplit=1)[0].endswith("/messages"):
        return _anthropic_message(say)
    return _generated_content(say)


def _with_ids(say: Say) -> list[tuple[str, str, dict[str, Any]]]:
    return [(f"call_{number}", name, arguments) for number, (name, arguments) in enumerate(say.calls, 1)]


def _chat_completion(say: Say) -> dict[str, Any]:
    message: dict[str, Any] = {"role": "assistant", "content": say.text}
    finish = "tool_calls" if say.calls else say.finish
    if say.calls:
        message["tool_calls"] = [
            {"id": identity, "type": "function", "function": {"name": name, "arguments": json.dumps(arguments)}}
            for identity, name, arguments in _with_ids(say)
        ]
    if finish == "refusal":
        message, finish = {"role": "assistant", "content": None, "refusal": say.text}, "stop"
    return {
        "id": "chatcmpl-1",
        "object": "chat.completion",
        "created": 1,
        "model": "loop-1",
        "provider": "Loopback",
        "choices": [{"index": 0, "message": message, "finish_reason": finish, "native_finish_reason": finish}],
        "usage": {
            "prompt_tokens": say.input_tokens,
            "completion_tokens": say.output_tokens,
            "total_tokens": say.input_tokens + say.output_tokens,
            "prompt_tokens_details": {"cached_tokens": say.cached_tokens},
            **({"cost": say.cost_usd} if say.cost_usd is not None else {}),
        },
    }


def _response(say: Say) -> dict[str, Any]:
    content: dict[str, Any] = {"type": "output_text", "text": say.text, "annotations": []}
    if say.finish == "refusal":
        content = {"type": "refusal", "refusal": say.text}
    cut = say.finish == "length"
    calls = [
        {
            "id": f"fc_{identity}",
            "type": "function_call",
            "call_id": identity,
            "name": name,
            "arguments": json.dumps(arguments),
            "status": "completed",
        }
        for identity, name, arguments in _with_ids(say)
    ]
    return {
        "id": "resp_1",
        "object": "response",
        "created_at": 1,
        "model": "loop-1",
        "status": "incomplete" if cut else "completed",
        "incomplete_details": {"reason": "max_output_tokens"} if cut else None,
        "output": [
            {"id": "msg_1", "type": "message", "role": "assistant", "status": "completed", "content": [content]},
            *calls,
        ],
        "parallel_tool_calls": True,
        "tool_choice": "auto",
        "tools": [],
        "usage": {
            "input_tokens": say.input_tokens,
            "input_tokens_details": {"cached_tokens": say.cached_tokens},
            "output_tokens": say.output_tokens,
            "output_tokens_details": {"reasoning_tokens": 0},
            "total_tokens": say.input_tokens + say.output_tokens,
        },
    }


def _anthropic_message(say: Say) -> dict[str, Any]:
    reasons = {"stop": "end_turn", "length": "max_tokens", "refusal": "refusal"}
    return {
        "id": "msg_1",
        "type": "message",
        "role": "assistant",
        "model": "loop-1",
        "content": [
            *([{"type": "text", "text": say.text}] if say.text else []),
            *(
                {"type": "tool_use", "id": identity, "name": name, "input": arguments}
                for identity, name, arguments in _with_ids(say)
            ),
        ],
        "stop_reason": "tool_use" if say.calls else reasons[say.finish],
        "stop_sequence": None,
        "usage": {
            "input_tokens": say.input_tokens - say.cached_tokens,
            "cache_read_input_tokens": say.cached_tokens,
            "cache_creation_input_tokens": 0,
            "output_tokens": say.output_tokens,
        },
    }


def _generated_content(say: Say) -> dict[str, Any]:
    reasons = {"stop": "STOP", "length": "MAX_TOKENS", "refusal": "SAFETY"}
    return {
        "responseId": "r1",
        "modelVersion": "loop-1",
        "candidates": [
            {
                "index": 0,
                "content": {
                    "role": "model",
                    "parts": [
                        {"text": say.text},
                        *({"functionCall": {"name": name, "args": arguments}} for name, arguments in say.calls),
                    ],
                },
                "finishReason": reasons[say.finish],
            }
        ],
        "usageMetadata": {
            "promptTokenCount": say.input_tokens,
            "candidatesTokenCount": say.output_tokens,
            "cachedContentTokenCount": say.cached_tokens,
            "totalTokenCount": say.input_tokens + say.output_tokens,
        },
    }
