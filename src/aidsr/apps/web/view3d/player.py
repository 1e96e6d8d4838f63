"""The process that simulates what a view shows: `python -m aidsr.apps.web.view3d.player`, started by `SceneStream`.

Untrusted models are compiled and stepped here and never in the server. The process reads commands, as JSON, from one
pipe and writes messages (see `frames`) to another; each is preceded by its length in eight bytes. It sends frames while
something moves, one a second while nothing does, and ends when its pipe closes. Like the workers of `aidsr.sandbox` it
has no API keys, its own folder, and limits on memory and on the processor time between two frames.
"""

from __future__ import annotations

import base64
import contextlib
import math
import queue
import time
from typing import Any, BinaryIO

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.apps.web.view3d.display_model import DisplayModel
from aidsr.apps.web.view3d.frames import Kind, pack_frame, pack_json
from aidsr.apps.web.view3d.motions import Motion, Tests
from aidsr.apps.web.view3d.playback import SPEED_BOUNDS, Playback
from aidsr.apps.web.view3d.target import TargetSpec
from aidsr.apps.web.view3d.tracks import tracks_of
from aidsr.core.artifacts import ActuatorGroup
from aidsr.core.errors import MjcfError, UserError
from aidsr.sandbox.limits import renew_cpu_limit
from aidsr.sandbox.pipes import connect_to_parent, write_bytes
from aidsr.tasks.mark import Mark

FRAMES_PER_S = 25.0
"""Frame rate while something moves. Our choice: smooth to the eye; the browser may draw more often."""
_HEARTBEAT_S = 1.0
_WATCHABLE_S = 4.0
_SLOWEST = 0.05
"""An episode shorter than `_WATCHABLE_S` is slowed down to take that long, but not below `_SLOWEST` times real time.
Our choices."""
_SHARE_OF_A_CORE = 0.6
"""Maximum share of a core spent on simulation; a model that needs more runs slower than requested."""
_MEMORY_MIB = 4096
_CPU_S = 30
"""Maximum processor time for loading, a test or a frame."""


class Player:
    """Executes commands, and sends the messages from which a viewer draws.

    Args:
        replies: Stream to which messages are written.
    """

    def __init__(self, replies: BinaryIO) -> None:
        self._replies = replies
        self._base: DisplayModel | None = None
        self._playing: Playback | None = None
        self._tests: Tests | None = None
        self._choice: dict[str, Any] = {"mode": "live"}
        self._sent_state: dict[str, Any] = {}
        self._tracked: Motion | None = None
        self._target: TargetSpec = ""
        self._changed = False
        self._last = time.monotonic()

    @property
    def wait_s(self) -> float:
        """Time until the next frame is due [s]."""
        moving = self._changed or (self._playing is not None and self._playing.runs)
        return max(0.0, self._last + (1 / FRAMES_PER_S if moving else _HEARTBEAT_S) - time.monotonic())

    def execute(self, command: dict[str, Any]) -> None:
        """Execute a command; the next frame shows its effect. An invalid command is answered with an error message."""
        self._changed = True
        try:
            if command.get("do") == "load":
                self._load(command)
            elif self._playing is not None:
                self._execute(self._playing, command)
        except MjcfError as error:
            self._send_trouble(f"This model cannot be shown: {error}")
        except MemoryError:
            self._send_trouble("This model needs more memory than a view may use.")
        except (UserError, ValueError, TypeError, KeyError, LookupError) as error:
            self._send_trouble(f"The view could not do that: {error}")

    def tick(self) -> None:
        """Advance by the wall-clock time since the last frame, within a limit, and send a frame."""
        passed = time.monotonic() - self._last
        if self._playing is not None:
            self._playing.advance(min(passed, 3 / FRAMES_PER_S), _SHARE_OF_A_CORE / FRAMES_PER_S)
        self.show()

    def show(self) -> None:
        """Send the current frame, and the state and the tracks where they have changed."""
        self._last, self._changed = time.monotonic(), False
        if self._playing is None:
            self._send(pack_json(Kind.STATE, self._sent_state))
            return
        self._send(pack_frame(self._playing.moment()))
        motion = self._playing.motion
        state = self._choice | {
            "runs": self._playing.runs,
            "speed": self._playing.speed,
            "trouble": self._playing.trouble,
            "duration_s": None if motion is None else round(motion.duration_s, 4),
            "known": motion is None or motion.tension_n is not None,
        }
        if motion is not self._tracked:
            self._tracked = motion
            tracks = {} if motion is None else tracks_of(motion, self._playing.shown.facts)
            self._send(pack_json(Kind.TRACKS, tracks))
        if state != self._sent_state:
            self._sent_state = state
            self._send(pack_json(Kind.STATE, state))

    def _load(self, command: dict[str, Any]) -> None:
        groups = [ActuatorGroup.model_validate(group) for group in command["groups"]]
        wanted = command["target"]
        self._target = wanted if isinstance(wanted, str) else [Mark.model_validate(mark) for mark in wanted]
        self._base = DisplayModel.of(
            command["mjcf"],
            mount=command["mount"],
            environment=command["environment"],
            groups=groups,
            target=self._target,
        )
        if command["before"]:
            with contextlib.suppress(MjcfError):  # an earlier version may be invalid
                before = DisplayModel.of(
                    command["before"], mount=command["mount"], environment=command["environment"], groups=()
                )
                self._base.facts["ghost"] = {
                    "parts": [part for part in before.facts["parts"] if part["robot"] and part["kind"] == "geom"],
                    "surfaces": before.facts["surfaces"],
                    "length_m": before.facts["length_m"],
                }
        self._put_on(self._base)
        self.show()
        self._tests = Tests(self._base)
        self._send(pack_json(Kind.TESTS, {"tests": self._tests.labels}))

    def _put_on(self, shown: DisplayModel) -> None:
        """Show a model, live, in place of the current one; keep the current one if it is the same model."""
        if self._playing is None or self._playing.shown is not shown:
            speed = 1.0 if self._playing is None else self._playing.speed
            self._playing = Playback(shown)
            self._playing.speed = speed
            self._send(pack_json(Kind.FACTS, shown.facts))
        self._choice = {"mode": "live"}

    def _execute(self, playing: Playback, command: dict[str, Any]) -> None:
        match command:
            case {"do": "play"}:
                playing.resume()
            case {"do": "pause"}:
                playing.runs = False
            case {"do": "reset"}:
                playing.reset()
            case {"do": "seek", "time_s": time_s}:
                playing.seek(_number(time_s))
            case {"do": "speed", "times": times}:
                playing.speed = min(max(_number(times), SPEED_BOUNDS[0]), SPEED_BOUNDS[1])
            case {"do": "ctrl", "values": dict(values)}:
                if self._choice["mode"] != "live":
                    playing = self._live()
                playing.command({int(at): _number(value) for at, value in values.items()})
            case {"do": "live"}:
                self._live()
            case {"do": "test", "index": int(index)}:
                self._live().play_back((self._tests or Tests(playing.shown)).motion(index))
                self._choice = {"mode": "test", "index": index}
            case {"do": "look_back"}:
                past = playing.look_back()
                if past is not None:
                    playing.play_back(past)
                    self._choice = {"mode": "past"}
            case {"do": "drag", "body": str(body), "point": list(point), "to": list(to)}:
                playing.drag(body, _point(point), _point(to))
            case {"do": "let_go"}:
                playing.let_go()
            case {"do": "episode"}:
                self._episode(command)
            case _:
                raise ValueError(f"there is no such command: {str(command)[:80]}")

    def _live(self) -> Playback:
        """Return the live simulation of the loaded model, which the scene of a varied episode may have replaced."""
        if self._base is None:
            raise ValueError("nothing has been loaded")
        self._put_on(self._base)
        if self._playing is None:
            raise ValueError("nothing is shown")
        self._playing.go_live()
        self._playing.speed = 1.0
        return self._playing

    def _episode(self, command: dict[str, Any]) -> None:
        """Play an episode back; the command contains its arrays, as 32-bit floats in base64, and their shapes."""
        if self._base is None:
            raise ValueError("nothing has been loaded")
        shown = DisplayModel.of(command["mjcf"], target=self._target) if command["mjcf"] else self._base
        arrays = {
            name: np.frombuffer(base64.b64decode(one["data"]), "<f4").astype(float).reshape(one["shape"])
            for name, one in command["arrays"].items()
        }
        motion = Motion.recorded(shown.model, _number(command["frame_s"]), arrays, command["ended"])
        self._put_on(shown)
        if self._playing is not None:
            self._playing.play_back(motion)
            # an episode may succeed within a fraction of a second: it is slowed down so that it can be followed
            self._playing.speed = min(1.0, max(_SLOWEST, round(motion.duration_s / _WATCHABLE_S, 2)))
        self._choice = {"mode": "episode", "index": int(command["index"])}

    def _send_trouble(self, text: str) -> None:
        self._sent_state = {**self._sent_state, "trouble": text}
        self._send(pack_json(Kind.STATE, self._sent_state))

    def _send(self, message: bytes) -> None:
        write_bytes(self._replies, message)


def main() -> None:
    """Execute commands until the server closes the pipe."""
    inbox, replies = connect_to_parent(_MEMORY_MIB)
    mujoco.set_mju_user_warning(lambda _message: None)
    player = Player(replies)
    while True:
        renew_cpu_limit(_CPU_S)
        try:
            command = inbox.get(timeout=player.wait_s)
        except queue.Empty:
            player.tick()
        else:
            player.execute(command)


def _point(values: list[object]) -> NDArray[np.float64]:
    if len(values) != 3:
        raise ValueError(f"expected a point, found {str(values)[:40]}")
    return np.array([_number(value) for value in values])


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"expected a number, found {str(value)[:40]}")
    return float(value)


if __name__ == "__main__":
    with contextlib.suppress(BrokenPipeError):  # the server has ended
        main()
