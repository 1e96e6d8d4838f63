"""A design in 3-D: simulated live or played back on the server, drawn by three.js in the browser.

    player      the process that compiles and steps a model, started by the server
    display_model, parts, tendons, controls, names, target    what it sends about a model
    playback, motions, frames                         what it sends about each moment
    stream      a player as the server has it, only while a browser watches
    endpoint    the WebSocket between server and browsers
    element     the view as a part of a page
    parts_view  a view of parts to print, which stand still

The browser's side is in `aidsr/apps/web/static/view3d`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from aidsr.apps.web.view3d.element import Pick, SceneView
    from aidsr.apps.web.view3d.parts_view import PartsView, PlacedPart
    from aidsr.apps.web.view3d.stream import Episode, Model, SceneStream

__all__ = ["Episode", "Model", "PartsView", "Pick", "PlacedPart", "SceneStream", "SceneView"]

_HOMES = {
    "Pick": "element",
    "SceneView": "element",
    "PlacedPart": "parts_view",
    "PartsView": "parts_view",
    "Episode": "stream",
    "Model": "stream",
    "SceneStream": "stream",
}


def __getattr__(name: str) -> Any:
    # the player's process, which imports this package, must not load NiceGUI
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it offers {', '.join(__all__)}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
