"""Calls of tools in the text of a reply, and tools as a prompt shows them."""

from __future__ import annotations

import json

import pytest

from aidsr.core.calls import ToolOutput
from aidsr.core.errors import ReplyError
from aidsr.teams.measuring.calls import calls_as_text, calls_in_text, describe_tools, prose_of, results_as_text
from aidsr.teams.measuring.toolbox import Toolbox, ToolBudget
from aidsr.tools import Workspace

REPLY = """I try two.

```tool validate
{"functional_part": "tip"}
```
```argument mjcf
<mujoco model="a">
  <option timestep="0.002"/>
</mujoco>
```

and then

```tool fix
{"robot": "robot_1"}
```
"""


def test_calls_are_read_with_their_long_arguments_as_they_are() -> None:
    first, second = calls_in_text(REPLY)
    assert (first.id, first.name, second.id, second.name) == ("1", "validate", "2", "fix")
    assert json.loads(first.arguments) == {
        "functional_part": "tip",
        "mjcf": '<mujoco model="a">\n  <option timestep="0.002"/>\n</mujoco>',
    }
    assert json.loads(second.arguments) == {"robot": "robot_1"}


def test_a_reply_without_blocks_has_no_calls() -> None:
    assert calls_in_text("Let me think.\n```xml\n<mujoco/>\n```") == ()
    assert calls_in_text("```tool list\n```")[0].arguments == "{}"


@pytest.mark.parametrize(
    ("reply", "message"),
    [
        ("```tool fix\n{robot: 1}\n```", "`tool fix` is no JSON"),
        ("```tool fix\n[1]\n```", "`tool fix` is no JSON object"),
        ("```argument mjcf\n<mujoco/>\n```", "`argument mjcf` has no block `tool NAME` before it"),
    ],
)
def test_what_is_no_call_is_said(reply: str, message: str) -> None:
    with pytest.raises(ReplyError, match=message):
        calls_in_text(reply)


def test_calls_written_as_text_are_the_same_calls() -> None:
    calls = calls_in_text(REPLY)
    assert calls_in_text(calls_as_text(calls)) == calls
    assert prose_of(REPLY) == "I try two.\nand then"


def test_results_stand_under_the_number_of_their_call() -> None:
    outputs = [ToolOutput(id="1", name="validate", text="stable"), ToolOutput(id="2", name="fix", text="nothing")]
    assert results_as_text(outputs) == "## 1. validate\n\nstable\n\n## 2. fix\n\nnothing"


def test_tools_are_described_with_types_defaults_and_fields(tmp_path) -> None:
    specs = Toolbox(Workspace(tmp_path), tmp_path, ToolBudget(10, 10)).specs
    described = {tool.name: tool for tool in describe_tools(specs)}
    assert "look" not in described, "a model that takes no pictures is not offered any"
    assert "seeds? (list of integer = [0, 1]): Of as many searches." in described["probe"].arguments
    (placement,) = (line for line in described["assemble"].arguments if line.startswith("placement"))
    assert 'base: "fixed" | "free" (Whether the mount holds the robot\'s root' in placement
    assert "mass and joint stiffness s^3, cable force s^2" in placement
    assert "how? ({as for measure})" in described["sweep"].arguments, "what is the same is told of once"
    assert not any(
        line.startswith(("task", "level", "realizable")) for tool in described.values() for line in tool.arguments
    )
    assert 'what ("bends" | "load" | "clearances" | "gaits")' in " ".join(described["measure"].arguments)
    (families,) = described["propose"].arguments
    assert families.startswith("families (list of {name: text (Short label")
