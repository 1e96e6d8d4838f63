"""The one place where a design is seen: in three dimensions, its tendons to be pulled; before that, nothing yet."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence

from aidsr.apps.web.view3d import Episode, Pick, SceneView
from aidsr.apps.web.view3d.target import Wanted
from aidsr.apps.web.widgets import box, image
from aidsr.core.artifacts import ActuatorGroup, Fault
from aidsr.core.errors import UserError
from aidsr.runs import Run
from aidsr.tasks import load_task


def show_scene(
    mjcf: str,
    title: str,
    picture: str,
    *,
    faults: Sequence[Fault] = (),
    groups: Sequence[ActuatorGroup] = (),
    environment: str = "",
    episodes: Sequence[Episode] = (),
    on_pick: Callable[[str], None] = lambda _name: None,
    together: bool = False,
    before: str = "",
    target: Wanted = "",
) -> SceneView | None:
    """Show a robot or a scene, and return the view, None where there is nothing to see yet.

    Args:
        mjcf: Its text; empty while there is none.
        title: What it is.
        picture: Address of a picture of it, for browsers without WebGL too; empty where there is none.
        faults: What to light up.
        groups: Actuators that act together.
        environment: For a robot alone, the MJCF whose physics hold for it.
        episodes: Recorded motions to choose from.
        on_pick: Called with the name of the body or tendon clicked; empty when the selection is cleared.
        together: Whether its camera turns with those of the other views of the page.
        before: MJCF of an earlier state of it, which can be shown as a ghost; empty for none.
        target: TOML of the goal, or marks of the task, whose target is shown as a ghost; empty for none.
    """
    if not mjcf:
        with box("sheet flush"):
            image(picture, title)
        return None

    def picked(pick: Pick) -> None:
        on_pick(pick.name)

    with box("sheet flush view"):
        return SceneView(
            mjcf,
            title=title,
            picture=picture,
            faults=faults,
            groups=groups,
            environment=environment,
            episodes=episodes,
            on_pick=picked,
            together=together,
            before=before,
            target=target,
        )


def target_of(run: Run) -> Wanted:
    """Return what a run's goal or its task of the benchmark wants; empty for a task that is not installed here."""
    if goal := run.goal.read():
        return goal.decode()
    asked = run.asked()
    with contextlib.suppress(UserError):
        return load_task(asked.task, asked.level or "standard").target if asked.task else ""
    return ""
