"""`aidsr view`."""

from __future__ import annotations

from pathlib import Path

__all__ = ["model_of", "view"]


def view(path: Path, /) -> int:
    """Look at a design, a scene or a robot in MuJoCo's viewer; without a display, draw a picture beside it.

        aidsr view runs/2026-01-31_1002_button_pushing_7f3a/designs/1

        aidsr view robot.xml

    Parameters
    ----------
    path
        MJCF file, or the folder of a design or of one iteration.
    """
    raise NotImplementedError
