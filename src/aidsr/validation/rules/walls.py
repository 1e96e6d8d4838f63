"""Is every part thick enough to be printed or cast."""

from __future__ import annotations

from collections.abc import Iterator

from aidsr.core.artifacts import Fault
from aidsr.validation.case import Case
from aidsr.validation.solids import half_width_m, volume_m3

__all__ = ["thin_wall"]


def thin_wall(case: Case) -> Iterator[Fault]:
    """No solid part is thinner than a wall that can be printed.

    Parts that can touch nothing are decoration where their body has others that can.
    """
    thin: dict[str, float] = {}
    for geom in _parts(case):
        thickness_m = 2 * half_width_m(case.model, geom)
        if thickness_m < case.limits.wall_m:
            thin[case.geom(geom)] = thickness_m
    if thin:
        yield Fault(
            code="thin_wall",
            layer="realizability",
            severity="warning",
            names=tuple(thin),
            measured=1000 * min(thin.values()),
            limit=1000 * case.limits.wall_m,
            unit="mm",
            message="thinner than a printed or cast wall can be",
            cure="Make the part thicker, or leave it out.",
        )


def _parts(case: Case) -> list[int]:
    """Geoms that are solid primitives and no decoration."""
    model = case.model
    touching = {geom for geom in case.structure.geoms if model.geom_contype[geom] or model.geom_conaffinity[geom]}
    bodies = {int(model.geom_bodyid[geom]) for geom in touching}
    solid = [geom for geom in case.structure.geoms if volume_m3(model, geom) is not None]
    return [geom for geom in solid if geom in touching or int(model.geom_bodyid[geom]) not in bodies]
