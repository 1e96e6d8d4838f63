"""The view as a part of a page."""

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
from aidsr.apps.web.view3d.target import Wanted
from aidsr.core.artifacts import ActuatorGroup, Fault
from aidsr.validation.validator import Mount

_STATIC = Path(__file__).parents[1] / "static" / "view3d"


@dataclass(frozen=True)
class Pick:
    """What a person clicked in a view."""

    kind: Literal["body", "tendon", ""]
    """Empty where nothing was hit, which clears the selection."""
    name: str
    """As the MJCF has it."""


class SceneView(Element, component=_STATIC / "scene_view.js", esm={"aidsr-view3d": str(_STATIC)}):
    """A robot or scene in 3-D, with sliders that pull its tendons.

    It fills its parent, which must have a height. Each view has a simulation of its own, which runs only while it is
    watched; it ends with the page it is on.

    Args:
        mjcf: Robot or scene, as text or as the path of its file.
        title: What it is, for those who cannot see it and for the names of pictures.
        picture: Address of a still picture, for browsers without WebGL.
        faults: What is wrong with it: the bodies and tendons named there are lit.
        groups: Actuators that act together, as the robot's author defines them; each group gets a slider.
        episodes: Recorded motions to choose from.
        mount: How a robot alone stands; see `aidsr.validation.validate`.
        environment: MJCF whose physics hold for a robot alone, empty for its own.
        controls: Whether there are sliders and transport; without, it is only looked at.
        together: Whether its camera turns with those of the other views of the page.
        before: MJCF of an earlier state of it, which can be shown as a ghost; empty for none.
        target: TOML of the goal, or marks of the task, whose target is shown as a ghost; empty for none.
        on_pick: Called with what a person clicks.
    """

    def __init__(
        self,
        mjcf: str | Path,
        *,
        title: str = "robot",
        picture: str = "",
        faults: Sequence[Fault] = (),
        groups: Sequence[ActuatorGroup] = (),
        episodes: Sequence[Episode] = (),
        mount: Mount = "auto",
        environment: str = "",
        controls: bool = True,
        together: bool = False,
        before: str = "",
        target: Wanted = "",
        on_pick: Callable[[Pick], None] | None = None,
    ) -> None:
        super().__init__()
        model = Model(
            mjcf,
            mount=mount,
            environment=environment,
            groups=tuple(groups),
            episodes=tuple(episodes),
            before=before,
            target=target,
        )
        self.stream = SceneStream(model)
        _views().add(self.stream)
        self._props["path"] = f"{ADDRESS}/{self.stream.id}"
        self._props["title"] = title
        self._props["picture"] = picture
        self._props["episodes"] = [episode.name for episode in episodes]
        self._props["controls"] = controls
        self._props["together"] = together
        self._picked = on_pick
        self.on("pick", self._pick)
        self.light(faults)

    @property
    def episodes(self) -> tuple[str, ...]:
        """Names of the motions that can be played."""
        return tuple(self._props["episodes"])

    def light(self, faults: Sequence[Fault]) -> None:
        """Let the bodies and tendons that faults name glow, in place of those that did."""
        self._props["lit"] = [{"names": list(fault.names), "severity": fault.severity} for fault in faults]

    def replay(self, name: str) -> None:
        """Play an episode in each watching browser, as if chosen there."""
        self.run_method("replay", self.episodes.index(name))

    def play(self, episode: Episode, *, scroll: bool = True) -> None:
        """Add an episode, and play it in each watching browser, which scrolls to it unless told not to."""
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
    """Return the views of this server, served from the first time on."""
    views = getattr(app.state, "aidsr_views", None)
    if not isinstance(views, Views):
        views = app.state.aidsr_views = Views()
        serve_views(app, views)
    return views
