"""Where a task wants things to be, for pictures of it: what stands there, a place, or what a joint has to move."""

from __future__ import annotations

from typing import Literal

from aidsr.core.artifacts import Artifact

Element = Literal["geom", "site", "joint"]


class Mark(Artifact):
    """An element of the environment that is part of the target, in any variation of it. Nothing is scored by it."""

    element: Element
    """"geom": this shape; "site": this point; "joint": the shapes that it moves, once it has moved by `by`."""
    name: str
    at_m: tuple[float, float, float] | None = None
    """A point in the frame of a geom or a site [m], in place of the geom's shape; of a site (0, 0, 0) unless given."""
    radius_m: float = 0.0
    """Radius of the ball drawn about that point [m]; 0 is as small as can be seen."""
    by: float = 0.0
    """How far the joint has to move: a slide along its axis [m], a hinge [rad], a free joint upwards [m]."""
