"""Target positions of a task for pictures: a shape, a point, or the shapes that a joint has to move."""

from __future__ import annotations

from typing import Literal

from aidsr.core.artifacts import Artifact

Element = Literal["geom", "site", "joint"]


class Mark(Artifact):
    """An element of the environment that shows the target, in any variation. It has no effect on the score."""

    element: Element
    """"geom": this shape; "site": this point; "joint": the shapes that it moves, displaced by `by`."""
    name: str
    at_m: tuple[float, float, float] | None = None
    """Point in the frame of a geom or a site [m], instead of the geom's shape; by default (0, 0, 0) of a site."""
    radius_m: float = 0.0
    """Radius of the ball drawn around that point [m]; 0 draws the smallest visible ball."""
    by: float = 0.0
    """Displacement of the joint: a slide along its axis [m], a hinge [rad], a free joint upwards [m]."""
