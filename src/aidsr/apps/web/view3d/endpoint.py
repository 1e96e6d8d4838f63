"""The WebSocket over which a browser watches a view and sends commands to it.

`aidsr.apps.web.guard` has checked the request before. A view is addressed by the random id that its page was given,
never by a path.
"""

from __future__ import annotations

import asyncio
import json
from typing import TYPE_CHECKING

from starlette.websockets import WebSocket, WebSocketDisconnect

from aidsr.apps.web.view3d.stream import SceneStream, Watcher

if TYPE_CHECKING:
    from fastapi import FastAPI

ADDRESS = "/view3d"
_MAX_COMMAND = 16_384
"""Maximum length of a command in characters; a command for a hundred actuators has some 3,000."""
_UNKNOWN_VIEW = 4404
"""Close code after which a browser does not reconnect."""


class Views:
    """The streams of the open views, by their ids."""

    def __init__(self) -> None:
        self._streams: dict[str, SceneStream] = {}

    def add(self, stream: SceneStream) -> None:
        """Let browsers watch a stream."""
        self._streams[stream.id] = stream

    def remove(self, stream: SceneStream) -> None:
        """End a stream, and let no more browsers watch it."""
        self._streams.pop(stream.id, None)
        stream.close()

    def find(self, view: str) -> SceneStream | None:
        """Return the stream with the id `view`; None where there is none."""
        return self._streams.get(view)


def serve_views(app: FastAPI, views: Views) -> None:
    """Add the WebSocket of the views to a server."""

    async def watch_view(websocket: WebSocket, view: str) -> None:
        await websocket.accept()
        stream = views.find(view)
        if stream is None:
            await websocket.close(_UNKNOWN_VIEW, "there is no such view")
            return
        async with stream.watch() as watcher:
            await _converse(websocket, stream, watcher)

    app.add_api_websocket_route(f"{ADDRESS}/{{view}}", watch_view, name="view3d")


async def _converse(websocket: WebSocket, stream: SceneStream, watcher: Watcher) -> None:
    """Send messages to a browser and execute its commands until it disconnects."""
    sending = asyncio.create_task(_send_messages(websocket, watcher))
    try:
        while True:
            text = await websocket.receive_text()
            if len(text) > _MAX_COMMAND:
                await websocket.close(1009, "the command is too long")
                return
            await stream.execute(json.loads(text))
    except (WebSocketDisconnect, RuntimeError):  # the browser has disconnected, during a message or between two
        return
    except (ValueError, KeyError):
        await websocket.close(1008, "that is no command of a view")
    finally:
        sending.cancel()
        await asyncio.gather(sending, return_exceptions=True)


async def _send_messages(websocket: WebSocket, watcher: Watcher) -> None:
    async for message in watcher:
        await websocket.send_bytes(message)
