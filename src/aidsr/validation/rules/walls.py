"""Is every part thick enough to be printed or cast."""

from __future__ import annotations

from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.solids import half_width_m, volume_m3


def thin_wall(robot: RobotUnderTest) -> Iterator[Fault]:
    """No solid part is thinner than a wall that can be printed.

    Parts that can touch nothing are decoration where their body has others that can.
    """
    thin: dict[str, float] = {}
    for geom in _parts(robot):
        thickness_m = 2 * half_width_m(robot.model, geom)
        if thickness_m < robot.limits.wall_m:
            thin[robot.geom(geom)] = thickness_m
    if thin:
        yield Fault(
            code="thin_wall",
            layer="realizability",
            severity="warning",
            names=tuple(thin),
            measured=1000 * min(thin.values()),
            limit=1000 * robot.limits.wall_m,
            unit="mm",
            message="thinner than a printed or cast wall can be",
            cure="Make the part thicker, or leave it out.",
        )


def _parts(robot: RobotUnderTest) -> list[int]:
    """Geoms that are solid primitives and no decoration."""
    model = robot.model
    touching = {geom for geom in robot.structure.geoms if model.geom_contype[geom] or model.geom_conaffinity[geom]}
    bodies = {int(model.geom_bodyid[geom]) for geom in touching}
    solid = [geom for geom in robot.structure.geoms if volume_m3(model, geom) is not None]
    return [geom for geom in solid if geom in touching or int(model.geom_bodyid[geom]) not in bodies]
