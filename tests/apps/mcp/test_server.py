"""An agent's session with the server, over standard input and output as its own client would start it."""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mcp", reason="needs the extra mcp")

from mcp.client import Client
from mcp.client.stdio import StdioServerParameters

from aidsr.core.artifacts import Placement
from aidsr.tasks import load_task, task_names
from aidsr.teams import rules as builtin
from aidsr.tools import OWNER_TOOLS, TOOLS, Workspace

TASK = "reaching/button_pushing"


def session(folder: Path, talk: Callable[[Client], Awaitable[Any]]) -> Any:
    command = StdioServerParameters(
        command=sys.executable,
        args=["-c", "from aidsr.apps.cli import main; main()", "mcp", "--folder", str(folder)],
        env=dict(os.environ),
    )
    return talked(command, talk)


def talked(command: StdioServerParameters, talk: Callable[[Client], Awaitable[Any]]) -> Any:
    async def whole() -> Any:
        async with Client(command) as client:
            return await talk(client)

    return asyncio.run(whole())


def text(result: Any) -> str:
    return str(result.content[0].text)


def told(result: Any) -> Any:
    return json.loads(text(result))


def test_a_robot_is_designed_in_a_session(tmp_path: Path) -> None:
    brief = load_task(TASK).brief()
    rules = builtin.team(seed=1)
    concept = rules.designer.propose(brief, 1)[0]
    robot = rules.coder.write(brief, concept)
    placement = rules.integrator.place(brief, concept, robot)

    async def talk(client: Client) -> tuple[Any, ...]:
        tools = {tool.name: tool for tool in (await client.list_tools()).tools}
        names = told(await client.call_tool("list_tasks", {}))
        task = told(await client.call_tool("read_task", {"task": TASK}))
        guide = (await client.read_resource("aidsr://mjcf-guide")).contents[0].text
        given = {"mjcf": robot.mjcf, "functional_part": robot.functional_part, "mount": "fixed"}
        alone = text(await client.call_tool("validate", given))
        where = {"task": TASK, "placement": placement.model_dump(mode="json"), "level": "hard"}
        made = text(await client.call_tool("assemble", {"robot": "robot_1", **where}))
        motion = {"scene": "scene_1", "script": "*: 0", "seconds": 0.2}
        played = await client.call_tool("play", motion)
        drawn = await client.call_tool("look", {"subject": "scene_1"})
        return tools, names, task, guide, alone, made, played, drawn

    tools, names, task, guide, alone, made, played, drawn = session(tmp_path, talk)
    assert set(tools) == {*OWNER_TOOLS, "check", *TOOLS}
    assert tools["sweep"].description == TOOLS["sweep"].description
    assert set(tools["sweep"].input_schema["properties"]) == set(TOOLS["sweep"].arguments.model_fields)
    assert [each["name"] for each in names] == list(task_names())
    assert task["objective"] == brief.objective
    assert "<mujoco" in guide
    assert alone.startswith("robot_1: stable"), alone
    assert made.startswith("scene_1: stable; robot_1 in reaching/button_pushing"), made
    assert (tmp_path / "scene_1" / "scene.xml").read_text().startswith("<mujoco")
    assert Workspace(tmp_path).record("scene_1").level == "hard"
    assert text(played).startswith("0.2 s of development variation 0, best progress 0")
    assert "Ended: all that was to be played was played" in text(played).splitlines()[0]
    assert drawn.content[1].mime_type == "image/png"


def test_mistakes_are_sentences_and_the_server_goes_on(tmp_path: Path) -> None:
    async def talk(client: Client) -> list[Any]:
        placement = Placement(mount="nowhere", base="fixed").model_dump(mode="json")
        await client.call_tool("validate", {"mjcf": "<mujoco><worldbody><body name='tip'/></worldbody></mujoco>"})
        return [
            await client.call_tool("read_task", {"task": "button_pulling"}),
            await client.call_tool("assemble", {"robot": "robot_1", "task": TASK, "placement": placement}),
            await client.call_tool("assemble", {"robot": "robot_1", "placement": placement}),
            await client.call_tool("look", {"subject": "../secret"}),
            await client.call_tool("read", {"name": "../../etc/passwd"}),
            await client.call_tool("validate", {"mjcf": "/etc/passwd.xml"}),
            await client.call_tool("validate", {"mjcf": "<!DOCTYPE x [<!ENTITY a 'b'>]><mujoco/>"}),
        ]

    *mistakes, hostile = session(tmp_path, talk)
    assert all(result.is_error for result in mistakes)
    unknown, nowhere, untold, outside, secret, path = map(text, mistakes)
    assert "button_pushing" in unknown
    assert "nowhere" in nowhere
    assert "name a task" in untold
    assert 'no robot or scene "../secret"; robots: robot_1' in outside
    assert 'no robot or scene "../../etc/passwd"' in secret
    assert "not an MJCF document: '/etc/passwd.xml'" in path
    assert not hostile.is_error
    assert text(hostile).startswith("robot_2: not stable, its physics does not hold\n")
    assert {path.name for path in tmp_path.iterdir()} == {"robot_1", "robot_2"}


def test_the_entry_it_prints_starts_the_server_from_any_directory_without_an_environment(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "aidsr", "mcp", "--folder", "scenes", "--config"]
    printed = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    entry = json.loads(printed)["mcpServers"]["aidsr"]
    assert str(tmp_path / "scenes") in entry["args"]
    assert str(tmp_path / "runs") in entry["args"]
    command = StdioServerParameters(**entry, cwd="/", env={"PATH": "/usr/bin:/bin"})
    called = talked(command, lambda agent: agent.call_tool("list_tasks", {}))
    assert "button_pushing" in called.content[0].text
    assert list(tmp_path.iterdir()) in ([], [tmp_path / "scenes"])
