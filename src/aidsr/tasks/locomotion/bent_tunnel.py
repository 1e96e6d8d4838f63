"""The tunnel of `tunnel`: two straight halves that meet at an angle, behind a wall that nothing gets around."""

from __future__ import annotations

import numpy as np

from aidsr.tasks.locomotion.lane import box_between
from aidsr.tasks.readings import FloatArray
from aidsr.tasks.variation import Change

__all__ = ["ENTRANCE_M", "LENGTH_M", "along_tunnel_m", "tunnel_changes"]

ENTRANCE_M = 0.35
"""Where the tunnel begins: a robot of the usual size starts clear of it."""
LENGTH_M = 0.60
_HALF_M = LENGTH_M / 2
_INNER_M = 0.06
"""Half of the inner width."""
_WALL_M = 0.008
_PORTAL_M = (0.6, 0.3)
"""Half width and height of the wall around the entrance."""


def tunnel_changes(bend_rad: float, height_m: float) -> tuple[Change, ...]:
    """Return the changes that give the tunnel a bend, positive to the left, and a height."""
    # a wall on the outside of the bend has to be longer for the halves to meet
    longer_m = (_INNER_M + _WALL_M / 2) * np.tan(bend_rad / 2)
    outer_m, top_m, (wide_m, high_m) = _INNER_M + _WALL_M, height_m + _WALL_M, _PORTAL_M
    turn = (np.cos(bend_rad / 2), 0.0, 0.0, np.sin(bend_rad / 2))
    changes = [
        *box_between("portal_left", (-_WALL_M, _INNER_M, 0.0), (0.0, wide_m, high_m)),
        *box_between("portal_right", (-_WALL_M, -wide_m, 0.0), (0.0, -_INNER_M, high_m)),
        *box_between("portal_top", (-_WALL_M, -_INNER_M, height_m), (0.0, _INNER_M, high_m)),
        *box_between("left_1", (0.0, _INNER_M, 0.0), (_HALF_M - longer_m, outer_m, height_m)),
        *box_between("right_1", (0.0, -outer_m, 0.0), (_HALF_M + longer_m, -_INNER_M, height_m)),
        *box_between("roof_1", (0.0, -outer_m, height_m), (_HALF_M + abs(longer_m), outer_m, top_m)),
    ]
    second = [
        *box_between("left_2", (longer_m, _INNER_M, 0.0), (_HALF_M, outer_m, height_m)),
        *box_between("right_2", (-longer_m, -outer_m, 0.0), (_HALF_M, -_INNER_M, height_m)),
        *box_between("roof_2", (-abs(longer_m), -outer_m, height_m), (_HALF_M, outer_m, top_m)),
    ]
    for change in second:
        if change.field == "geom_pos":
            x, y, z = change.value
            place = (
                _HALF_M + x * np.cos(bend_rad) - y * np.sin(bend_rad),
                x * np.sin(bend_rad) + y * np.cos(bend_rad),
                z,
            )
            changes += [Change("geom_pos", change.name, place), Change("geom_quat", change.name, turn)]
        else:
            changes.append(change)
    return tuple(changes)


def along_tunnel_m(point_m: FloatArray, bend_rad: FloatArray) -> FloatArray:
    """Return how far points are along the tunnel's middle line, (n, p) [m].

    Before the entrance it is the distance to its middle, negative: a body that turns sideways in front of it comes no
    nearer.

    Args:
        point_m: Level points seen from the entrance, along and to the left, (n, p, 2) [m].
        bend_rad: The bends, (n, 1) [rad].
    """
    x, y = point_m[:, :, 0] - _HALF_M, point_m[:, :, 1]
    beyond = x * np.cos(bend_rad) + y * np.sin(bend_rad)
    # the halves meet in the plane that cuts their angle in two
    second = x * np.cos(bend_rad / 2) + y * np.sin(bend_rad / 2) > 0.0
    along = np.where(second, _HALF_M + beyond, point_m[:, :, 0])
    return np.where(along < 0.0, -np.linalg.norm(point_m, axis=2), along)
