"""What a hostile or broken server may do: send too much, too slowly, too little, or the key back."""

from __future__ import annotations

import gzip
import itertools
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from test_remote import NAMES, loop_model

from aidsr.core.calls import CallRecord, Message, Question
from aidsr.core.errors import ModelError
from aidsr.runs.answered_calls import calls_in
from aidsr.runs.recorded_model import RecordedModel
from aidsr.teams.providers import RetryPolicy, connect
from aidsr.teams.providers.wire import Exchange, amount, token_count
from fake_clock import FakeClock
from loopback import Act, Cut, Fail, Loopback, Raw, Say, Serve

QUESTION = Question(role="judge", messages=(Message(role="user", text="well?" * 60),))
CANARY = "sk-canary-9d1f27c6e8"


def ask(*script: Act, **policy: float) -> CallRecord:
    with Loopback(script) as server:
        model = connect(
            f"m@{server.url}/v1",
            environ={"AIDSR_API_KEY": CANARY},
            retry=RetryPolicy(**policy),
            clock=FakeClock().clock(),
        )
        return model.ask(QUESTION)


def gzipped(size: int) -> Serve:
    content = gzip.compress(b" " * size)
    return Serve(lambda: [content], headers={"Content-Encoding": "gzip"})


@pytest.mark.parametrize("name", NAMES)
def test_a_reply_is_read_up_to_a_limit_whatever_it_unpacks_to(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AIDSR_ATTEMPTS", "1")
    with Loopback([gzipped(17 * 2**20)]) as server, pytest.raises(ModelError, match="has more than 16 MiB"):
        loop_model(name, server).ask(QUESTION)


def test_a_stream_without_end_is_cut_off_by_its_size() -> None:
    with pytest.raises(ModelError, match="has more than 16 MiB"):
        ask(Serve(lambda: itertools.repeat(b" " * 65536)), attempts=1)


def test_a_stream_without_end_is_cut_off_by_its_time() -> None:
    def drip() -> Iterator[bytes]:
        while True:
            yield b" "
            time.sleep(0.05)

    with pytest.raises(ModelError, match="no reply in time"):
        ask(Serve(drip), attempts=1, attempt_timeout_s=0.5)


@pytest.mark.parametrize("status", [301, 302, 307, 308])
@pytest.mark.parametrize("name", NAMES)
def test_no_redirect_takes_the_key_to_another_host(name: str, status: int) -> None:
    with Loopback([Say("stolen")]) as other:
        away = Fail(status, headers={"Location": f"{other.url}/v1/chat/completions"})
        with Loopback([away]) as server, pytest.raises(ModelError):
            loop_model(name, server, FakeClock().clock()).ask(QUESTION)
        assert other.requests == []


@pytest.mark.parametrize("name", NAMES)
def test_a_key_in_a_good_reply_is_not_recorded(name: str) -> None:
    with Loopback([Say(f"Your key is {CANARY}, and sk-loop.")]) as server:
        environ = {f"{each}_API_KEY": CANARY for each in ("OPENAI", "ANTHROPIC", "GOOGLE", "OPENROUTER", "AIDSR")}
        environ |= {f"{each}_BASE_URL": f"{server.url}/v1" for each in ("OPENAI", "OPENROUTER", "OLLAMA")}
        environ |= {f"{each}_BASE_URL": server.url for each in ("ANTHROPIC", "GOOGLE")}
        record = connect(name.replace("LOOPBACK", f"{server.url}/v1"), environ=environ).ask(QUESTION)
    assert record.reply == "Your key is ***, and sk-loop."


def unreadable(**usage: Any) -> Raw:
    return Raw(json.dumps({"id": "1", "object": "chat.completion", "choices": [], "usage": usage}).encode())


def test_tokens_of_replies_that_cannot_be_read_are_counted() -> None:
    record = ask(
        unreadable(prompt_tokens=1000, completion_tokens=300),
        Raw(b"<html>gateway</html>"),
        Say("ok", input_tokens=1000, output_tokens=20),
    )
    assert [attempt.usage.output_tokens for attempt in record.failed_attempts] == [300, 0]
    usage = record.usage
    assert (usage.input_tokens, usage.output_tokens, usage.calls, usage.retries) == (2000, 320, 1, 2)
    assert not usage.tokens_estimated


@pytest.mark.parametrize(
    ("usage", "counted"),
    [
        (
            {
                "usage": {
                    "input_tokens": 10,
                    "cache_read_input_tokens": 500,
                    "cache_creation_input_tokens": 16_000,
                    "output_tokens": 900,
                }
            },
            (16_510, 900),
        ),
        (
            {"usageMetadata": {"promptTokenCount": 15_000, "candidatesTokenCount": 300, "thoughtsTokenCount": 9000}},
            (15_000, 9300),
        ),
        (
            {"usage": {"prompt_tokens": 16_510, "cache_creation_input_tokens": 16_000, "completion_tokens": 900}},
            (16_510, 900),
        ),
    ],
)
def test_the_cached_prompt_and_the_reasoning_are_counted(usage: dict[str, Any], counted: tuple[int, int]) -> None:
    assert Exchange(status=200, body=json.dumps(usage).encode()).reported_tokens() == counted


def test_tokens_of_a_reply_that_is_cut_off_are_estimated() -> None:
    record = ask(Cut(Say("word " * 600)), Say("ok", input_tokens=100, output_tokens=20))
    (failed,) = record.failed_attempts
    assert failed.usage.tokens_estimated
    assert failed.usage.input_tokens == 100
    assert 500 < failed.usage.output_tokens < 1000
    assert record.usage.input_tokens == 200


def test_a_call_that_never_succeeded_is_kept_on_record_with_each_attempt(tmp_path: Path) -> None:
    script = [unreadable(prompt_tokens=1000, completion_tokens=300), Fail(503, "busy"), Say("ok")]
    with Loopback(script) as server:
        model = connect(f"m@{server.url}/v1", environ={}, retry=RetryPolicy(attempts=2), clock=FakeClock().clock())
        with pytest.raises(ModelError, match="gave no reply in 2 attempts"):
            RecordedModel(model, tmp_path).ask(QUESTION)
        assert RecordedModel(model, tmp_path).ask(QUESTION).reply == "ok"
    failed, answered = calls_in(tmp_path)
    assert (failed.finish, failed.usage.input_tokens, failed.usage.retries) == ("failed", 1000, 1)
    assert failed.failed_attempts[1].error == "HTTP 503: busy"
    assert answered.reply == "ok"


@pytest.mark.parametrize(("cost", "counted"), [(-1.0, None), (float("nan"), None), (float("inf"), None), (0.25, 0.25)])
def test_a_cost_that_is_none_is_not_believed(cost: float, counted: float | None) -> None:
    with Loopback([Say("ok", cost_usd=cost)]) as server:
        assert loop_model("openrouter:v/m", server).ask(QUESTION).usage.cost_usd == counted


def test_a_count_of_tokens_that_is_none_is_estimated() -> None:
    record = ask(Say("ok", input_tokens=10**12, output_tokens=20))
    assert (record.usage.input_tokens, record.usage.tokens_estimated) == (100, True)


@pytest.mark.parametrize("pause", ["-5", "nan", "never"])
def test_a_pause_that_is_none_is_not_waited_for(pause: str) -> None:
    record = ask(Fail(503, headers={"Retry-After": pause}), Say("ok"))
    assert record.failed_attempts[0].waited_s == RetryPolicy().first_wait_s


def test_a_count_of_tokens_past_all_bounds_is_not_believed() -> None:
    for count in (10**400, -1, float("nan"), float("inf"), True, "12", None, [12]):
        assert token_count(count) == 0
        assert amount(count) is None
    assert token_count(12) == 12
