"""The 3-D view of a design, in which its tendons can be pulled; a picture while there is no MJCF."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence

from aidsr.apps.web.view3d import Model, Pick, SceneView
from aidsr.apps.web.view3d.target import TargetSpec
from aidsr.apps.web.widgets import box, image
from aidsr.core.artifacts import Fault
from aidsr.core.errors import UserError
from aidsr.runs import Run
from aidsr.tasks import load_task


def show_scene(
    model: Model,
    title: str,
    picture: str,
    *,
    faults: Sequence[Fault] = (),
    on_pick: Callable[[str], None] = lambda _name: None,
    together: bool = False,
) -> SceneView | None:
    """Show a robot or a scene, and return the view; None where there is no MJCF yet.

    Args:
        model: The robot or scene; its MJCF is empty while there is none.
        title: Title of the view.
        picture: Address of a picture, shown while there is no MJCF and by browsers without WebGL; empty where there is
            none.
        faults: Faults whose bodies and tendons are highlighted.
        on_pick: Called with the name of the clicked body or tendon; empty when the selection is cleared.
        together: Whether its camera rotates together with the cameras of the other views on the page.
    """
    if not model.mjcf:
        with box("sheet flush"):
            image(picture, title)
        return None

    def picked(pick: Pick) -> None:
        on_pick(pick.name)

    with box("sheet flush view"):
        return SceneView(model, title=title, picture=picture, faults=faults, on_pick=picked, together=together)


def target_of(run: Run) -> TargetSpec:
    """Return the goal of a run as TOML, or the marks of its benchmark task; empty where there is none.

    It is also empty for a task that is not installed on this machine.
    """
    if goal := run.goal.read():
        return goal.decode()
    asked = run.asked()
    with contextlib.suppress(UserError):
        return load_task(asked.task, asked.level or "standard").target if asked.task else ""
    return ""
