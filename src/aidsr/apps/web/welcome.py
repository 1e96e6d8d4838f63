"""The content of an empty home page: a moving robot, and three examples to try with one click."""

from __future__ import annotations

from functools import partial

from nicegui import ui

from aidsr.apps.web.addresses import run_address
from aidsr.apps.web.frame import ASSETS
from aidsr.apps.web.launch import DEMO, RunRequest, launch
from aidsr.apps.web.live import working
from aidsr.apps.web.site import Site
from aidsr.apps.web.view3d import Episode, Model, SceneView
from aidsr.apps.web.widgets import box, button, text
from aidsr.core.config import RunConfig
from aidsr.runs import Run

_EPISODE = ASSETS / "welcome.npz"
"""Recording of a held-out episode, made with `aidsr design --task button_pushing --seed 1`, `aidsr train` of its first
design with 60,000 steps, and `aidsr.learn.rl.recording.record_episode`."""
_TUNNEL = RunRequest(RunConfig(seed=1), task="locomotion/tunnel")


def welcome(site: Site) -> None:
    """Explain the app, and offer first steps."""

    def opened(run: Run) -> None:
        ui.navigate.to(run_address(run.name))

    def offer(title: str, request: RunRequest) -> None:
        pressed = button(title, lambda: working(pressed, partial(launch, site, request), opened), "quiet", "play_arrow")

    with box("sheet welcome"):
        with box("stack"):
            text("No runs yet", tag="h2")
            text(
                "Describe a task and its environment. A team of four roles designs tendon-driven continuum robots for "
                "it. Each robot is simulated, its physical faults are measured and repaired, and you decide which "
                "designs to train. All files of a run are kept in one folder.",
                "soft",
                "p",
            )
            text(
                "Try one of these examples. The built-in rules need no API key and cost nothing. The first two take "
                "seconds, the bell about half a minute. A goal of your own may take a few minutes, because each robot "
                "is tried on it.",
                "",
                "p",
            )
            with box("stack tight"):
                offer("Three robots that push a button", DEMO)
                offer("Three robots that pass a tunnel", _TUNNEL)
                bell = partial(ui.navigate.to, "/new?template=bell")
                button("Ring a bell (custom task)", bell, "quiet", "edit")
            with box("row"):
                button("Set up a run", lambda: ui.navigate.to("/new"), "primary", "add")
        with box("stack tight", "figure"):
            episode = Episode.read(_EPISODE, "a tentacle pushes a button")
            with box("view"):
                model = Model(episode.mjcf, episodes=(episode,))
                SceneView(model, title="a tentacle that pushes a button", controls=False)
            said = "A tentacle designed by the built-in rules pushes a button with a learned policy (0.1× real time)."
            text(said, "small soft", "figcaption")
