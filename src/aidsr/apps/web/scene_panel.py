"""The one place where a design is seen: in three dimensions, its tendons to be pulled; before that, nothing yet."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from aidsr.apps.web.view3d import Episode, Pick, SceneView
from aidsr.apps.web.widgets import box, image
from aidsr.core.artifacts import ActuatorGroup, Fault


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
    goal: str = "",
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
        goal: TOML of the goal whose target is shown as a ghost; empty for none.
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
            goal=goal,
        )
