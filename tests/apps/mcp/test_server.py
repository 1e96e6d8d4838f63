"""An agent's session with the server, over standard input and output as its own client would start it."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("mcp", reason="needs the extra mcp")

from mcp.client import Client
from mcp.client.stdio import StdioServerParameters

from aidsr.apps.mcp.scene_folder import SceneFolder
from aidsr.core.artifacts import Placement, Robot, Scene
from aidsr.core.errors import UserError
from aidsr.tasks import load_task, task_names
from aidsr.teams import rules as builtin

TASK = "reaching/button_pushing"


def session(folder: Path, talk: Callable[[Client], Awaitable[Any]]) -> Any:
    command = StdioServerParameters(
        command=sys.executable,
        args=["-c", "from aidsr.apps.cli import main; main()", "mcp", "--folder", str(folder)],
        env=dict(os.environ),
    )

    async def whole() -> Any:
        async with Client(command) as client:
            return await talk(client)

    return asyncio.run(whole())


def told(result: Any) -> Any:
    return result.structured_content if result.structured_content is not None else json.loads(result.content[0].text)


def test_a_robot_is_designed_in_a_session(tmp_path: Path) -> None:
    brief = load_task(TASK).brief()
    rules = builtin.team(seed=1)
    concept = rules.designer.propose(brief, 1)[0]
    robot = rules.coder.write(brief, concept)
    placement = rules.integrator.place(brief, concept, robot)

    async def talk(client: Client) -> tuple[Any, ...]:
        tools = {tool.name for tool in (await client.list_tools()).tools}
        names = told(await client.call_tool("list_tasks", {}))
        task = told(await client.call_tool("read_task", {"task": TASK}))
        guide = (await client.read_resource("aidsr://mjcf-guide")).contents[0].text
        alone = told(await client.call_tool("validate", {"mjcf": robot.mjcf, "mount": "fixed"}))
        made = told(
            await client.call_tool(
                "assemble_scene",
                {
                    "mjcf": robot.mjcf,
                    "functional_part": robot.functional_part,
                    "task": TASK,
                    "placement": placement.model_dump(mode="json"),
                    "level": "hard",
                },
            )
        )
        drawn = await client.call_tool("render", {"scene": made["scene"]})
        return tools, names, task, guide, alone, made, drawn

    tools, names, task, guide, alone, made, drawn = session(tmp_path, talk)
    assert {"list_tasks", "read_task", "validate", "assemble_scene", "render"} <= tools
    assert [each["name"] for each in names["result"]] == list(task_names())
    assert task["objective"] == brief.objective
    assert "<mujoco" in guide
    assert alone["stable"]
    assert made["stable"], made["account"]
    assert Path(made["path"]).read_text().startswith("<mujoco")
    assert SceneFolder(tmp_path).task(made["scene"]) == load_task(TASK, "hard")
    assert drawn.content[0].mime_type == "image/png"


def test_mistakes_are_sentences_and_the_server_goes_on(tmp_path: Path) -> None:
    async def talk(client: Client) -> list[Any]:
        placement = Placement(mount="nowhere", base="fixed").model_dump(mode="json")
        robot = {"mjcf": "<mujoco/>", "functional_part": "tip"}
        return [
            await client.call_tool("read_task", {"task": "button_pulling"}),
            await client.call_tool("assemble_scene", {**robot, "task": TASK, "placement": placement}),
            await client.call_tool("render", {"scene": "../secret"}),
            await client.call_tool("validate", {"mjcf": "/etc/passwd.xml"}),
            await client.call_tool("validate", {"mjcf": "<!DOCTYPE x [<!ENTITY a 'b'>]><mujoco/>"}),
        ]

    unknown, nowhere, outside, path, hostile = session(tmp_path, talk)
    assert all(result.is_error for result in (unknown, nowhere, outside, path))
    assert "not an MJCF document: '/etc/passwd.xml'" in path.content[0].text
    assert "button_pushing" in unknown.content[0].text
    assert "nowhere" in nowhere.content[0].text
    assert "no scene" in outside.content[0].text
    assert not told(hostile)["stable"]
    assert list(tmp_path.iterdir()) == []


def test_a_scene_is_probed_at_its_level(tmp_path: Path) -> None:
    body = '<body name="robot/tip"><site name="robot/functional_part"/><geom name="robot/tip" size="0.01"/></body>'
    hard = load_task(TASK, "hard")
    still = hard.environment.replace("</worldbody>", f"{body}</worldbody>")  # quickly refused: nothing drives it
    scene = Scene(mjcf=still, placement=Placement(mount="mount", base="fixed"))
    home = SceneFolder(tmp_path).add(Robot(mjcf="<mujoco/>", functional_part="tip"), scene, hard)

    async def talk(client: Client) -> list[Any]:
        found = await client.call_tool("probe", {"scene": home.name})
        (home / "level.txt").unlink()
        return [found, await client.call_tool("probe", {"scene": home.name})]

    found, untold = (result.content[0].text for result in session(tmp_path, talk))
    assert "the robot has no actuators" in found, "the scene was taken for one of its level"
    assert "has no level.txt; assemble the scene again" in untold


def test_a_folder_knows_its_scenes_by_number(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="scenes are: none yet"):
        SceneFolder(tmp_path).scene("0001")
    with pytest.raises(UserError, match='no scene "'):
        SceneFolder(tmp_path).scene("..")
