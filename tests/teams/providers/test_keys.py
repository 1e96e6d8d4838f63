"""A key must never be seen: not in a repr, a record, an error, its causes, or a log."""

from __future__ import annotations

import logging
import traceback
from dataclasses import asdict

import pytest

from aidsr.core.calls import Message, Question
from aidsr.core.errors import AidsrError, UserError
from aidsr.teams.providers import RetryPolicy, connect
from aidsr.teams.providers.client_errors import translate_error
from aidsr.teams.providers.openai import OPENAI
from aidsr.teams.providers.remote import RemoteModel
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
        environ = {f"{name}_API_KEY": CANARY for name in ("OPENAI", "ANTHROPIC", "GOOGLE", "OPENROUTER", "AIDSR")}
        environ |= {f"{name}_BASE_URL": f"{server.url}/v1" for name in ("OPENAI", "OPENROUTER")}
        environ |= {f"{name}_BASE_URL": server.url for name in ("ANTHROPIC", "GOOGLE")}
        name = f"m@{server.url}/v1" if provider == "url" else provider
        model = connect(name, environ=environ, retry=RetryPolicy(attempts=2), clock=fake_clock.clock())
        assert isinstance(model, RemoteModel)
        seen = [repr(model), str(model), repr(model.endpoint), str(asdict(model.endpoint))]
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
    with pytest.raises(UserError, match="OPENAI_API_KEY cannot be sent") as caught:
        OPENAI.key({"OPENAI_API_KEY": key})
    assert key not in "".join(traceback.format_exception(caught.value))


def test_a_bug_keeps_its_traceback_unless_it_shows_the_key() -> None:
    harmless, telling = TypeError("oops"), TypeError(f"oops {CANARY}")
    assert translate_error(harmless, "m", "KEY", (CANARY,)) is harmless
    assert CANARY not in repr(translate_error(telling, "m", "KEY", (CANARY,)))


def test_the_longest_key_is_redacted_first() -> None:
    environ = {"OPENAI_API_KEY": "sk-abc", "ANTHROPIC_API_KEY": "sk-abc-and-more"}
    model = connect("openai:m", environ=environ)
    assert isinstance(model, RemoteModel)
    assert [key.get_secret_value() for key in model.endpoint.secrets] == ["sk-abc-and-more", "sk-abc"]
