"""What a view is told and how it obeys, without a browser: facts, frames, commands, ends."""

from __future__ import annotations

import asyncio
import json
import re
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
from aidsr.apps.web.view3d.display_model import DisplayModel
from aidsr.apps.web.view3d.frames import Kind, Snapshot, kind_of, pack_frame
from aidsr.apps.web.view3d.motions import Motion
from aidsr.apps.web.view3d.tracks import tracks_of
from aidsr.core.errors import UserError

WAIT_S = 120.0


def read_frame(message: bytes) -> Snapshot:
    """Read a frame as its module describes it, as `frames.js` does."""
    kind, parts, segments, tendons, controls, contacts, time_s, pace = struct.unpack_from("<IIIIIIff", message)
    assert kind == Kind.FRAME
    numbers = np.frombuffer(message, "<f4", offset=32)
    ends = np.cumsum([12 * parts, 8 * segments, tendons, controls])
    poses, pieces, tension, ctrl, touching = np.split(numbers, ends)
    shaped = poses.reshape(parts, 12), pieces.reshape(segments, 8)
    return Snapshot(time_s, pace, *shaped, tension.astype(float), ctrl.astype(float), touching.reshape(contacts, 6))


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
        rng.normal(size=(2, 6)).astype(np.float32),
    )
    found = read_frame(pack_frame(moment))
    assert (found.time_s, found.pace) == (1.5, 1.0)
    for name in ("poses", "segments", "tension_n", "ctrl", "contacts"):
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


def test_a_slider_says_newtons_for_a_tendon_and_the_unit_of_any_other_command() -> None:
    others = """<mujoco><worldbody><site name="s"/><body pos="1 0 0">
        <joint name="lift" type="slide"/><geom size="0.01"/>
        <body pos="0 0 0.1"><joint name="turn"/><geom size="0.01"/></body></body></worldbody><actuator>
        <position name="height" joint="lift" kp="100"/><velocity name="rate" joint="lift" kv="3"/>
        <motor name="force" joint="lift"/><motor name="torque" joint="turn"/>
        <motor name="geared" joint="turn" gear="5"/>
        <position name="angle" joint="turn" kp="4" kv="1"/><general name="push" site="s" gear="0 1"/>
        <intvelocity name="feed" joint="lift" kp="100" actrange="0 1"/>
        <intvelocity name="spin" joint="turn" kp="9" kv="1" actrange="0 1"/>
        <general name="rising" joint="lift" dyntype="integrator" actrange="0 1" actlimited="true"/>
        </actuator></mujoco>"""
    controls = {each["name"]: each for each in DisplayModel.of(others).facts["controls"]}
    expected = {"height": "m", "rate": "m/s", "force": "N", "torque": "N m", "geared": "", "angle": "rad", "push": "N"}
    expected |= {"feed": "m/s", "spin": "rad/s", "rising": ""}
    assert {name: control["unit"] for name, control in controls.items()} == expected
    shown = DisplayModel.of(arm())
    for drive, control in zip(shown.drives, shown.facts["controls"], strict=True):
        assert control["pulls_n"][0] == pytest.approx(0.0, abs=1e-9)
        assert control["pulls_n"][-1] == pytest.approx(-min(drive.force_low_n, drive.force_high_n), rel=1e-3)
        assert control["pulls_n"][-1] > 0.1
        assert control["pulls_n"] == sorted(control["pulls_n"])


def test_a_slider_of_a_fixed_tendon_says_no_newtons() -> None:
    mjcf = arm()
    joints = re.findall(r'<joint name="([^"]+)"', mjcf)[:2]
    summed = "".join(f'<joint joint="{joint}" coef="1"/>' for joint in joints)
    mjcf = mjcf.replace("</tendon>", f'<fixed name="sum">{summed}</fixed></tendon>')
    mjcf = mjcf.replace("</actuator>", '<motor name="on_sum" tendon="sum" ctrlrange="0 1"/></actuator>')
    controls = {each["name"]: each for each in DisplayModel.of(mjcf).facts["controls"]}
    assert controls["on_sum"]["pulls_tendon"]
    assert (controls["on_sum"]["unit"], controls["on_sum"]["pulls_n"]) == ("", [])


def test_frames_and_inertia_of_bodies_are_where_mujoco_has_them() -> None:
    shown = DisplayModel.of(arm())
    data = mujoco.MjData(shown.model)
    data.qpos[:] = 0.1
    mujoco.mj_forward(shown.model, data)
    shapes = shown.parts.poses(data).astype(float)
    bodies = shown.facts["bodies"]
    assert len(bodies) > 5
    for body in bodies:
        one = data.body(body["name"])
        where, turned = _put(shapes[body["part"]], body["pose"])
        np.testing.assert_allclose(where, one.xpos, atol=2e-6)
        np.testing.assert_allclose(turned.ravel(), one.xmat, atol=1e-5)
        where, turned = _put(shapes[body["part"]], body["inertia"]["pose"])
        np.testing.assert_allclose(where, one.xipos, atol=2e-6)
        squares = np.square(body["inertia"]["size"])
        moments = body["mass_kg"] / 3 * (squares.sum() - squares)
        np.testing.assert_allclose(moments, shown.model.body(body["name"]).inertia, rtol=0.02)


def _put(pose: Any, local: Any) -> tuple[Any, Any]:
    """Return position and rotation of a local pose in the world."""
    turned = np.reshape(pose[3:], (3, 3))
    return pose[:3] + turned @ local[:3], turned @ np.reshape(local[3:], (3, 3))


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
    assert not state["known"], "its cables were not recorded"
    data = mujoco.MjData(model)
    data.qpos[:] = 0.3
    mujoco.mj_forward(model, data)
    tip = data.xpos[-1]
    assert np.linalg.norm(moment.poses[:, :3] - tip, axis=1).min() < 0.05


def test_what_is_known_of_an_episode_becomes_tracks_and_events(tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_string(arm())
    rows = 40
    tension = np.zeros((rows, model.ntendon))
    tension[10, 0] = 152.6
    np.savez_compressed(
        tmp_path / "3.npz",
        qpos=np.zeros((rows, model.nq)),
        ctrl=np.zeros((rows, model.nu)),
        tension_n=tension,
        progress=np.linspace(0, 1, rows),
        holds=np.arange(rows) >= 30,
        contacts=[[20, 0, 0, 0.1, 0, 0, 2.0], [21, 0, 0, 0.1, 0, 0, 1.0]],
        frame_s=0.01,
        mjcf="",
        ended="out_of_time",
    )
    episode = Episode.read(tmp_path / "3.npz", "3 of training 1")

    async def talk(stream: SceneStream, messages: Any) -> tuple[Any, Any, Snapshot]:
        await until(messages, Kind.TESTS)
        await stream.execute({"do": "episode", "index": stream.add(episode)})
        tracks = json.loads((await until(messages, Kind.TRACKS, lambda message: b"tension" in message))[4:])
        state = json.loads((await until(messages, Kind.STATE, lambda message: b'"episode"' in message))[4:])
        await stream.execute({"do": "pause"})
        await stream.execute({"do": "seek", "time_s": 0.2})
        frame = await until(messages, Kind.FRAME, lambda message: len(read_frame(message).contacts) > 0)
        return tracks, state, read_frame(frame)

    tracks, state, moment = watched(Model(arm()), talk)
    assert [track["name"] for track in tracks["tracks"]] == ["cable tension", "contact force", "progress", "command"]
    assert [(event["label"], event["time_s"]) for event in tracks["events"]] == [
        ("peak tension, 153 N", 0.1),
        ("first contact", 0.2),
        ("peak contact force, 2 N", 0.2),
        ("goal first holds", 0.3),
        ("best progress, 1.00", 0.39),
        ("out of time", 0.39),
    ]
    spans = {phase["name"]: phase["spans"] for phase in tracks["phases"]}
    assert spans == {"touching": [[0.2, 0.22]], "goal holds": [[0.3, 0.4]]}
    assert state["known"]
    assert state["speed"] == pytest.approx(0.1), "0.4 s are slowed down to 4 s"
    np.testing.assert_allclose(moment.contacts, [[0, 0, 0.1, 0, 0, 2.0]], atol=1e-6)


def test_a_peak_shorter_than_a_point_of_a_track_is_drawn() -> None:
    shown = DisplayModel.of(arm())
    rows = 5000
    tension = np.zeros((rows, shown.model.ntendon))
    tension[1234, 1] = 30.0
    arrays = {
        "qpos": np.zeros((rows, shown.model.nq)),
        "tension_n": tension,
        "contacts": np.array([[4321.0, 0, 0, 0, 0, 0, 6.5]]),
    }
    told = tracks_of(Motion.recorded(shown.model, 0.01, arrays, ""), shown.facts)
    assert [track["high"] for track in told["tracks"]] == [30.0, 6.5]
    assert {12.34, 43.21} <= set(told["times"])
    assert len(told["times"]) < 1900


def test_a_body_is_dragged_and_what_was_done_is_looked_back_at() -> None:
    async def talk(stream: SceneStream, messages: Any) -> tuple[Any, Any]:
        facts = json.loads((await until(messages, Kind.FACTS))[4:])
        first = read_frame(await until(messages, Kind.FRAME))
        moving = [part for part in facts["parts"] if part["moves"]]
        at = first.poses[len(moving) - 1, :3]
        far = at + np.array([0.2, 0.0, 0.0])
        await stream.execute({"do": "drag", "body": moving[-1]["body"], "point": at.tolist(), "to": far.tolist()})

        def is_aside(message: bytes) -> bool:
            frame = read_frame(message)
            return bool(frame.time_s > 0.5 and frame.poses[len(moving) - 1, 0] > at[0] + 0.005)

        await until(messages, Kind.FRAME, is_aside)
        await stream.execute({"do": "let_go"})
        await stream.execute({"do": "look_back"})
        tracks = json.loads((await until(messages, Kind.TRACKS, lambda message: b"tension" in message))[4:])
        return tracks, json.loads((await until(messages, Kind.STATE, lambda message: b'"past"' in message))[4:])

    tracks, state = watched(Model(arm()), talk)
    assert tracks["times"][-1] == pytest.approx(state["duration_s"], abs=1e-3)


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
