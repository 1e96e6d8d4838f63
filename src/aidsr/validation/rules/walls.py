"""Rule for parts that are too thin to be printed or cast."""

from __future__ import annotations

from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.sim.extent import half_width_m
from aidsr.validation.robot_under_test import RobotUnderTest
from aidsr.validation.rule import Example, Rule, Stage
from aidsr.validation.solids import volume_m3

WALL_M = 0.0008
"""Smallest thickness: two lines of a 0.4 mm nozzle, the thinnest wall that common filament printers close on both
sides."""


def _find_thin_walls(robot: RobotUnderTest) -> Iterator[Fault]:
    """Find solid parts that are thinner than the thinnest wall that can be printed."""
    thin: dict[str, float] = {}
    for geom in _parts(robot):
        thickness_m = 2 * half_width_m(robot.model, geom)
        if thickness_m < WALL_M:
            thin[robot.geom(geom)] = thickness_m
    if thin:
        yield THIN_WALL.fault(
            names=tuple(thin),
            measured=1000 * min(thin.values()),
            limit=1000 * WALL_M,
            message="thinner than a printed or cast wall can be",
        )


def _parts(robot: RobotUnderTest) -> list[int]:
    """Return the geoms that are solid primitives and not decoration.

    A geom without collision is decoration if its body has other geoms with collision.
    """
    model = robot.model
    touching = {geom for geom in robot.structure.geoms if model.geom_contype[geom] or model.geom_conaffinity[geom]}
    bodies = {int(model.geom_bodyid[geom]) for geom in touching}
    solid = [geom for geom in robot.structure.geoms if volume_m3(model, geom) is not None]
    return [geom for geom in solid if geom in touching or int(model.geom_bodyid[geom]) not in bodies]


THIN_WALL = Rule(
    code="thin_wall",
    stage=Stage.DRAWING,
    finds="A solid part is thinner than a wall that can be printed or cast.",
    why="A common filament printer closes two lines of its nozzle on both sides and nothing thinner.",
    limit=f"smallest thickness of a solid geom: at least {1000 * WALL_M:g} mm, always a warning. A geom that "
    "touches nothing "
    "beside others of its body that do is decoration",
    check=_find_thin_walls,
    severity="warning",
    unit="mm",
    cure="Make the part thicker, or leave it out.",
    example=Example(
        (
            (
                '<geom name="g3"/>',
                '<geom name="g3"/>\n            <geom name="plate" type="box" size="0.008 0.008 0.0002"/>',
            ),
        )
    ),
)
