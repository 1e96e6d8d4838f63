"""Physical structure of a robot: rigid parts, the elastic joints between them, and cables through guides.

All positions are in millimetres in one frame, that of the robot in its initial pose.
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
    """One solid of a part, taken from a geom."""

    name: str
    kind: Literal["sphere", "capsule", "cylinder", "box", "ellipsoid", "hull"]
    size_mm: Vec3
    """MuJoCo's size parameters for this kind of geom."""
    position_mm: Vec3
    rotation: tuple[float, ...]
    """Rotation matrix from its own axes to the robot's, nine numbers row by row."""
    points_mm: tuple[Vec3, ...] = ()
    """Corners of a hull."""


class Part(Artifact):
    """Bodies that never move relative to each other and are printed as one part."""

    name: str
    bodies: tuple[str, ...]
    body_ids: tuple[int, ...]
    shapes: tuple[Shape, ...]
    position_mm: Vec3
    """Origin of its first body."""
    rotation: tuple[float, ...]
    mass_kg: float
    held: bool = False
    """Whether it is fixed to the world, so that its mass has no influence on the motion."""


class Joint(Artifact):
    """The connection of two parts: one joint of the simulation, or several about the same point."""

    names: tuple[str, ...]
    """Names of the joints of the simulation."""
    parent: int
    """Index of the parent part; -1 for the world."""
    child: int
    """Index of the child part."""
    bodies: tuple[int, int]
    """Numbers of the parent body and of the child body, since a part can have several bodies."""
    kind: Literal["hinge", "ball", "other"]
    anchor_mm: Vec3
    axes: tuple[Vec3, ...]
    """Unit axes of rotation at rest; a ball joint has three."""
    stiffness_n_m_rad: tuple[float, ...]
    spring_rest_rad: tuple[float, ...]
    """Angle about each axis at which the spring is at rest, relative to the initial pose."""
    limits_rad: tuple[tuple[float, float], ...]
    """Smallest and largest angle about each axis relative to the initial pose; infinite where there is no limit."""
    offset_mm: float
    """Largest distance of an anchor of the simulation's joints from the first one."""


class Guide(Artifact):
    """A site through which a cable runs."""

    site: str
    part: int
    """Index of its part; -1 for a site of the world."""
    body: int
    """Number of its body."""
    position_mm: Vec3


class Cable(Artifact):
    """A tendon and the actuator that pulls it."""

    tendon: str
    actuator: str
    """Empty for a tendon that nothing drives."""
    guides: tuple[Guide, ...]
    wraps: bool
    """Whether it runs around a geom or a pulley, or has fewer than two sites; only other cables run in ducts."""
    length_mm: float
    """Length in the initial pose."""
    largest_pull_n: float
    """Largest tension from the actuator's force limits and gear; infinite without force limits or without an
    actuator, 0 where the actuator only pushes."""
    torques_mm: dict[str, float]
    """Torque about each joint of the simulation for a tension of 1 N [N mm]."""
    resists: bool = False
    """Whether the tendon itself has a spring, a damper or limits."""


class Anatomy(Artifact):
    """A robot as parts, joints and cables."""

    parts: tuple[Part, ...]
    joints: tuple[Joint, ...]
    cables: tuple[Cable, ...]
    other_actuators: tuple[str, ...] = ()
    """Actuators that pull on no tendon."""
    open_loops: tuple[str, ...] = ()
    """Active connect constraints, and active welds other than of two of the robot's bodies."""
    displaced_welds: tuple[str, ...] = ()
    """Active welds of two of the robot's bodies in another relative pose than their initial one."""
    shared_cables: tuple[str, ...] = ()
    """Tendons that more than one actuator pulls on."""
    couplings: tuple[str, ...] = ()
    """Equality constraints that couple joints or tendons."""
    weightless: tuple[str, ...] = ()
    """Moving bodies with gravity compensation."""

    @property
    def moving_mass_kg(self) -> float:
        """Mass of all parts that are not fixed to the world [kg]."""
        return sum(part.mass_kg for part in self.parts if not part.held)


@isolated(limits=_LIMITS)
def read_anatomy(mjcf: str) -> Anatomy:
    """Return the anatomy of a robot.

    Args:
        mjcf: MJCF of the robot alone; compiled in an isolated process.

    Raises:
        MjcfError: The MJCF cannot be loaded, or a part has no solid shape.
        IsolationError: Loading exceeded a limit.
    """
    from aidsr.fabrication.anatomy_reader import read

    return read(mjcf)
