"""The pipe of `pipe_inserting`: straight from its mouth, then bent, built of flat walls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from aidsr.tasks.readings import FloatArray
from aidsr.tasks.variation import Change

__all__ = ["BEND_RADIUS_M", "INNER_M", "LENGTH_M", "Wall", "along_pipe_m", "pipe_changes", "pipe_walls"]

LENGTH_M = 0.30
"""Length of the centre line from the mouth."""
BEND_RADIUS_M = 0.13
INNER_M = 0.035
"""Inner radius, to the middles of the walls' inner faces."""
_THICKNESS_M = 0.008
"""Our choice: a tip that is pressed hard sinks up to 3 mm into a wall, as soft contacts let it, and would come out of
a thinner one on the wrong side."""
_SIDES = 8
_BENT_RINGS = 5


@dataclass(frozen=True)
class Wall:
    """One flat wall, a box in the frame of the pipe: origin in the mouth, +z out of it, bending towards +x."""

    half_size_m: tuple[float, float, float]
    position_m: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]


def pipe_walls(bend_rad: float) -> tuple[Wall, ...]:
    """Return the walls of a pipe that ends turned by an angle, ring after ring from the mouth."""
    straight_m = LENGTH_M - BEND_RADIUS_M * bend_rad
    walls = [_wall(side, 0.0, straight_m / 2, straight_m / 2) for side in range(_SIDES)]
    half_turn = bend_rad / _BENT_RINGS / 2
    for ring in range(_BENT_RINGS):
        for side in range(_SIDES):
            angle = (2 * ring + 1) * half_turn
            # walls on the outside of the bend are longer: they meet at the same angles
            across_m = BEND_RADIUS_M - INNER_M * np.cos(_facing(side))
            walls.append(_wall(side, angle, straight_m, across_m * np.tan(half_turn)))
    return tuple(walls)


def pipe_changes(bend_rad: float) -> tuple[Change, ...]:
    """Return the changes that give the pipe of an environment another bend."""
    return tuple(
        change
        for number, wall in enumerate(pipe_walls(bend_rad), start=1)
        for change in (
            Change("geom_size", f"pipe_{number}", wall.half_size_m),
            Change("geom_pos", f"pipe_{number}", wall.position_m),
            Change("geom_quat", f"pipe_{number}", wall.quaternion),
        )
    )


def along_pipe_m(point_m: FloatArray, bend_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how deep points are in the pipe along its centre line, and how far beside that line.

    Args:
        point_m: Points in the frame of the pipe, (n, 3) [m].
        bend_rad: Angle by which each pipe turns, (n,) [rad].

    Returns:
        Depth, negative before the mouth and at most the pipe's length, and distance, (n,) each [m].
    """
    straight_m = LENGTH_M - BEND_RADIUS_M * bend_rad
    below_m = -point_m[:, 2] - straight_m
    inwards_m = BEND_RADIUS_M - point_m[:, 0]
    angle = np.clip(np.arctan2(below_m, inwards_m), 0.0, bend_rad)
    bent = below_m > 0.0
    depth_m = np.where(bent, straight_m + BEND_RADIUS_M * angle, -point_m[:, 2])
    sideways_m = np.where(bent, BEND_RADIUS_M - np.hypot(below_m, inwards_m), point_m[:, 0])
    return depth_m, np.hypot(sideways_m, point_m[:, 1])


def _facing(side: int) -> float:
    """Return the angle of a wall around the centre line, 0 on the inside of the bend."""
    return 2 * np.pi * (side + 0.5) / _SIDES


def _wall(side: int, angle: float, straight_m: float, half_length_m: float) -> Wall:
    """Return one wall of the ring whose middle lies at an angle of the bend, behind a straight part."""
    facing, out_m = _facing(side), INNER_M + _THICKNESS_M / 2
    inward = np.array([np.cos(angle), 0.0, np.sin(angle)])
    center = np.array([BEND_RADIUS_M, 0.0, -straight_m]) - BEND_RADIUS_M * inward
    center += out_m * (np.cos(facing) * inward + np.sin(facing) * np.array([0.0, 1.0, 0.0]))
    c, s, cf, sf = np.cos(angle / 2), np.sin(angle / 2), np.cos(facing / 2), np.sin(facing / 2)
    half_width_m = (INNER_M + _THICKNESS_M) * np.tan(np.pi / _SIDES)
    return Wall(
        half_size_m=(_THICKNESS_M / 2, half_width_m, half_length_m),
        position_m=(float(center[0]), float(center[1]), float(center[2])),
        # turned about y by -angle, then about its own z by the facing
        quaternion=(float(c * cf), float(-s * sf), float(-s * cf), float(c * sf)),
    )
