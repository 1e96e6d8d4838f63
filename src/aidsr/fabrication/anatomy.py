"""A robot as one who builds it sees it: rigid parts, the elastic joints between them, and cables through guides.

Everything stands in one frame, the robot at rest, in millimetres: parts are drawn where they will sit.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Artifact, Vec3
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits

Vector = NDArray[np.float64]

_LIMITS = Limits(wall_s=120, cpu_s=60)


class Shape(Artifact):
    """One solid of a part."""

    name: str
    kind: Literal["sphere", "capsule", "cylinder", "box", "ellipsoid", "hull"]
    size_mm: Vec3
    """MuJoCo's size numbers of this kind."""
    position_mm: Vec3
    rotation: tuple[float, ...]
    """From its own axes to the robot's, row by row, nine numbers."""
    points_mm: tuple[Vec3, ...] = ()
    """Corners of a hull."""


class Part(Artifact):
    """Bodies that never move against each other: one piece to print."""

    name: str
    bodies: tuple[str, ...]
    body_ids: tuple[int, ...]
    shapes: tuple[Shape, ...]
    position_mm: Vec3
    """Origin of its first body."""
    rotation: tuple[float, ...]
    mass_kg: float
    held: bool = False
    """Whether the world holds it, so that its mass moves nothing."""


class Joint(Artifact):
    """What bends between two parts: one joint of the simulation, or several about the same point."""

    names: tuple[str, ...]
    parent: int
    """Part it hangs on; -1 for the world."""
    child: int
    bodies: tuple[int, int]
    """The body it hangs on and its own: parts can hold several."""
    kind: Literal["hinge", "ball", "other"]
    anchor_mm: Vec3
    axes: tuple[Vec3, ...]
    """Unit axes of rotation at rest; a ball joint has three."""
    stiffness_n_m_rad: tuple[float, ...]
    limits_rad: tuple[tuple[float, float], ...]
    """Least and largest angle about each axis from the drawn pose, infinite where there is no limit."""
    offset_mm: float
    """How far the joints' own anchors lie apart."""


class Guide(Artifact):
    """A site that a cable passes."""

    site: str
    part: int
    body: int
    position_mm: Vec3


class Cable(Artifact):
    """A tendon and the actuator that reels it in."""

    tendon: str
    actuator: str
    """Empty for a tendon that nothing drives."""
    guides: tuple[Guide, ...]
    wraps: bool
    """Whether it runs around a geom or a pulley, or is no cable through sites at all."""
    length_mm: float
    largest_pull_n: float
    """By the actuator's force limits and gear; infinite where it has none, 0 where it only pushes."""
    torques_mm: dict[str, float]
    """Torque about each joint of the simulation for a pull of 1 N [N mm]."""


class Anatomy(Artifact):
    """A robot as parts, joints and cables."""

    parts: tuple[Part, ...]
    joints: tuple[Joint, ...]
    cables: tuple[Cable, ...]
    other_actuators: tuple[str, ...] = ()
    """Actuators that pull on no tendon."""
    open_loops: tuple[str, ...] = ()
    """Equality constraints that no rigid part can stand for."""
    shared_cables: tuple[str, ...] = ()
    """Tendons that more than one actuator pulls on."""
    couplings: tuple[str, ...] = ()
    """Equality constraints that make joints or tendons move as one."""
    weightless: tuple[str, ...] = ()
    """Moving bodies that are relieved of their weight."""

    @property
    def moving_mass_kg(self) -> float:
        """Mass of all parts the world does not hold [kg]."""
        return sum(part.mass_kg for part in self.parts if not part.held)


@isolated(limits=_LIMITS)
def read_anatomy(mjcf: str) -> Anatomy:
    """Return the anatomy of a robot.

    Args:
        mjcf: The robot alone; compiled in a worker.

    Raises:
        MjcfError: The text cannot be loaded.
        IsolationError: Loading ran past a limit.
    """
    from aidsr.fabrication.anatomy_reader import read

    return read(mjcf)
