"""What goes over the wire for each provider, and what is read out of its replies."""

from __future__ import annotations

import base64
import json
import re
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from pydantic import SecretStr

from aidsr.core.calls import CallRecord, Message, Question
from aidsr.core.errors import ModelError, UserError
from aidsr.core.model import Model
from aidsr.teams.providers import Clock, Endpoint, connect
from aidsr.teams.providers.remote import RemoteModel
from aidsr.teams.providers.tokens import estimate_tokens
from loopback import Act, Fail, Loopback, Received, Say

SYSTEM = "Du bist ein Prüfstand <system>&amp; mehr</system>."
TEXTS = (SYSTEM, "first user turn\n```xml\n<mujoco/>\n```", "first reply", "second user turn: 20 µm, “quoted”")
QUESTION = Question(
    role="coder",
    messages=(
        Message(role="system", text=TEXTS[0]),
        Message(role="user", text=TEXTS[1]),
        Message(role="assistant", text=TEXTS[2]),
        Message(role="user", text=TEXTS[3]),
    ),
    max_output_tokens=4321,
)


def loop_model(name: str, server: Loopback, clock: Clock | None = None) -> Model:
    environ = {
        "OPENAI_API_KEY": "sk-loop",
        "ANTHROPIC_API_KEY": "sk-loop",
        "GOOGLE_API_KEY": "sk-loop",
        "OPENROUTER_API_KEY": "sk-loop",
        "OPENAI_BASE_URL": f"{server.url}/v1",
        "ANTHROPIC_BASE_URL": server.url,
        "GOOGLE_BASE_URL": server.url,
        "OPENROUTER_BASE_URL": f"{server.url}/v1",
        "OLLAMA_BASE_URL": f"{server.url}/v1",
    }
    return connect(name.replace("LOOPBACK", f"{server.url}/v1"), environ=environ, clock=clock)


def asked(name: str, act: Act) -> tuple[CallRecord, Received]:
    with Loopback([act]) as server:
        record = loop_model(name, server).ask(QUESTION)
    (received,) = server.requests
    return record, received


def _text(content: Any) -> str:
    return content if isinstance(content, str) else "".join(part["text"] for part in content)


def _chat_turns(body: dict[str, Any]) -> list[tuple[str, str]]:
    return [(turn["role"], _text(turn["content"])) for turn in body["messages"]]


def _response_turns(body: dict[str, Any]) -> list[tuple[str, str]]:
    return [(turn["role"], _text(turn["content"])) for turn in body["input"]]


def _anthropic_turns(body: dict[str, Any]) -> list[tuple[str, str]]:
    return [("system", _text(body["system"])), *_chat_turns(body)]


def _google_turns(body: dict[str, Any]) -> list[tuple[str, str]]:
    names = {"user": "user", "model": "assistant"}
    turns = [(names[turn["role"]], _text(turn["parts"])) for turn in body["contents"]]
    return [("system", _text(body["systemInstruction"]["parts"])), *turns]


WIRES: list[Any] = [
    pytest.param("m@LOOPBACK", "/v1/chat/completions", _chat_turns, ("max_tokens",), id="url"),
    pytest.param("ollama:qwen3", "/v1/chat/completions", _chat_turns, ("max_tokens",), id="ollama"),
    pytest.param(
        "openai-chat:gpt-5.6-sol", "/v1/chat/completions", _chat_turns, ("max_completion_tokens",), id="openai-chat"
    ),
    pytest.param("openai:gpt-6.1-sol", "/v1/responses", _response_turns, ("max_output_tokens",), id="openai"),
    pytest.param("anthropic:claude-sonnet-5-5", "/v1/messages", _anthropic_turns, ("max_tokens",), id="anthropic"),
    pytest.param(
        "google:gemini-3.8-flash",
        "/v1beta/models/gemini-3.8-flash:generateContent",
        _google_turns,
        ("generationConfig", "maxOutputTokens"),
        id="google",
    ),
    pytest.param("openrouter:qwen/qwen3-coder", "/v1/chat/completions", _chat_turns, ("max_tokens",), id="openrouter"),
]
NAMES = [wire.values[0] for wire in WIRES]


@pytest.mark.parametrize(("name", "path", "turns", "cap"), WIRES)
def test_the_words_arrive_unaltered_and_capped(
    name: str, path: str, turns: Callable[[dict[str, Any]], list[tuple[str, str]]], cap: tuple[str, ...]
) -> None:
    record, received = asked(name, Say("fine", input_tokens=100, output_tokens=20, cached_tokens=30))
    assert received.path.split("?")[0] == path
    assert turns(received.body) == list(zip(("system", "user", "assistant", "user"), TEXTS, strict=True))
    value: Any = received.body
    for key in cap:
        value = value[key]
    assert value == 4321
    assert sorted(key for key in received.body if "max" in key and key not in cap) == []
    assert (record.reply, record.finish, record.question) == ("fine", "stop", QUESTION)
    assert record.model == name.replace("LOOPBACK", record.model.partition("@")[2])
    assert (record.usage.input_tokens, record.usage.cached_input_tokens, record.usage.output_tokens) == (100, 30, 20)
    assert (record.usage.calls, record.usage.retries, record.failed_attempts) == (1, 0, ())


def test_the_provider_for_compatible_servers_in_the_docs_sends_max_tokens() -> None:
    page = (Path(__file__).parents[3] / "docs" / "add_a_provider.md").read_text()
    *_, example = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    defined: dict[str, Any] = {}
    exec(compile(example, "add_a_provider.md", "exec"), defined)
    provider = defined["PROVIDER"]
    with Loopback([Say("fine")]) as server:
        endpoint = Endpoint(provider, name="lab:tiny", argument="tiny", base_url=f"{server.url}/v1", key=SecretStr("k"))
        provider.connect(endpoint).ask(QUESTION)
    assert server.requests[0].body["max_tokens"] == 4321
    assert "max_completion_tokens" not in server.requests[0].body


PNG = b"\x89PNG\r\n\x1a\n not much of a picture"
WITH_PICTURE = Question(
    role="judge",
    messages=(Message(role="system", text="s"), Message(role="user", text="Look:", pictures=(PNG,))),
)


@pytest.mark.parametrize("name", NAMES)
def test_a_picture_arrives_after_its_words(name: str) -> None:
    with Loopback([Say("seen")]) as server:
        record = loop_model(name, server).ask(WITH_PICTURE)
    sent = json.dumps(server.requests[0].body)
    assert sent.count(base64.b64encode(PNG).decode()) == 1
    assert sent.count("image/png") == 1
    assert sent.index("Look:") < sent.index("image/png")
    assert CallRecord.model_validate_json(record.model_dump_json()) == record, "a record keeps what was shown"


@pytest.mark.parametrize("status", [400, 404, 422])
def test_a_model_that_takes_no_images_is_told_of(status: int) -> None:
    refusal = Fail(status, "this model does not support image input")
    with Loopback([refusal, refusal]) as server:
        with (
            pytest.raises(UserError, match=r"support image input.*without judge_pictures")
            if status != 404
            else (pytest.raises(UserError, match="was not found"))
        ):
            loop_model("m@LOOPBACK", server).ask(WITH_PICTURE)
        with pytest.raises((ModelError, UserError)) as refused:
            loop_model("m@LOOPBACK", server).ask(QUESTION)
    assert "picture" not in str(refused.value)


def test_a_model_known_to_take_no_images_is_not_asked() -> None:
    from pydantic_ai.models.openai import OpenAIChatModel

    with Loopback([]) as server:
        model = loop_model("m@LOOPBACK", server)
        assert isinstance(model, RemoteModel)
        assert isinstance(model.client, OpenAIChatModel)
        blind = OpenAIChatModel("m", provider=model.client._provider, profile={"supports_image_input": False})
        with pytest.raises(UserError, match="takes no images; start the run without judge_pictures"):
            replace(model, client=blind).ask(WITH_PICTURE)
    assert server.requests == []


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("act", "finish", "reply"),
    [
        (Say("half a rob", finish="length"), "length", "half a rob"),
        (Say("I will not", finish="refusal"), "refusal", "I will not"),
        (Say(""), "stop", ""),
    ],
)
def test_every_ending_is_told_apart(name: str, act: Say, finish: str, reply: str) -> None:
    record, _ = asked(name, act)
    assert (record.finish, record.reply) == (finish, reply)


@pytest.mark.parametrize(
    ("said", "reply"),
    [
        ('<think>a {x}</think>\n{"p": 1}', '\n{"p": 1}'),
        ('a {x}</think>\n{"p": 1}', '{"p": 1}'),
        ("a</think>b</think>c", "c"),
        ("only reasoned</think>", ""),
        (" no reasoning ", " no reasoning "),
    ],
)
def test_reasoning_is_no_part_of_the_answer_though_a_template_opens_it(said: str, reply: str) -> None:
    record, _ = asked("m@LOOPBACK", Say(said))
    assert record.reply == reply


def test_chat_completions_content_filter_is_a_refusal() -> None:
    record, _ = asked("m@LOOPBACK", Say("", finish="content_filter"))
    assert record.finish == "refusal"


@pytest.mark.parametrize("name", NAMES)
def test_a_server_of_ones_own_has_no_invented_price(name: str) -> None:
    record, _ = asked(name, Say("fine"))
    assert record.usage.cost_usd is None


@pytest.mark.parametrize("name", [name for name in NAMES if not name.startswith("anthropic")])
def test_tokens_that_nobody_counted_are_estimated(name: str) -> None:
    record, _ = asked(name, Say("word " * 600, counted=False))
    assert record.usage.tokens_estimated
    assert record.usage.input_tokens == estimate_tokens("\n".join(TEXTS))
    assert record.usage.output_tokens == 1000
    assert record.usage.cost_usd is None
    counted, _ = asked(name, Say("word", output_tokens=20))
    assert not counted.usage.tokens_estimated


@pytest.mark.parametrize("name", NAMES)
def test_half_a_character_does_not_keep_a_reply_from_being_recorded(name: str) -> None:
    with Loopback([Fail(503, "busy \ud83d", {"Retry-After": "0"}), Say("half \ud83d")]) as server:
        record = loop_model(name, server).ask(QUESTION)
    assert (record.reply, record.failed_attempts[0].error) == ("half ?", "HTTP 503: busy ?")
    assert CallRecord.model_validate_json(record.model_dump_json()) == record


def test_the_cost_a_router_reports_is_taken() -> None:
    record, received = asked("openrouter:qwen/qwen3-coder", Say("fine", cost_usd=0.0125))
    assert record.usage.cost_usd == 0.0125
    assert received.body["usage"] == {"include": True}


def test_list_prices_are_looked_up_and_unknown_stays_unknown() -> None:
    from pydantic_ai.messages import ModelResponse
    from pydantic_ai.usage import RequestUsage

    from aidsr.teams.providers.prices import cost_usd

    def response(model: str | None, usage: RequestUsage) -> ModelResponse:
        return ModelResponse(parts=[], usage=usage, model_name=model, provider_name="openai")

    # gpt-4o has cost 2.50 USD per million input tokens and 10 USD per million output tokens since October 2024.
    known = response("gpt-4o", RequestUsage(input_tokens=1_000_000, output_tokens=100_000))
    assert cost_usd(known, has_list_price=True) == pytest.approx(3.5)
    assert cost_usd(known, has_list_price=False) is None
    assert cost_usd(response("no-such-model", RequestUsage(input_tokens=1)), has_list_price=True) is None
    assert cost_usd(response(None, RequestUsage(input_tokens=1)), has_list_price=True) is None


def test_a_late_system_message_is_a_bug_and_never_sent() -> None:
    late = Question(role="judge", messages=(Message(role="user", text="u"), Message(role="system", text="s")))
    with Loopback([]) as server, pytest.raises(ValueError, match="may only come first"):
        loop_model("m@LOOPBACK", server).ask(late)
    assert server.requests == []


def test_three_threads_are_answered_side_by_side() -> None:
    """Each request waits in the server until all three are there; one after the other would never finish."""
    together = threading.Barrier(3, timeout=60)

    def answer(received: Received) -> Act:
        together.wait()
        return Say(received.body["messages"][0]["content"])

    with Loopback(answer) as server:
        model = loop_model("m@LOOPBACK", server)
        replies: dict[int, str] = {}

        def ask(number: int) -> None:
            question = Question(role="coder", messages=(Message(role="user", text=f"concept {number}"),))
            replies[number] = model.ask(question).reply

        threads = [threading.Thread(target=ask, args=(number,)) for number in range(3)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert replies == {number: f"concept {number}" for number in range(3)}
