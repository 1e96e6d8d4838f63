"""An agent's session for a job of its own, from the words to a picture of the best motion, and what it may read."""

from __future__ import annotations

import asyncio
import base64
import io
import json
import os
import sys
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from tests.scenes import small_arm

pytest.importorskip("mcp", reason="needs the extra mcp")

from mcp.client import Client
from mcp.client.stdio import StdioServerParameters
from mcp.shared.exceptions import MCPError

import aidsr
from aidsr.examples import examples

START = "import sys; from aidsr.apps.cli import main; sys.argv.insert(1, 'mcp'); main()"


def told(result: Any) -> str:
    assert not result.is_error, result.content[0].text
    return str(result.content[0].text)


def image(result: Any) -> Image.Image:
    (drawn,) = result.content[1:]
    assert drawn.mime_type == "image/png"
    return Image.open(io.BytesIO(base64.b64decode(drawn.data)))


async def sentence(client: Client, address: str) -> str:
    with pytest.raises(MCPError) as error:
        await client.read_resource(address)
    return str(error.value)


def test_a_valve_from_its_environment_to_the_picture_of_the_best_motion(tmp_path: Path) -> None:
    valve = examples()["valve"]
    run = aidsr.design(task="button_pushing", concepts=1, runs=tmp_path / "runs")
    command = StdioServerParameters(
        command=sys.executable,
        args=["-c", START, "--folder", str(tmp_path / "work"), "--runs", str(tmp_path / "runs")],
        env=dict(os.environ),
    )

    async def read(client: Client, address: str) -> str:
        return str((await client.read_resource(address)).contents[0].text)

    async def talk() -> None:
        async with Client(command) as client:
            given = {"objective": valve.objective, "environment": valve.environment, "goal": valve.goal}
            made = await client.call_tool("make_task", given)
            assert told(made).startswith("task_1: base any")
            assert image(made).size > (200, 200)
            refused = await client.call_tool("check", {"task": "button_pushing"})
            assert refused.is_error
            assert "check takes an own task" in refused.content[0].text
            robot = {"mjcf": small_arm(), "functional_part": "tip", "task": "task_1"}
            assert told(await client.call_tool("validate", robot)).startswith("robot_1: stable")
            where = {
                "robot": "robot_1",
                "task": "task_1",
                "placement": {"mount": "mount", "base": "fixed", "rotation_deg": [40, 0, 0]},
            }
            assert told(await client.call_tool("assemble", where)).startswith("scene_1: stable; robot_1 in task_1")
            found = await client.call_tool("probe", {"scene": "scene_1", "seeds": [0], "max_steps": 4000})
            assert "seed 0: progress 0." in told(found)
            strip = image(found)
            assert strip.width == 5 * strip.height
            moments = [
                strip.crop((at, 0, at + strip.height, strip.height)) for at in range(0, strip.width, strip.height)
            ]
            assert len({moment.tobytes() for moment in moments}) >= 2, "it moves"

            assert "aidsr://docs/goals: Goals" in await read(client, "aidsr://docs")
            assert (await read(client, "aidsr://docs/goals")).startswith("# Goals\n")
            assert "aidsr://examples/valve: " in await read(client, "aidsr://examples")
            assert json.loads(await read(client, "aidsr://examples/valve")) == given
            assert 'no example "vlave" (did you mean "valve"?)' in await sentence(client, "aidsr://examples/vlave")
            assert 'no page "gaols" (did you mean "goals"?)' in await sentence(client, "aidsr://docs/gaols")
            assert await read(client, "aidsr://runs") == f"- aidsr://runs/{run.path.name}"
            assert '"outcome"' in await read(client, f"aidsr://runs/{run.path.name}")
            scene = await read(client, f"aidsr://runs/{run.path.name}/designs/1")
            assert scene == run.design(1).final_scene.path.read_text()
            missing = await sentence(client, f"aidsr://runs/{run.path.name}/designs/7")
            assert "has no approved design 7" in missing
            assert '"nothing" is not a run under' in await sentence(client, "aidsr://runs/nothing")

    asyncio.run(talk())
