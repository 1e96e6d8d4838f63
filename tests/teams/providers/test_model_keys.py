"""A key must never be seen: not in a repr, a record, an error, its causes, or a log."""

from __future__ import annotations

import logging
import traceback

import pytest

from aidsr.core.calls import Message, Question
from aidsr.core.errors import AidsrError, UserError
from aidsr.teams.providers import Access, Patience, connect
from aidsr.teams.providers.failures import explain
from fake_clock import FakeClock
from loopback import Act, Drop, Fail, Loopback, Say

CANARY = "sk-canary-9d1f27c6e8"
QUESTION = Question(role="designer", messages=(Message(role="user", text="well?"),))


@pytest.fixture
def fake_clock() -> FakeClock:
    return FakeClock()


@pytest.mark.parametrize("provider", ["openai:m", "openai-chat:m", "anthropic:m", "google:m", "openrouter:v/m", "url"])
@pytest.mark.parametrize(
    "script",
    [
        pytest.param((Say("ok"),), id="success"),
        pytest.param((Fail(500, f"echo {CANARY}"), Say("ok")), id="retried"),
        pytest.param((Fail(400, f"your key {CANARY} is odd"),), id="rejected"),
        pytest.param((Fail(401, f"Incorrect API key provided: {CANARY}"),), id="refused"),
        pytest.param((Drop(), Drop()), id="dropped"),
    ],
)
def test_no_key_comes_out(
    provider: str, script: tuple[Act, ...], fake_clock: FakeClock, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.DEBUG), Loopback(script) as server:
        access = Access(
            openai_api_key=CANARY, anthropic_api_key=CANARY, google_api_key=CANARY, openrouter_api_key=CANARY,
            aidsr_api_key=CANARY, openai_base_url=f"{server.url}/v1", anthropic_base_url=server.url,
            google_base_url=server.url, openrouter_base_url=f"{server.url}/v1",
        )  # fmt: skip
        name = f"m@{server.url}/v1" if provider == "url" else provider
        model = connect(name, access=access, patience=Patience(attempts=2), clock=fake_clock.clock())
        seen = [repr(model), str(model), repr(access), repr(access.model_dump()), access.model_dump_json()]
        raised: BaseException | None = None
        try:
            seen.append(model.ask(QUESTION).model_dump_json())
        except AidsrError as error:
            raised = error
    while raised is not None:
        seen.append("".join(traceback.format_exception(raised)))
        raised = raised.__cause__ or raised.__context__
    assert any(CANARY in " ".join(request.headers.values()) for request in server.requests), "the key was not sent"
    assert CANARY not in "\n".join(seen)
    assert CANARY not in caplog.text


@pytest.mark.parametrize("key", ["sk-two\nlines", "sk two words", "sk-ünïcode", "sk-\x00"])
def test_a_key_that_cannot_be_sent_is_refused_unseen(key: str) -> None:
    with pytest.raises(UserError, match="cannot be sent") as caught:
        Access(openai_api_key=key)
    assert key not in "".join(traceback.format_exception(caught.value))


def test_a_bug_keeps_its_traceback_unless_it_shows_the_key() -> None:
    harmless, telling = TypeError("oops"), TypeError(f"oops {CANARY}")
    assert explain(harmless, "m", "KEY", (CANARY,)) is harmless
    assert CANARY not in repr(explain(telling, "m", "KEY", (CANARY,)))


def test_the_longest_key_is_wiped_first() -> None:
    access = Access(openai_api_key="sk-abc", anthropic_api_key="sk-abc-and-more")
    assert access.keys()[:2] == ("sk-abc-and-more", "sk-abc")
