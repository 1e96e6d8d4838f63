"""Our conversations against servers that are as strict as the chat templates of local models."""

from __future__ import annotations

import json
from collections.abc import Callable

import jinja2
import pytest
from agent_samples import BRIEF, CONCEPT, PLACEMENT, REPORT, ROBOT, SCENE

from aidsr.core.calls import Message, Question
from aidsr.core.errors import ModelError
from aidsr.core.roles import Team
from aidsr.teams.llm import team
from aidsr.teams.providers import RetryPolicy, connect
from loopback import Act, Fail, Loopback, Received, Say

# What the templates that ship with these models refuse, in a few lines each; vLLM and llama.cpp answer HTTP 400 then.
TEMPLATES = {
    "qwen": """
        {%- for message in messages %}
            {%- if message.role == 'system' and not loop.first %}
                {{- raise_exception('System message must be at the beginning.') }}
            {%- endif %}
            {%- if message.content is not string %}{{ raise_exception('Unexpected content type.') }}{% endif %}
            {{- '<|im_start|>' + message.role + '\n' + message.content + '<|im_end|>\n' }}
        {%- endfor %}{{ '<|im_start|>assistant\n' }}""",
    "llama": """
        {%- set turns = messages[1:] if messages[0].role == 'system' else messages %}
        {%- for message in turns %}
            {%- if (message.role == 'user') != (loop.index0 % 2 == 0) %}
                {{- raise_exception('Conversation roles must alternate user/assistant/user/assistant/...') }}
            {%- endif %}
            {{- '<|start_header_id|>' + message.role + '\n' + message.content.strip() }}
        {%- endfor %}
        {%- if turns[-1].role != 'user' %}{{ raise_exception('The last turn must be a user turn.') }}{% endif %}""",
    "gemma": """
        {%- set first = messages[0].content + '\n\n' if messages[0].role == 'system' else '' %}
        {%- for message in (messages[1:] if first else messages) %}
            {%- if (message.role == 'user') != (loop.index0 % 2 == 0) %}
                {{- raise_exception('Conversation roles must alternate user/assistant/user/assistant/...') }}
            {%- endif %}
            {%- if not message.content.strip() %}{{ raise_exception('Empty turn.') }}{% endif %}
            {{- '<start_of_turn>' + (first if loop.first else '') + message.content + '<end_of_turn>\n' }}
        {%- endfor %}""",
    "gemma 2": """
        {%- if messages[0].role == 'system' %}{{ raise_exception('System role not supported') }}{% endif %}""",
}
KNOWN_FIELDS = {"model", "messages", "max_tokens", "stream"}
"""All that a request may have: servers that check their input refuse what they do not know."""

HEADER = '{"functional_part": "tip"}'
IDEAS = [
    dict.fromkeys(("name", "family", "morphology", "actuation", "functional_part"), word)
    for word in ("one long arm", "three short fingers")
]
SPOILT = [
    Say("It is a nice day for tendons."),
    Say("half a rob", finish="length"),
    Say(""),
    Say("I cannot help with that.", finish="refusal"),
    Say(f"{{}}\n```xml\n{ROBOT.mjcf}\n```"),
    Say('```xml\n<patch><set sel="//nothing" a="b"/></patch>\n```'),
]
ASKED: dict[str, tuple[str, Callable[[Team], object]]] = {
    "propose": (
        json.dumps({"interpretation": "reach", "concepts": IDEAS}),
        lambda roles: roles.designer.propose(BRIEF, 2),
    ),
    "revise": (
        json.dumps({"interpretation": "reach", "concepts": IDEAS[:1]}),
        lambda roles: roles.designer.revise(BRIEF, CONCEPT, ROBOT, "longer"),
    ),
    "write": (f"{HEADER}\n```xml\n{ROBOT.mjcf}\n```", lambda roles: roles.coder.write(BRIEF, CONCEPT)),
    "repair": (
        f"{HEADER}\n```xml\n{ROBOT.mjcf}\n```",
        lambda roles: roles.coder.repair(BRIEF, CONCEPT, ROBOT, REPORT),
    ),
    "place": (PLACEMENT.model_dump_json(), lambda roles: roles.integrator.place(BRIEF, CONCEPT, ROBOT)),
    "adjust": (
        PLACEMENT.model_dump_json(),
        lambda roles: roles.integrator.adjust(BRIEF, CONCEPT, ROBOT, PLACEMENT, REPORT),
    ),
    "judge": ('{"passed": true}', lambda roles: roles.judge.judge(BRIEF, CONCEPT, ROBOT, SCENE, REPORT)),
}


class Strict:
    """A server with a chat template: what the template raises is an HTTP 400, as with vLLM and llama.cpp."""

    def __init__(self, template: str, *script: Act) -> None:
        environment = jinja2.Environment(autoescape=False)
        environment.globals["raise_exception"] = self._refuse
        self._template = environment.from_string(TEMPLATES[template])
        self._script = list(script)
        self.lengths: list[int] = []
        """Turns of each conversation that was accepted."""

    def __call__(self, received: Received) -> Act:
        unknown = set(received.body) - KNOWN_FIELDS
        if unknown:
            return Fail(400, f"Extra inputs are not permitted: {unknown}")
        try:
            self._template.render(messages=received.body["messages"])
        except ValueError as error:
            return Fail(400, str(error))
        self.lengths.append(len(received.body["messages"]))
        return self._script.pop(0)

    def _refuse(self, message: str) -> None:
        raise ValueError(message)


def roles_at(server: Loopback, name: str, reasks: int = 6) -> Team:
    environ = {"OLLAMA_BASE_URL": f"{server.url}/v1"}
    return team(
        connect(name.replace("HERE", f"{server.url}/v1"), environ=environ, retry=RetryPolicy(attempts=1)), reasks=reasks
    )


@pytest.mark.parametrize("asked", ASKED)
@pytest.mark.parametrize(("template", "name"), [("qwen", "ollama:m"), ("llama", "m@HERE"), ("gemma", "m@HERE")])
def test_every_conversation_is_accepted_however_often_it_is_asked_again(template: str, asked: str, name: str) -> None:
    good, ask = ASKED[asked]
    server_side = Strict(template, *SPOILT, Say(good))
    with Loopback(server_side) as server:
        ask(roles_at(server, name))
    assert len(server_side.lengths) == len(server.requests), "every request was accepted"
    assert max(server_side.lengths) >= 4, "one of them at least carries an earlier reply"
    assert {request.body["max_tokens"] for request in server.requests} == {20_000}


@pytest.mark.parametrize(
    ("roles", "template"),
    [
        (["system", "system", "user"], "qwen"),
        (["user", "system", "user"], "qwen"),
        (["system", "user", "user"], "llama"),
        (["system", "assistant", "user"], "gemma"),
        (["system", "user"], "gemma 2"),
    ],
)
def test_the_templates_refuse_what_they_should(roles: list[str], template: str) -> None:
    messages = [{"role": role, "content": "words"} for role in roles]
    assert isinstance(Strict(template)(Received("", {}, {"messages": messages})), Fail)


def test_a_refusal_by_the_template_is_told_in_its_words() -> None:
    question = Question(role="judge", messages=(Message(role="system", text="s"), Message(role="user", text="u")))
    with Loopback(Strict("gemma 2")) as server, pytest.raises(ModelError, match="System role not supported"):
        connect(f"m@{server.url}/v1", environ={}).ask(question)
