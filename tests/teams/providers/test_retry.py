from __future__ import annotations

import pytest
from test_remote import NAMES, loop_model

from aidsr.core.calls import CallRecord, FailedAttempt, Message, Question
from aidsr.core.errors import ModelError, UserError
from aidsr.teams.providers import RetryPolicy, connect
from aidsr.teams.providers.retry import TransientError, call_with_retries
from aidsr.teams.providers.tokens import estimate_input_tokens
from fake_clock import FakeClock
from loopback import Act, Drop, Fail, Hang, Loopback, Raw, Say

QUESTION = Question(role="judge", messages=(Message(role="user", text="well?"),))


@pytest.fixture
def fake_clock() -> FakeClock:
    return FakeClock()


def ask(fake_clock: FakeClock, *script: Act, **policy: float) -> CallRecord:
    with Loopback(script) as server:
        model = connect(f"m@{server.url}/v1", environ={}, retry=RetryPolicy(**policy), clock=fake_clock.clock())
        record = model.ask(QUESTION)
    assert len(server.requests) == len(script), "some of the script was not asked for"
    return record


def test_every_transient_failure_is_ridden_out_and_kept(fake_clock: FakeClock) -> None:
    record = ask(
        fake_clock,
        Fail(429, "slow down", {"Retry-After": "7"}),
        Fail(500, "broken"),
        Fail(503, "busy", {"Retry-After": "3"}),
        Drop(),
        Raw(b"<html>gateway</html>"),
        Say("at last"),
    )
    assert record.reply == "at last"
    assert [attempt.waited_s for attempt in record.failed_attempts] == [7, 2, 3, 8, 16]
    assert fake_clock.slept_s == [7, 2, 3, 8, 16]
    assert [attempt.error.split(":")[0] for attempt in record.failed_attempts] == [
        "HTTP 429", "HTTP 500", "HTTP 503", "connection failed", "the reply could not be read",
    ]  # fmt: skip
    assert record.usage.retries == 5
    assert record.usage.latency_s == sum(fake_clock.slept_s)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    "body",
    [
        "{}",
        "null",
        "[]",
        '{"error": {"message": "Upstream overloaded", "code": 502}}',
        '{"error": "model not loaded"}',
        '{"id": "1", "object": "chat.completion", "created": 1, "model": "m", "choices": []}',
        pytest.param("[" * 100_000, id="lists without an end"),
    ],
)
def test_a_reply_that_is_not_in_the_providers_format_is_asked_for_again(
    fake_clock: FakeClock, name: str, body: str
) -> None:
    with Loopback([Raw(body.encode()), Say("ok")]) as server:
        record = loop_model(name, server, fake_clock.clock()).ask(QUESTION)
    assert record.reply == "ok"
    assert len(record.failed_attempts) == 1


@pytest.mark.parametrize("name", [name for name in NAMES if not name.startswith("google")])  # which sends it escaped
def test_a_question_that_cannot_be_sent_is_a_bug_and_not_tried_again(fake_clock: FakeClock, name: str) -> None:
    unsendable = Question(role="judge", messages=(Message(role="user", text="half \ud83d"),))
    with Loopback([]) as server, pytest.raises(UnicodeEncodeError):
        loop_model(name, server, fake_clock.clock()).ask(unsendable)
    assert fake_clock.slept_s == []


@pytest.mark.parametrize("status", [408, 409, 429, 500, 502, 503, 504, 529])
def test_statuses_that_are_tried_again(fake_clock: FakeClock, status: int) -> None:
    assert ask(fake_clock, Fail(status), Say("ok")).failed_attempts == (
        FailedAttempt(error=f"HTTP {status}: no luck", waited_s=1.0),
    )


def test_a_date_in_the_past_means_now(fake_clock: FakeClock) -> None:
    ask(fake_clock, Fail(429, headers={"Retry-After": "Wed, 21 Oct 2015 07:28:00 GMT"}), Say("ok"))
    assert fake_clock.slept_s == [0.0]


def test_a_date_beyond_the_deadline_ends_the_call(fake_clock: FakeClock) -> None:
    with pytest.raises(ModelError, match="no reply within 3600 s; attempt 1 failed"):
        ask(fake_clock, Fail(429, headers={"Retry-After": "Fri, 31 Dec 2999 23:59:59 GMT"}))
    assert fake_clock.slept_s == []


def test_an_attempt_without_reply_is_cut_off_and_tried_again(fake_clock: FakeClock) -> None:
    record = ask(fake_clock, Hang(), Say("ok"), attempt_timeout_s=0.2)
    (attempt,) = record.failed_attempts
    assert attempt.error == "no reply in time"
    assert (attempt.usage.input_tokens, attempt.usage.output_tokens, attempt.usage.tokens_estimated) == (
        estimate_input_tokens(QUESTION), QUESTION.max_output_tokens, True,
    ), "the model may have written the longest reply, which is billed"  # fmt: skip
    assert attempt.usage.cost_usd is None, "an unknown price is not 0"
    assert record.usage.output_tokens > QUESTION.max_output_tokens


def test_attempts_are_bounded(fake_clock: FakeClock) -> None:
    with pytest.raises(ModelError, match="no reply in 3 attempts; the last one failed: HTTP 500: third"):
        ask(fake_clock, Fail(500, "first"), Fail(500, "second"), Fail(500, "third"), attempts=3)
    assert fake_clock.slept_s == [1, 2]


@pytest.mark.parametrize(
    ("fail", "cure"),
    [
        (Fail(500, "out of memory"), "HTTP 500: out of memory. The service has a fault of its own; try again later"),
        (Fail(503, "busy"), "HTTP 503: busy. The service has a fault of its own; try again later"),
        (Fail(429, "slow down"), "HTTP 429: slow down. The service limits its use; try again later"),
    ],
)
def test_the_last_failure_names_a_fix(fake_clock: FakeClock, fail: Fail, cure: str) -> None:
    with pytest.raises(ModelError) as caught:
        ask(fake_clock, fail, attempts=1)
    assert cure in str(caught.value)


def test_a_model_that_is_too_slow_names_the_limit(fake_clock: FakeClock) -> None:
    with pytest.raises(ModelError, match=r"no reply in time\. Raise AIDSR_ATTEMPT_TIMEOUT_S"):
        ask(fake_clock, Hang(), attempts=1, attempt_timeout_s=0.2)


def test_the_fix_is_named_once_where_the_deadline_ends_the_call(fake_clock: FakeClock) -> None:
    with pytest.raises(ModelError, match=r"no luck\. The service has a fault of its own") as caught:
        ask(fake_clock, Fail(500), deadline_s=0.5)
    assert str(caught.value).count("later") == 1


def test_an_unreachable_server_is_a_model_error(fake_clock: FakeClock) -> None:
    with Loopback([]) as server:
        url = server.url
    model = connect(f"m@{url}/v1", environ={}, retry=RetryPolicy(attempts=2), clock=fake_clock.clock())
    with pytest.raises(ModelError, match="connection failed"):
        model.ask(QUESTION)


@pytest.mark.parametrize(
    ("fail", "kind", "words"),
    [
        (Fail(400, "bad parameter"), ModelError, "rejected the request (HTTP 400: bad parameter)"),
        (Fail(401, "who?"), UserError, "check the environment variable AIDSR_API_KEY"),
        (Fail(402, "no money"), UserError, "has no credit left"),
        (Fail(403, "not you"), UserError, "check the environment variable AIDSR_API_KEY"),
        (Fail(404, "no such model"), UserError, "check the model's name and its URL"),
        (Fail(413, "too long"), ModelError, "HTTP 413"),
        (Fail(400, "x" * 5000), ModelError, "x" * 300 + "…"),
    ],
)
def test_refusals_are_final_at_the_first_attempt(
    fake_clock: FakeClock, fail: Fail, kind: type[Exception], words: str
) -> None:
    with pytest.raises(kind) as caught:
        ask(fake_clock, fail)
    assert words in str(caught.value)
    assert len(str(caught.value)) < 500
    assert fake_clock.slept_s == []


def test_the_deadline_bounds_attempts_and_pauses_together(fake_clock: FakeClock) -> None:
    limits: list[float] = []

    def attempt(limit_s: float) -> None:
        limits.append(limit_s)
        fake_clock.time_s += 40
        raise TransientError("busy")

    with pytest.raises(ModelError, match="attempt 3 failed, and the next would have to wait 4 s: busy"):
        call_with_retries(
            "m", attempt, RetryPolicy(attempt_timeout_s=60, deadline_s=125, first_wait_s=1), fake_clock.clock(), []
        )
    assert limits == [60, 60, 42]


def test_the_retry_policy_can_be_set_in_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AIDSR_ATTEMPT_TIMEOUT_S", "1800")
    monkeypatch.setenv("AIDSR_API_KEY", "another variable with our prefix")
    assert RetryPolicy.from_environment().attempt_timeout_s == 1800


@pytest.mark.parametrize(("value", "words"), [("soon", "valid number"), ("0", "greater than 0")])
def test_a_limit_that_is_not_a_number_is_refused(value: str, words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("AIDSR_DEADLINE_S", value)
    with pytest.raises(UserError, match=f'AIDSR_DEADLINE_S="{value}": .*{words}'):
        connect("m@http://localhost:1/v1", environ={})
