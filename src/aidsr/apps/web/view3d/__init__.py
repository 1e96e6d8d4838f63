"""A design in 3-D: simulated live or played back on the server, drawn by three.js in the browser.

    player      the process that compiles and steps a model, started by the server
    display_model, parts, bodies, tendons, controls, names, target    the data sent once for each model
    playback, motions, frames    the data sent for each frame
    tracks      time series of a motion that is played back
    stream      the server's handle of a player, which runs only while a browser watches
    endpoint    the WebSocket between server and browsers
    element     the view as an element of a page
    parts_view  a view of printed parts, which do not move

The browser's code is in `aidsr/apps/web/static/view3d`.
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
