"""The one place where a design is seen: its newest picture until a view in three dimensions takes its room."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from aidsr.artifacts import Fault
from aidsr.web.parts import box, image

__all__ = ["show_scene"]


def show_scene(
    mjcf: str, picture: str, *, faults: Sequence[Fault] = (), on_pick: Callable[[str], None] | None = None
) -> None:
    """Show a robot or a scene.

    Args:
        mjcf: Its text; empty while there is none.
        picture: Address of a picture of it, empty where there is none.
        faults: What to light up.
        on_pick: Told the name of a body or tendon that a person clicked.
    """
    del mjcf, faults, on_pick
    with box("sheet flush"):
        image(picture, "the design")
