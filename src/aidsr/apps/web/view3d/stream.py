"""The server's side of a view: a player process while a browser watches, whose messages are forwarded to browsers."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import secrets
import shutil
import signal
import struct
import sys
import tempfile
import zipfile
from collections.abc import AsyncIterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from aidsr.apps.web.view3d.frames import Kind, kind_of, pack_json
from aidsr.apps.web.view3d.target import TargetSpec
from aidsr.core.artifacts import ActuatorGroup
from aidsr.core.errors import UserError
from aidsr.mjcf.read import open_mjcf
from aidsr.sandbox.environment import child_environment
from aidsr.validation.validator import Mount

_LENGTH = struct.Struct(">Q")
_MAX_MESSAGE = 128 * 2**20
"""Maximum size of a message in bytes, enough for the facts of a model with large surfaces; a frame has some 10 KB."""
_MAX_EPISODE = 32 * 2**20
"""Maximum size of an unpacked episode in bytes; one of a minute at 50 rows/s with 100 positions has 1 MiB."""
_SILENCE_S = 180.0
"""Time without a message after which a player is killed. A player sends a message every second, and the system kills it
after 30 s of processor time, which take longer in wall-clock time on a busy machine."""
_LINGER_S = 5.0
"""How long a player keeps running unwatched, so that a reloaded page finds the robot in the same state."""
_FROM_BROWSER = frozenset(
    {"play", "pause", "reset", "seek", "speed", "ctrl", "live", "test", "episode", "look_back", "drag", "let_go"}
)
_OPTIONAL = ("tension_n", "ctrl", "contacts", "progress", "holds")


@dataclass(frozen=True, eq=False)
class Episode:
    """A recorded motion of the model that a view shows.

    Attributes:
        name: Name in the list of episodes.
        frame_s: Time between two rows [s].
        arrays: `qpos`, (n_frames, nq), and optional arrays; see `aidsr.learn.episodes.recording.record_rollout`.
        mjcf: The scene with the elements that the episode's variation moved or resized; empty where nothing visible
            differs.
        ended: How the episode ended, in a word; empty where that is unknown.
    """

    name: str
    frame_s: float
    arrays: Mapping[str, NDArray[np.floating]]
    mjcf: str = ""
    ended: str = ""

    @classmethod
    def read(cls, file: Path | BinaryIO, name: str) -> Episode:
        """Return an episode from an .npz file written by a training or a recording.

        Raises:
            UserError: The file is too large, or not a recorded episode.
        """
        title = file.name if isinstance(file, Path) else name
        try:
            with zipfile.ZipFile(file) as archive:
                size = sum(one.file_size for one in archive.infolist())
            if size > _MAX_EPISODE:
                raise UserError(f"{title} is too large: {size // 2**20} MiB, at most 32")
            with np.load(file, allow_pickle=False) as stored:
                names = ("qpos", *(one for one in _OPTIONAL if one in stored))
                arrays = {one: np.asarray(stored[one], float) for one in names}
                ended = str(stored["ended"]) if "ended" in stored else ""
                return cls(name, float(stored["frame_s"]), arrays, str(stored["mjcf"]), ended)
        except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
            raise UserError(f"{title} is not a recorded episode ({error})") from None


@dataclass(frozen=True, eq=False)
class Model:
    """The robot or scene that a view shows, and what can be played or shown with it.

    Attributes:
        mjcf: Robot or scene, as text or as the path of its file.
        mount: Mount of a robot shown alone; see `aidsr.validation.validate`.
        environment: MJCF of the environment whose physics options apply to a robot shown alone; empty for the robot's
            own options.
        groups: Actuators that act together, as the robot's author defines them.
        episodes: Recorded motions that can be played.
        before: MJCF of an earlier version, which can be shown as a ghost; empty for none.
        target: TOML of the goal, or marks of the task, whose target can be shown as a ghost; empty for none.
    """

    mjcf: str | Path
    mount: Mount = "auto"
    environment: str = ""
    groups: Sequence[ActuatorGroup] = ()
    episodes: Sequence[Episode] = ()
    before: str = ""
    target: TargetSpec = ""

    @property
    def command(self) -> dict[str, Any]:
        """The command that loads this model into a player.

        Raises:
            UserError: The MJCF file does not exist.
            MjcfError: The MJCF file is too large.
        """
        wanted = self.target
        return {
            "do": "load",
            "mjcf": open_mjcf(self.mjcf) if isinstance(self.mjcf, Path) else self.mjcf,
            "mount": self.mount,
            "environment": self.environment,
            "before": self.before,
            "target": wanted if isinstance(wanted, str) else [mark.model_dump() for mark in wanted],
            "groups": [group.model_dump() for group in self.groups],
        }


class Watcher:
    """Messages not yet sent to a browser: the newest of each kind, so that a slow browser misses frames, not facts."""

    def __init__(self, known: Mapping[Kind, bytes]) -> None:
        self._pending = dict(known)
        self._news = asyncio.Event()
        if known:
            self._news.set()

    def put(self, kind: Kind, message: bytes) -> None:
        """Add a message; it replaces an older one of its kind."""
        _replace(self._pending, kind, message)
        self._news.set()

    async def __aiter__(self) -> AsyncIterator[bytes]:
        """Yield messages as they arrive, without end."""
        while True:
            await self._news.wait()
            self._news.clear()
            while self._pending:
                yield self._pending.pop(next(iter(self._pending)))


class SceneStream:
    """A simulated model that any number of browsers watch at once.

    The player process runs only while a browser watches, and for some seconds after. It is started again when a browser
    reconnects.

    Args:
        model: The model to show.
        linger_s: How long the player keeps running unwatched [s].

    Attributes:
        id: Random identifier with which a browser requests the stream; cannot be guessed.
    """

    def __init__(self, model: Model, *, linger_s: float = _LINGER_S) -> None:
        self.id = secrets.token_urlsafe(18)
        self._model, self._linger_s = model, linger_s
        self._episodes = list(model.episodes)
        self._watchers: set[Watcher] = set()
        self._known: dict[Kind, bytes] = {}
        self._process: asyncio.subprocess.Process | None = None
        self._reading: asyncio.Task[None] | None = None
        self._leaving: asyncio.TimerHandle | None = None
        self._starting = asyncio.Lock()

    @property
    def runs(self) -> bool:
        """Whether a player process is running."""
        return self._process is not None and self._process.returncode is None

    @property
    def pid(self) -> int | None:
        """Process id of the player; None while none is running."""
        return self._process.pid if self._process is not None and self.runs else None

    @contextlib.asynccontextmanager
    async def watch(self) -> AsyncIterator[Watcher]:
        """Register a watcher for the duration of the context; the first one starts the player."""
        if self._leaving is not None:
            self._leaving.cancel()
            self._leaving = None
        watcher = Watcher(self._known if self.runs else {})
        self._watchers.add(watcher)
        try:
            await self._start()
            yield watcher
        finally:
            self._watchers.discard(watcher)
            if not self._watchers:
                loop = asyncio.get_running_loop()
                self._leaving = loop.call_later(self._linger_s, self._end)

    async def execute(self, command: object) -> None:
        """Execute a command from a browser; a player that has ended is started again.

        Raises:
            ValueError: It is not a command that a browser may send.
        """
        if not isinstance(command, dict) or command.get("do") not in _FROM_BROWSER:
            raise ValueError(f"expected a command of a view, found {str(command)[:80]}")
        if command["do"] == "episode":
            command = command | self._episode(command.get("index"))
        await self._start()
        await self._send(command)

    def add(self, episode: Episode) -> int:
        """Add an episode, or replace the one of the same name, and return its index."""
        for index, known in enumerate(self._episodes):
            if known.name == episode.name:
                self._episodes[index] = episode
                return index
        self._episodes.append(episode)
        return len(self._episodes) - 1

    def close(self) -> None:
        """End the player; browsers that still watch get no more frames."""
        self._end()

    def _episode(self, index: object) -> dict[str, Any]:
        if not isinstance(index, int) or not 0 <= index < len(self._episodes):
            raise ValueError(f"there is no episode {index} of this design")
        episode = self._episodes[index]
        arrays = {
            name: {
                "shape": values.shape,
                "data": base64.b64encode(np.ascontiguousarray(values, "<f4").tobytes()).decode(),
            }
            for name, values in episode.arrays.items()
        }
        return {"arrays": arrays, "frame_s": episode.frame_s, "mjcf": episode.mjcf, "ended": episode.ended}

    async def _start(self) -> None:
        async with self._starting:
            if self.runs:
                return
            try:
                load = self._model.command
            except Exception as error:  # any reason why the file cannot be read is shown in the view
                self._broadcast(pack_json(Kind.STATE, {"trouble": f"This model cannot be shown: {error}"}))
                return
            self._known.clear()
            folder = Path(tempfile.mkdtemp(prefix="aidsr-view-"))
            self._process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-P", "-m", "aidsr.apps.web.view3d.player"),
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.DEVNULL,
                cwd=folder,
                env=child_environment(folder),
                start_new_session=True,
            )
            self._reading = asyncio.create_task(self._read(self._process, folder))
            await self._send(load)

    async def _send(self, command: dict[str, Any]) -> None:
        pipe = self._process.stdin if self._process is not None else None
        if pipe is None:
            return
        body = json.dumps(command).encode()
        pipe.write(_LENGTH.pack(len(body)) + body)
        with contextlib.suppress(ConnectionError):  # the player has ended; `_read` notifies the watchers
            await pipe.drain()

    async def _read(self, process: asyncio.subprocess.Process, folder: Path) -> None:
        """Forward a player's messages until it ends, then report how it ended, unless it was stopped on purpose."""
        silent = False
        try:
            while True:
                self._broadcast(await asyncio.wait_for(_message(process), _SILENCE_S))
        except asyncio.IncompleteReadError:
            pass
        except TimeoutError:
            silent = True
        finally:
            if process.returncode is None:
                process.kill()
            code = await process.wait()
            shutil.rmtree(folder, ignore_errors=True)
        if self._process is process:
            self._process = None
            self._known.clear()
            self._broadcast(pack_json(Kind.STATE, {"runs": False, "trouble": _ending(code, silent)}))

    def _broadcast(self, message: bytes) -> None:
        kind = kind_of(message)
        _replace(self._known, kind, message)
        for watcher in self._watchers:
            watcher.put(kind, message)

    def _end(self) -> None:
        process, self._process = self._process, None
        self._known.clear()
        if process is not None and process.returncode is None:
            process.kill()


def _replace(messages: dict[Kind, bytes], kind: Kind, message: bytes) -> None:
    messages.pop(kind, None)
    if kind == Kind.FACTS:
        messages.pop(Kind.FRAME, None)  # it shows the previous model
    messages[kind] = message


async def _message(process: asyncio.subprocess.Process) -> bytes:
    pipe = process.stdout
    if pipe is None:
        raise RuntimeError("the player was started without a pipe")
    (length,) = _LENGTH.unpack(await pipe.readexactly(_LENGTH.size))
    if length > _MAX_MESSAGE:
        process.kill()
    return await pipe.readexactly(min(length, _MAX_MESSAGE))


def _ending(code: int, silent: bool) -> str:
    if silent or (sys.platform != "win32" and code == -signal.SIGXCPU):
        return "This model is too slow to be shown; reset to try again."
    if sys.platform != "win32" and code == -signal.SIGKILL:
        return "This model needs more memory than there is; reset to try again."
    return "The simulation of this model crashed; reset to try again."
