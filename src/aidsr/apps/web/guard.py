"""Checks of every request to the web app, made before any page, file or WebSocket is reached.

The web app can start programs on this machine, so another site open in the same browser must not be able to use it.
Three checks prevent that: the Host must be a name of this web app (against DNS rebinding), the Origin of every request
and WebSocket must be the web app itself, and a request that the browser marks as coming from another site is refused,
unless it only opens a page. If other machines can reach the web app, a token is required as well.
"""

from __future__ import annotations

import hashlib
import hmac
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from typing import TYPE_CHECKING
from urllib.parse import parse_qs, urlsplit

from aidsr.core.numbered import is_number

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

LOOPBACK = frozenset({"127.0.0.1", "localhost", "[::1]"})
"""Host names of the loopback interface."""
MAX_BODY_BYTES = 4_000_000
"""Maximum size of a request body. Our choice: above the largest file that `aidsr.apps.web.upload` accepts."""
_SIGN_IN = "/sign-in"
_HEADERS = (
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"same-origin"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (
        b"content-security-policy",
        b"default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        b"img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self'; form-action 'self'; base-uri 'self'; "
        b"object-src 'none'; frame-ancestors 'none'",
    ),
)
"""Headers of every response. Vue needs unsafe-eval to compile its templates in the browser; nothing is loaded from
other hosts."""
_SIGN_IN_PAGE = """<!doctype html><html lang=en-US><meta charset=utf-8><title>Sign in · AID-SR</title>
<meta name=viewport content="width=device-width, initial-scale=1">
<style>:root{{color-scheme:light dark;--ink:light-dark(#1d2326,#e6e9e8);--accent:light-dark(#1c6770,#70c4cd)}}
body{{font:16px/1.5 system-ui,sans-serif;margin:20vh auto;max-width:26rem;padding:0 1rem;color:var(--ink);
background:light-dark(#f5f5f2,#13171a)}}
h1{{font-size:24px;color:var(--accent)}} p[role=alert]{{color:light-dark(#a23a2c,#f0a192);margin:.4rem 0}}
input,button{{font:inherit;padding:.5rem .7rem;width:100%;box-sizing:border-box;margin:.4rem 0;border-radius:6px;
border:1px solid light-dark(#c5c9c3,#465157);background:light-dark(#fff,#1b2024);color:inherit}}
button{{background:var(--accent);color:light-dark(#fff,#0c1a1c);font-weight:600;cursor:pointer}}</style>
<main><h1>AID-SR</h1><p>Enter the token with which <code>aidsr web</code> was started
(<code>AIDSR_WEB_TOKEN</code>).
<form method=post action=/sign-in><label for=token>Token</label>
<input id=token type=password name=token autocomplete=current-password autofocus required>{said}<button>Sign in</button>
</form></main></html>"""
"""Sign-in page with its own styles, because no stylesheet is served without the token."""
_WRONG_TOKEN = "wrong token; it was set in the terminal or the service that started this web app"


@dataclass(frozen=True)
class Refusal:
    """HTTP status and reason of a refused request."""

    status: int
    reason: str


@dataclass(frozen=True)
class Guard:
    """ASGI middleware that checks each request before the application.

    Attributes:
        app: The protected application.
        hosts: Host names, in lower case and without port, under which the web app may be reached; empty for any.
        token: Secret that a browser must have presented once; empty where none is needed.
        cookie: Name of the cookie that says so. Browsers send it to all ports of a host, so each web app has its own
            name.
    """

    app: ASGIApp
    hosts: frozenset[str] = LOOPBACK
    token: str = ""
    cookie: str = "aidsr_token"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass allowed requests on, and refuse the rest."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        refusal = self._refusal(scope, headers)
        if refusal is None and scope["type"] == "http" and scope["path"] == _SIGN_IN and self.token:
            await self._sign_in(scope, receive, send)
        elif refusal is not None:
            await _refuse(scope, receive, send, refusal)
        elif not self._knows(headers):
            await _refuse(scope, receive, send, Refusal(401, ""))
        else:
            await self.app(scope, receive, _with_headers(send))

    def _refusal(self, scope: Scope, headers: dict[str, str]) -> Refusal | None:
        host = headers.get("host", "").lower()
        if self.hosts and _name(host) not in self.hosts:
            return Refusal(
                403,
                f"this host name is not allowed; the web app can be reached only as {', '.join(sorted(self.hosts))}",
            )
        origin = headers.get("origin")
        if origin is not None and _asked_from(origin) != host:
            return Refusal(403, "a request from another site was refused")
        opened = (
            scope["type"] == "http"
            and scope["method"] == "GET"
            and headers.get("sec-fetch-mode") == "navigate"
            and headers.get("sec-fetch-dest") == "document"
        )
        if headers.get("sec-fetch-site", "none") not in ("none", "same-origin") and not opened:
            return Refusal(403, "a request from another site was refused")
        return _too_large(scope, headers)

    def _knows(self, headers: dict[str, str]) -> bool:
        if not self.token:
            return True
        try:
            cookie = SimpleCookie(headers.get("cookie", "")).get(self.cookie)
        except CookieError:
            return False
        return cookie is not None and hmac.compare_digest(cookie.value.encode(), self._mark().encode())

    def _mark(self) -> str:
        """Return the value of the cookie: a hash, because a token may contain characters that a cookie cannot."""
        return hashlib.sha256(self.token.encode()).hexdigest()

    async def _sign_in(self, scope: Scope, receive: Receive, send: Send) -> None:
        body = await _body(receive) if scope["method"] == "POST" else b""
        shown = parse_qs(body.decode("latin-1")).get("token", [""])[0]
        if not hmac.compare_digest(shown.encode(), self.token.encode()):
            await _refuse(scope, receive, send, Refusal(401, _WRONG_TOKEN if scope["method"] == "POST" else ""))
            return
        cookie = f"{self.cookie}={self._mark()}; HttpOnly; SameSite=Strict; Path=/".encode()
        await send(
            {"type": "http.response.start", "status": 303, "headers": [(b"location", b"/"), (b"set-cookie", cookie)]}
        )
        await send({"type": "http.response.body", "body": b""})


def _name(host: str) -> str:
    """Return a Host header without its port."""
    return host[: host.index("]") + 1] if host.startswith("[") and "]" in host else host.partition(":")[0]


def _asked_from(origin: str) -> str | None:
    """Return host and port of an Origin header, in lower case; None where it is not a URL."""
    try:
        return urlsplit(origin).netloc.lower()
    except ValueError:
        return None


def _too_large(scope: Scope, headers: dict[str, str]) -> Refusal | None:
    if scope["type"] != "http" or scope["method"] in ("GET", "HEAD", "OPTIONS"):
        return None
    length = headers.get("content-length")
    if length is None:
        return None if "transfer-encoding" not in headers else Refusal(411, "Content-Length required")
    if not is_number(length) or int(length) > MAX_BODY_BYTES:
        return Refusal(413, f"the request is too large; at most {MAX_BODY_BYTES} bytes are allowed")
    return None


async def _body(receive: Receive) -> bytes:
    content = b""
    while True:
        message = await receive()
        content += bytes(message.get("body", b""))
        if not message.get("more_body", False) or len(content) > MAX_BODY_BYTES:
            return content


async def _refuse(scope: Scope, receive: Receive, send: Send, refusal: Refusal) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": refusal.reason})
        return
    asks = refusal.status == 401
    said = f"<p role=alert>{refusal.reason}</p>" if refusal.reason else ""
    page = _SIGN_IN_PAGE.format(said=said) if asks else refusal.reason
    kind = b"text/html; charset=utf-8" if asks else b"text/plain; charset=utf-8"
    answer = _with_headers(send)
    await answer({"type": "http.response.start", "status": refusal.status, "headers": [(b"content-type", kind)]})
    await answer({"type": "http.response.body", "body": page.encode()})


def _with_headers(send: Send) -> Send:
    async def answer(message: Message) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", []), *_HEADERS]}
        await send(message)

    return answer
