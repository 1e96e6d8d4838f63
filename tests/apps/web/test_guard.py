"""Who may ask the page: hosts, origins, other sites, tokens, sizes."""

import asyncio
from typing import Any
from urllib.parse import urlencode

import pytest

from aidsr.apps.web.guard import MAX_BODY_BYTES, Guard

OWN = "127.0.0.1:8080"


async def reached(scope: Any, receive: Any, send: Any) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
    else:
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b"inside"})


def ask(
    guard: Guard,
    headers: dict[str, str],
    *,
    kind: str = "http",
    method: str = "GET",
    path: str = "/",
    body: bytes = b"",
) -> list[dict[str, Any]]:
    """Return what the guard, or what is behind it, answers."""
    sent: list[dict[str, Any]] = []

    async def send(message: Any) -> None:
        sent.append(message)

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": body, "more_body": False}

    pairs = [(name.encode(), value.encode()) for name, value in headers.items()]
    asyncio.run(guard({"type": kind, "method": method, "path": path, "headers": pairs}, receive, send))
    return sent


def status(guard: Guard, headers: dict[str, str], **more: Any) -> int:
    return ask(guard, headers, **more)[0]["status"]


GUARD = Guard(reached)


@pytest.mark.parametrize("host", ["127.0.0.1:8080", "localhost:9", "LOCALHOST", "[::1]:8080"])
def test_the_page_answers_under_its_own_names(host: str) -> None:
    assert status(GUARD, {"host": host}) == 200


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8080", "127.0.0.1.evil.example", "", "192.168.1.5:8080"]
)
def test_another_host_is_refused(host: str) -> None:
    assert status(GUARD, {"host": host}) == 403
    assert ask(GUARD, {"host": host}, kind="websocket")[0]["type"] == "websocket.close"


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example", "null", "http://127.0.0.1:9999", "https://127.0.0.1.evil.example:8080", "file://",
        "http://[::1",
    ],
)  # fmt: skip
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_a_foreign_origin_is_refused(origin: str, method: str) -> None:
    assert status(GUARD, {"host": OWN, "origin": origin}, method=method) == 403
    closed = ask(GUARD, {"host": OWN, "origin": origin}, kind="websocket")[0]
    assert (closed["type"], closed["code"]) == ("websocket.close", 1008)


def test_the_own_origin_passes() -> None:
    headers = {"host": OWN, "origin": f"http://{OWN}"}
    assert status(GUARD, headers, method="POST") == 200
    assert ask(GUARD, headers, kind="websocket")[0]["type"] == "websocket.accept"


def test_what_a_browser_marks_as_from_another_site_is_refused_unless_a_person_follows_a_link() -> None:
    assert status(GUARD, {"host": OWN, "sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"}) == 403
    assert status(GUARD, {"host": OWN, "sec-fetch-site": "same-site", "sec-fetch-mode": "cors"}) == 403
    followed = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"}
    assert status(GUARD, {"host": OWN, **followed}) == 200
    assert status(GUARD, {"host": OWN, **followed}, method="POST") == 403
    assert status(GUARD, {"host": OWN, **followed, "sec-fetch-dest": "iframe"}) == 403


def test_bodies_are_bounded() -> None:
    own = {"host": OWN, "origin": f"http://{OWN}"}
    assert status(GUARD, {**own, "content-length": str(MAX_BODY_BYTES)}, method="POST") == 200
    assert status(GUARD, {**own, "content-length": str(MAX_BODY_BYTES + 1)}, method="POST") == 413
    assert status(GUARD, {**own, "content-length": "-1"}, method="POST") == 413
    assert status(GUARD, {**own, "transfer-encoding": "chunked"}, method="POST") == 411


def test_every_answer_forbids_frames_and_foreign_scripts() -> None:
    for host in (OWN, "evil.example"):
        headers = dict(ask(GUARD, {"host": host})[0]["headers"])
        assert b"frame-ancestors 'none'" in headers[b"content-security-policy"]
        assert headers[b"x-content-type-options"] == b"nosniff"


def test_a_token_is_asked_for_once_and_kept_in_a_cookie() -> None:
    guard = Guard(reached, hosts=frozenset(), token="correct-horse-battery")
    assert status(guard, {"host": "lab.example"}) == 401
    assert ask(guard, {"host": "lab.example"}, kind="websocket")[0]["type"] == "websocket.close"
    wrong = {"host": "lab.example", "cookie": "aidsr_token=wrong"}
    assert status(guard, wrong) == 401
    assert status(guard, {"host": "lab.example"}, method="POST", path="/sign-in", body=b"token=wrong") == 401
    signed_in = ask(
        guard, {"host": "lab.example"}, method="POST", path="/sign-in", body=b"token=correct-horse-battery"
    )[0]
    assert signed_in["status"] == 303
    cookie = dict(signed_in["headers"])[b"set-cookie"].decode()
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    assert status(guard, {"host": "lab.example", "cookie": cookie.partition(";")[0]}) == 200


def test_two_web_apps_of_one_host_have_cookies_of_their_own() -> None:
    token = "correct-horse-battery"
    guards = [Guard(reached, hosts=frozenset(), token=token, cookie=f"aidsr_token_{name}") for name in ("a", "b")]
    host = {"host": "lab.example"}
    cookies = [
        dict(ask(guard, host, method="POST", path="/sign-in", body=f"token={token}".encode())[0]["headers"])[
            b"set-cookie"
        ].decode()
        for guard in guards
    ]
    assert [cookie.partition("=")[0] for cookie in cookies] == ["aidsr_token_a", "aidsr_token_b"]
    both = "; ".join(cookie.partition(";")[0] for cookie in cookies)
    assert [status(guard, {**host, "cookie": both}) for guard in guards] == [200, 200]


@pytest.mark.parametrize(
    "token",
    [
        "correct-horse-battery",
        "correct horse battery staple",
        'with;"quotes",and\\more',
        "100 % sure + more",
        "ключ-Straße-鍵-0123",
    ],
)
def test_any_characters_can_be_a_token(token: str) -> None:
    guard, host = Guard(reached, hosts=frozenset(), token=token), {"host": "lab.example"}
    for said, answered in ((f"{token}!", 401), (token, 303)):
        body = urlencode({"token": said}).encode()
        signed_in = ask(guard, host, method="POST", path="/sign-in", body=body)[0]
        assert signed_in["status"] == answered
    cookie = dict(signed_in["headers"])[b"set-cookie"].decode("ascii").partition(";")[0]
    assert token not in cookie
    assert status(guard, {**host, "cookie": cookie}) == 200
    assert status(guard, host, method="POST", path="/sign-in", body=b"token=\xff\xfe") == 401


def test_what_is_no_request_passes() -> None:
    scopes: list[str] = []

    async def inside(scope: Any, receive: Any, send: Any) -> None:
        scopes.append(scope["type"])

    asyncio.run(Guard(inside)({"type": "lifespan"}, None, None))  # type: ignore[arg-type]
    assert scopes == ["lifespan"]
