"""The 3-D view as an element of a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from nicegui import app
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from aidsr.apps.web.view3d.endpoint import ADDRESS, Views, serve_views
from aidsr.apps.web.view3d.stream import Episode, Model, SceneStream
from aidsr.core.artifacts import Fault

_STATIC = Path(__file__).parents[1] / "static" / "view3d"


@dataclass(frozen=True)
class Pick:
    """What a person clicked in a view."""

    kind: Literal["body", "tendon", ""]
    """Empty where nothing was hit, which clears the selection."""
    name: str
    """Name in the MJCF."""


class SceneView(Element, component=_STATIC / "scene_view.js", esm={"aidsr-view3d": str(_STATIC)}):
    """A robot or scene in 3-D, with sliders that pull its tendons.

    The view fills its parent, which must have a height. It has its own simulation, which runs only while a browser
    watches and ends when the page is closed.

    Args:
        model: The robot or scene, and what can be played or shown with it; each of its groups gets a slider.
        title: Description for screen readers and for file names of saved pictures.
        picture: Address of a still picture, for browsers without WebGL.
        faults: Faults whose bodies and tendons are highlighted.
        controls: Whether to show sliders and playback controls.
        together: Whether its camera rotates together with the cameras of the other views on the page.
        on_pick: Called with the body or tendon that a person clicks.
    """

    def __init__(
        self,
        model: Model,
        *,
        title: str = "robot",
        picture: str = "",
        faults: Sequence[Fault] = (),
        controls: bool = True,
        together: bool = False,
        on_pick: Callable[[Pick], None] | None = None,
    ) -> None:
        super().__init__()
        self.stream = SceneStream(model)
        _views().add(self.stream)
        self._props["path"] = f"{ADDRESS}/{self.stream.id}"
        self._props["title"] = title
        self._props["picture"] = picture
        self._props["episodes"] = [episode.name for episode in model.episodes]
        self._props["controls"] = controls
        self._props["together"] = together
        self._picked = on_pick
        self.on("pick", self._pick)
        self.light(faults)

    @property
    def episodes(self) -> tuple[str, ...]:
        """Names of the episodes that can be played."""
        return tuple(self._props["episodes"])

    def light(self, faults: Sequence[Fault]) -> None:
        """Highlight the bodies and tendons that the faults name, in place of those highlighted before."""
        self._props["lit"] = [{"names": list(fault.names), "severity": fault.severity} for fault in faults]

    def replay(self, name: str) -> None:
        """Play an episode, given by its name, in each watching browser, as if it were selected there."""
        self.run_method("replay", self.episodes.index(name))

    def play(self, episode: Episode, *, scroll: bool = True) -> None:
        """Add an episode and play it in each watching browser, which scrolls to the view if `scroll` is set."""
        index = self.stream.add(episode)
        names = list(self.episodes)
        names[index : index + 1] = [episode.name]
        self._props["episodes"] = names
        self.update()
        self.run_method("replay", index, scroll)

    def _pick(self, event: GenericEventArguments) -> None:
        kind, name = event.args.get("kind"), event.args.get("name")
        if self._picked is not None and kind in ("body", "tendon", "") and isinstance(name, str):
            self._picked(Pick(kind, name))

    def _handle_delete(self) -> None:
        _views().remove(self.stream)
        super()._handle_delete()


def _views() -> Views:
    """Return the open views of this server; the first call adds their WebSocket."""
    views = getattr(app.state, "aidsr_views", None)
    if not isinstance(views, Views):
        views = app.state.aidsr_views = Views()
        serve_views(app, views)
    return views
