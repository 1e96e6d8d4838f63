"""Tools on the wire: how a model is told of them, how its calls are read, how results go back."""

from __future__ import annotations

import json

import pytest
from tests.teams.providers.test_remote import NAMES, loop_model

from aidsr.core.calls import CallRecord, Message, Question, ToolCall, ToolOutput, ToolSpec
from aidsr.core.errors import ModelError, UserError
from aidsr.core.model import calls_tools
from aidsr.teams.providers import connect
from aidsr.teams.providers.manual import ManualModel
from aidsr.teams.providers.tokens import estimate_input_tokens
from fake_clock import FakeClock
from loopback import Fail, Loopback, Raw, Say

WEIGH = ToolSpec(
    name="weigh",
    description="Weighs a robot on the loopback scale.",
    parameters={"type": "object", "properties": {"robot": {"type": "string"}}, "required": ["robot"]},
)
START = (Message(role="system", text="Measure."), Message(role="user", text="How heavy are they?"))
QUESTION = Question(role="designer", messages=START, tools=(WEIGH,))
CALLS = (("weigh", {"robot": "robot_1"}), ("weigh", {"robot": "robot_2"}))


@pytest.mark.parametrize("name", NAMES)
def test_calls_are_read_and_their_results_go_back(name: str) -> None:
    with Loopback([Say("I weigh both.", calls=CALLS), Say("0.2 and 0.3 kg.")]) as server:
        model = loop_model(name, server)
        assert calls_tools(model)
        first = model.ask(QUESTION)
        said = Message(role="assistant", text=first.reply, tool_calls=first.tool_calls)
        outputs = tuple(
            ToolOutput(id=call.id, name=call.name, text=f"{0.1 + 0.1 * number:.1f} kilograms")
            for number, call in enumerate(first.tool_calls, 1)
        )
        answered = Message(role="user", text="", tool_outputs=outputs)
        second = model.ask(QUESTION.model_copy(update={"messages": (*START, said, answered)}))
    assert (first.reply, first.finish) == ("I weigh both.", "stop")
    assert [(call.name, json.loads(call.arguments)) for call in first.tool_calls] == list(CALLS)
    assert len({call.id for call in first.tool_calls}) == 2
    told, again = (json.dumps(request.body) for request in server.requests)
    assert "Weighs a robot on the loopback scale." in told
    assert '"required": ["robot"]' in told
    assert [again.count(text) for text in ("0.2 kilograms", "0.3 kilograms", "I weigh both.")] == [1, 1, 1]
    assert again.index("robot_2") < again.index("0.2 kilograms") < again.index("0.3 kilograms")
    assert (second.reply, second.tool_calls) == ("0.2 and 0.3 kg.", ())
    assert CallRecord.model_validate_json(first.model_dump_json()) == first


def test_a_reply_may_be_calls_alone() -> None:
    with Loopback([Say("", calls=CALLS[:1], counted=False)]) as server:
        record = loop_model("m@LOOPBACK", server).ask(QUESTION)
    assert (record.reply, len(record.tool_calls), record.finish) == ("", 1, "stop")
    assert record.usage.tokens_estimated
    assert record.usage.output_tokens >= len('weigh{"robot": "robot_1"}') // 3


def test_a_key_in_the_arguments_of_a_call_is_redacted() -> None:
    key = "sk-0123456789abcdef"
    with Loopback([Say("", calls=(("weigh", {"robot": key}),))]) as server:
        model = connect(f"m@{server.url}/v1", environ={"OPENAI_API_KEY": key})
        (call,) = model.ask(QUESTION).tool_calls
    assert key not in call.arguments
    assert "weigh" in call.name


@pytest.mark.parametrize("status", [400, 404, 422])
def test_a_server_that_takes_no_tools_is_told_of(status: int) -> None:
    refusal = Fail(status, "this model does not support tools")
    with Loopback([refusal, refusal]) as server, pytest.raises(UserError, match="start the run with text_tools"):
        loop_model("m@LOOPBACK", server).ask(QUESTION)


def test_a_server_that_names_missing_tools_as_its_fault_is_told_of_in_the_end() -> None:
    refusal = Fail(500, "tools param requires --jinja flag")
    with Loopback(lambda _: refusal) as server, pytest.raises(ModelError, match="start the run with text_tools"):
        loop_model("m@LOOPBACK", server, FakeClock().clock()).ask(QUESTION)


@pytest.mark.parametrize(
    "failure",
    [
        Fail(429, "Rate limit reached for model `llama3-groq-tool-use`; try again in 2s"),
        Fail(503, "the tool server is overloaded"),
    ],
)
def test_a_busy_service_is_asked_again_whatever_it_says_of_tools(failure: Fail) -> None:
    with Loopback([failure, Say("fine")]) as server:
        record = loop_model("llama3-groq-tool-use@LOOPBACK", server, FakeClock().clock()).ask(QUESTION)
    assert (record.reply, record.usage.retries) == ("fine", 1)


def test_a_paid_reply_with_a_call_that_cannot_be_read_counts_and_is_asked_for_again() -> None:
    call = {"id": "c", "type": "function", "function": {"name": "weigh"}}
    message = {"role": "assistant", "content": None, "tool_calls": [call]}
    body = {
        "id": "x",
        "object": "chat.completion",
        "created": 1,
        "model": "m",
        "choices": [{"index": 0, "message": message, "finish_reason": "tool_calls"}],
        "usage": {"prompt_tokens": 15_000, "completion_tokens": 900, "total_tokens": 15_900},
    }
    with Loopback([Raw(json.dumps(body).encode()), Say("fine", input_tokens=100, output_tokens=10)]) as server:
        record = loop_model("m@LOOPBACK", server, FakeClock().clock()).ask(QUESTION)
    assert (record.reply, record.usage.retries) == ("fine", 1)
    assert (record.usage.input_tokens, record.usage.output_tokens) == (15_100, 910)


def test_a_refused_key_gets_no_advice_on_tools() -> None:
    with Loopback([Fail(401, "no such key")]) as server, pytest.raises(UserError, match="refused the key") as error:
        loop_model("llama3-groq-tool-use@LOOPBACK", server).ask(QUESTION)
    assert "text_tools" not in str(error.value)


def test_what_uses_no_tools_is_written_as_before_there_were_any() -> None:
    plain = Question(role="designer", messages=START)
    assert "tool" not in plain.model_dump_json()
    assert "tool" in QUESTION.model_dump_json()


def test_tools_and_results_count_as_tokens() -> None:
    plain = estimate_input_tokens(Question(role="designer", messages=START))
    with_tools = estimate_input_tokens(QUESTION)
    assert with_tools >= plain + len(WEIGH.description) // 4
    call = ToolCall(id="1", name="weigh", arguments='{"robot": "robot_1"}')
    turns = (
        Message(role="assistant", text="", tool_calls=(call,)),
        Message(role="user", text="", tool_outputs=(ToolOutput(id="1", name="weigh", text="x" * 3000),)),
    )
    assert estimate_input_tokens(QUESTION.model_copy(update={"messages": (*START, *turns)})) >= with_tools + 1000


def test_a_person_by_hand_is_told_of_tools_in_words(tmp_path) -> None:
    assert not calls_tools(ManualModel(tmp_path))
