"""What a client sends wrongly or on purpose comes back as one sentence, and the server goes on."""

from __future__ import annotations

import json
import os
import queue
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.scenes import small_arm

pytest.importorskip("mcp", reason="needs the extra mcp")

PATIENCE_S = 120.0
"""Only what hangs takes so long."""
NINES = "9" * 5000
PLACED = '{"robot": "robot_1", "task": "button_pushing", "placement": {"mount": "mount", "base": "fixed", %s}}'
REACH = 'kind = "reach"\ntarget = "bell"'
GAITS = '{"what": "gaits", "subject": "scene_1", "how": {%s}}'


class Session:
    """A server, and raw lines to it: JSON that no honest client would write."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.log = folder / "work", folder / "log"
        self._log = self.log.open("w")
        self._process = subprocess.Popen(
            [sys.executable, "-c", "from aidsr.apps.cli import main; main()", "mcp", "--folder", str(self.folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            text=True,
            env=dict(os.environ),
        )
        self._lines: queue.Queue[str] = queue.Queue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self._number = 0
        client = {"protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "a", "version": "1"}}
        self._send(json.dumps({"jsonrpc": "2.0", "id": 0, "method": "initialize", "params": client}))
        self._lines.get(timeout=PATIENCE_S)
        self._send(json.dumps({"jsonrpc": "2.0", "method": "notifications/initialized"}))

    def _read(self) -> None:
        for line in self._process.stdout:
            self._lines.put(line)

    def _send(self, line: str) -> None:
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def call(self, tool: str, arguments: str) -> tuple[bool, str]:
        """Return whether a call failed, and its text. Arguments are JSON as it is sent."""
        self._number += 1
        named = f'{{"name": "{tool}", "arguments": {arguments}}}'
        self._send(f'{{"jsonrpc": "2.0", "id": {self._number}, "method": "tools/call", "params": {named}}}')
        answer: dict[str, Any] = json.loads(self._lines.get(timeout=PATIENCE_S))
        assert answer["id"] == self._number
        return bool(answer["result"].get("isError")), str(answer["result"]["content"][0]["text"])

    def close(self) -> None:
        with self._process as process:
            process.stdin.close()
            process.wait(PATIENCE_S)
            self._reader.join(PATIENCE_S)
        self._log.close()


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Session]:
    session = Session(tmp_path_factory.mktemp("hostile"))
    session.call("validate", json.dumps({"mjcf": small_arm(), "functional_part": "tip"}))
    failed, text = session.call("assemble", PLACED % '"reason": ""')
    assert not failed, text
    yield session
    session.close()


HOSTILE: dict[str, tuple[str, str, str]] = {
    "nan": ("play", '{"scene": "scene_1", "script": "*: 0", "seconds": NaN}', "seconds should be a finite number"),
    "infinity": ("probe", '{"scene": "scene_1", "seconds": 1e999}', "seconds should be a finite number, not inf"),
    "nan as text": ("assemble", PLACED % '"position_m": [0, 0, "nan"]', "position_m.2 should be a finite number"),
    "infinity as text": ("assemble", PLACED % '"rotation_deg": [0, "1e999", 0]', "rotation_deg.1 should be a finite"),
    "a force past all bounds": (
        "measure",
        '{"what": "load", "subject": "robot_1", "how": {"force_n": 1e300}}',
        "how.force_n should be less than or equal to 10000",
    ),
    "an integer of 400 digits": ("probe", f'{{"scene": "scene_1", "max_steps": {NINES[:400]}}}', "steps is too large"),
    "one as text": ("measure", GAITS % f'"seeds": ["{NINES[:4000]}"]', "how.seeds.0 is too large"),
    "a line past 2**53": ("read", '{"name": "robot_1", "first_line": 9007199254740993}', "first_line is too large"),
    "a negative seed": ("probe", '{"scene": "scene_1", "seeds": [-1]}', "seeds.0 should be greater than or equal to 0"),
    "no seed": ("measure", GAITS % '"seeds": []', "how.seeds needs at least 1 of its kind"),
    "a negative variation": ("play", '{"scene": "scene_1", "script": "*: 0", "variation": -1}', "variation should be"),
    "a superscript": ("play", '{"scene": "scene_1", "script": "*: 0", "seconds": "²"}', "should be a valid number"),
    "a superscript in a name": ("play", '{"scene": "scene_²", "script": "*: 0"}', 'no scene "scene_²"'),
    "a null byte in a name": ("look", '{"subject": "robot_\\u0000"}', "no robot"),
    "an unknown argument": (
        "play",
        '{"scene": "scene_1", "script": "*: 0", "secnds": 1}',
        'there is no argument "secnds" (did you mean "seconds"?)',
    ),
    "an unknown argument inside": ("measure", GAITS % '"gait": 1', 'there is no argument "how.gait"'),
    "an argument where none is": ("list_tasks", '{"x": 1}', 'there is no argument "x". Its arguments: none'),
    "a long unknown argument": ("play", json.dumps({"x" * 100_000: 1}), f'there is no argument "{"x" * 60}…"'),
    "no arguments": ("play", "{}", "scene is missing; script is missing. Its arguments: scene, script"),
    "a list for a text": ("validate", '{"mjcf": [1]}', "mjcf should be a valid string"),
    "a text for an object": ("assemble", '{"robot": "robot_1", "placement": "there"}', "placement should be an object"),
    "lists 150 deep": ("validate", f'{{"mjcf": "<", "actuator_groups": {"[" * 150}{"]" * 150}}}', "actuator_groups.0"),
    "2,000 groups": ("validate", f'{{"mjcf": "<", "actuator_groups": [{", ".join("1" * 2000)}]}}', "2,000 entries"),
    "an unknown level": ("read_task", '{"task": "button_pushing", "level": "x"}', "'standard' or 'hard'"),
    "a name of 600 characters": ("read_task", json.dumps({"task": "b" * 600}), "task has 600 characters, at most 500"),
    "a document of 5 MB": ("validate", json.dumps({"mjcf": "<" * 5_000_000}), "at most 4,194,304 are allowed"),
    "a patch of 1.05 MB": ("edit", json.dumps({"robot": "robot_1", "patch": "<patch>" * 150_000}), "at most 1,000,000"),
    "an involved path": (
        "edit",
        json.dumps({"robot": "robot_1", "patch": "<set sel='//*//*//*//*//*//*//*//*' pos='0 0 0'/>"}),
        "is too involved",
    ),
    "a script of one long word": ("play", json.dumps({"scene": "scene_1", "script": "x" * 9000}), "has no group"),
    "a script with infinity": ("play", '{"scene": "scene_1", "script": "*: t=0 1e999"}', "not finite or too large"),
    "a path for an environment": (
        "make_task",
        '{"objective": "x", "environment": "/etc/passwd", "goal": "kind = \\"reach\\""}',
        "not an MJCF document: '/etc/passwd'",
    ),
    "an environment with entities": (
        "make_task",
        json.dumps({"objective": "x", "environment": "<!DOCTYPE x [<!ENTITY a 'b'>]><mujoco/>", "goal": REACH}),
        "cannot load the environment of the goal",
    ),
    "an unknown kind of goal": (
        "make_task",
        '{"objective": "x", "environment": "<mujoco/>", "goal": "kind = \\"raech\\""}',
        'the goal has an unknown kind \'raech\' (did you mean "reach"?)',
    ),
    "no TOML": ("make_task", '{"objective": "x", "environment": "<mujoco/>", "goal": "]"}', "cannot read the goal as"),
    "a goal of 20,000 characters": (
        "make_task",
        json.dumps({"objective": "x", "environment": "<mujoco/>", "goal": "#" * 20_000}),
        "goal has 20,000 characters",
    ),
    "a target that is not there": (
        "make_task",
        json.dumps({"objective": "x", "environment": "<mujoco/>", "goal": REACH}),
        '"bell"',
    ),
    "an own task that is not there": ("read_task", '{"task": "task_9"}', 'no task "task_9"; tasks: none yet'),
    "an own task that climbs": ("assemble", PLACED.replace("button_pushing", "task_1/..") % '"reason": ""', "no task"),
    "a score of what was not trained": ("evaluate", '{"scene": "scene_1"}', "scene_1 has no trained policy; train it"),
    "a score in no episode": ("evaluate", '{"scene": "scene_1", "episodes": 0}', "episodes should be greater than"),
    "a training of a robot alone": ("train", '{"scene": "robot_1", "steps": 2000}', "nothing measures success here"),
}  # fmt: skip


@pytest.mark.parametrize("name", HOSTILE)
def test_each_is_one_sentence(name: str, session: Session) -> None:
    tool, arguments, words = HOSTILE[name]
    failed, text = session.call(tool, arguments)
    assert failed
    assert words in text
    assert len(text) < 2000
    assert "\n" not in text
    assert not any(unwanted in text for unwanted in ("pydantic", "Traceback", "Error executing", "validation error"))


def test_numbers_that_are_none_in_a_sweep_are_told_of_in_its_rows(session: Session) -> None:
    varied = {"subject": "robot_1", "what": "bends", "select": "//joint", "attribute": "stiffness"}
    failed, text = session.call("sweep", json.dumps({**varied, "values": ["nan", "1e999", "²", NINES, "0.2"]}))
    assert not failed
    _, _, nan, infinite, superscript, nines, good = text.splitlines()
    assert all(" | failed: " in row for row in (nan, infinite, superscript, nines))
    assert good.startswith("0.2 | ")
    assert "failed" not in good


def test_an_object_that_a_client_sends_as_text_is_understood(session: Session) -> None:
    placement = json.dumps({"mount": "mount", "base": "fixed"})
    given = {"robot": "robot_1", "task": "button_pushing", "placement": placement}
    failed, text = session.call("assemble", json.dumps(given))
    assert not failed
    assert "robot_1 in reaching/button_pushing" in text


@pytest.mark.parametrize("content", [b"", b"{", b"[1]", b'{"a": 1}', b"\xff\xfe", None])
@pytest.mark.parametrize("file", ["robot.json", "robot.xml"])
def test_a_damaged_file_of_the_folder_is_one_sentence(
    file: str, content: bytes | None, session: Session, tmp_path: Path
) -> None:
    path = session.folder / "robot_1" / file
    before = path.read_bytes()
    path.unlink()
    if content is not None:
        path.write_bytes(content)
    try:
        failed, text = session.call("fix", '{"robot": "robot_1"}')
    finally:
        path.write_bytes(before)
    assert "\n" not in text or not failed
    if file == "robot.json" or content in (b"\xff\xfe", None):
        assert failed
        assert text == f"{path} is missing or damaged; validate the robot again"


def test_the_log_of_the_server_holds_no_traceback(session: Session) -> None:
    assert not session.call("list_tasks", "{}")[0]
    assert "Traceback" not in session.log.read_text()
