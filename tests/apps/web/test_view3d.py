"""What a view is told and how it obeys, without a browser: facts, frames, commands, ends."""

from __future__ import annotations

import asyncio
import json
import struct
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

pytest.importorskip("nicegui", reason="needs the extra web")

from robots import arm

from aidsr.apps.web.view3d import Episode, Model, SceneStream
from aidsr.apps.web.view3d.frames import Kind, Snapshot, kind_of, pack_frame
from aidsr.core.errors import UserError

WAIT_S = 120.0


def read_frame(message: bytes) -> Snapshot:
    """Read a frame as its module describes it, as `frames.js` does."""
    kind, parts, segments, tendons, controls, time_s, pace = struct.unpack_from("<IIIIIff", message)
    assert kind == Kind.FRAME
    numbers = np.frombuffer(message, "<f4", offset=28)
    poses, pieces, tension, ctrl = np.split(numbers, np.cumsum([12 * parts, 8 * segments, tendons]))
    assert len(ctrl) == controls
    shaped = poses.reshape(parts, 12), pieces.reshape(segments, 8)
    return Snapshot(time_s, pace, *shaped, tension.astype(float), ctrl.astype(float))


def watched(model: Model, talk: Callable[[SceneStream, Any], Awaitable[Any]], **options: float) -> Any:
    async def whole() -> Any:
        stream = SceneStream(model, **options)
        try:
            async with stream.watch() as watcher:
                return await asyncio.wait_for(talk(stream, watcher.__aiter__()), WAIT_S)
        finally:
            stream.close()

    return asyncio.run(whole())


async def until(messages: Any, kind: Kind, holds: Callable[[bytes], bool] = lambda _message: True) -> bytes:
    async for message in messages:
        if kind_of(message) == kind and holds(message):
            return message
    raise AssertionError("the messages ended")


def test_a_frame_is_read_as_it_was_packed() -> None:
    rng = np.random.default_rng(0)
    moment = Snapshot(
        1.5,
        1.0,
        rng.normal(size=(3, 12)).astype(np.float32),
        rng.normal(size=(5, 8)).astype(np.float32),
        np.array([0.0, 2.0]),
        np.array([1.0]),
    )
    found = read_frame(pack_frame(moment))
    assert (found.time_s, found.pace) == (1.5, 1.0)
    for name in ("poses", "segments", "tension_n", "ctrl"):
        np.testing.assert_array_equal(getattr(found, name), getattr(moment, name))


def test_a_person_can_pull_a_tendon() -> None:
    async def talk(stream: SceneStream, messages: Any) -> tuple[Any, Snapshot, Snapshot]:
        facts = json.loads((await until(messages, Kind.FACTS))[4:])
        before = read_frame(await until(messages, Kind.FRAME))
        control = next(each for each in facts["controls"] if each["pulls_tendon"])
        await stream.execute({"do": "ctrl", "values": {str(control["at"]): control["pull"]}})
        after = await until(messages, Kind.FRAME, lambda message: read_frame(message).tension_n.max() > 0.5)
        return facts, before, read_frame(after)

    facts, before, after = watched(Model(arm()), talk)
    assert facts["tendons"]
    assert len(before.poses) > 0
    assert len(before.segments) > 0
    assert after.ctrl.max() > before.ctrl.max()


def test_a_recorded_episode_is_played_in_its_own_scene(tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_string(arm())
    bent = np.linspace(0.0, 0.3, 50)[:, None] * np.ones(model.nq)
    np.savez_compressed(tmp_path / "best.npz", qpos=bent.astype(np.float32), frame_s=0.02, variation=4, mjcf=arm())
    episode = Episode.read(tmp_path / "best.npz", "best of training 1")

    async def talk(stream: SceneStream, messages: Any) -> tuple[Any, Snapshot]:
        await until(messages, Kind.TESTS)
        await stream.execute({"do": "episode", "index": 0})
        told = await until(messages, Kind.STATE, lambda message: b'"episode"' in message)
        await stream.execute({"do": "seek", "time_s": 0.98})
        last = await until(messages, Kind.FRAME, lambda message: read_frame(message).time_s > 0.97)
        return json.loads(told[4:]), read_frame(last)

    state, moment = watched(Model(arm(), episodes=(episode,)), talk)
    assert state["duration_s"] == pytest.approx(0.98)
    data = mujoco.MjData(model)
    data.qpos[:] = 0.3
    mujoco.mj_forward(model, data)
    tip = data.xpos[-1]
    assert np.linalg.norm(moment.poses[:, :3] - tip, axis=1).min() < 0.05


def test_what_is_no_recorded_episode_is_said(tmp_path: Path) -> None:
    (tmp_path / "best.npz").write_bytes(b"no archive")
    with pytest.raises(UserError, match=r"best\.npz is not a recorded episode"):
        Episode.read(tmp_path / "best.npz", "best")
    np.savez_compressed(tmp_path / "huge.npz", qpos=np.zeros((4400, 1000)), frame_s=0.02, mjcf="")
    with pytest.raises(UserError, match="33 MiB, at most 32"):
        Episode.read(tmp_path / "huge.npz", "huge")


def test_what_is_no_model_is_said_and_what_is_no_command_is_refused() -> None:
    async def talk(stream: SceneStream, messages: Any) -> str:
        with pytest.raises(ValueError, match="expected a command of a view"):
            await stream.execute({"do": "load", "mjcf": "<mujoco/>"})
        with pytest.raises(ValueError, match="no episode 7"):
            await stream.execute({"do": "episode", "index": 7})
        told = await until(
            messages, Kind.STATE, lambda message: b"trouble" in message and b'"trouble": ""' not in message
        )
        return str(json.loads(told[4:])["trouble"])

    assert watched(Model("<mujoco><worldbody><body></mujoco>"), talk)


def test_nobody_watching_ends_the_player() -> None:
    async def whole() -> tuple[bool, bool]:
        stream = SceneStream(Model(arm()), linger_s=0.0)
        async with stream.watch() as watcher:
            await asyncio.wait_for(until(watcher.__aiter__(), Kind.FRAME), WAIT_S)
            at_work = stream.runs
        while stream.runs:
            await asyncio.sleep(0.05)
        return at_work, stream.runs

    assert asyncio.run(whole()) == (True, False)
