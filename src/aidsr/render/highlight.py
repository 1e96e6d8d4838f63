"""Highlighting of parts of a model in red, with the rest of the robot faded, to show the location of a fault."""

from __future__ import annotations

from collections.abc import Collection

import mujoco
import numpy as np

from aidsr.sim.ownership import read_ownership
from aidsr.sim.structure import name_of

_LIT = np.array([0.89, 0.20, 0.11])
_FADED = np.array([0.66, 0.69, 0.70])
_FADING = 0.75
"""Share of grey in the colours of the rest of the robot."""
_LIT_WIDTH = 2.0
_SEEN_THROUGH = 0.3
"""Opacity of faded parts around a highlighted tendon; most tendons run inside. Ray casting has no transparency."""
_TENDON = int(mujoco.mjtTrn.mjTRN_TENDON)
_JOINTS = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_OF_A_BODY = ("joint of ", "geom of ")
"""Prefixes in the names of unnamed joints and geoms, which are named after their body."""


def highlight(model: mujoco.MjModel, names: Collection[str]) -> None:
    """Highlight the parts with the given names; for an actuator, its tendon or joint.

    A body is highlighted by its own geoms, a joint or site by those of its body. If no part has one of the names,
    nothing changes.
    """
    wanted = {name.removeprefix(prefix) for name in names for prefix in ("", *_OF_A_BODY)}
    tendons = _named(model, "TENDON", model.ntendon, wanted)
    joints = _named(model, "JOINT", model.njnt, wanted)
    for actuator in _named(model, "ACTUATOR", model.nactuator, wanted):
        kind, target = int(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
        tendons |= {target} if kind == _TENDON else set()
        joints |= {target} if kind in _JOINTS else set()
    bodies = _named(model, "BODY", model.nbody, wanted) | {int(model.jnt_bodyid[joint]) for joint in joints}
    bodies |= {int(model.site_bodyid[site]) for site in _named(model, "SITE", model.nsite, wanted)}
    geoms = _named(model, "GEOM", model.ngeom, wanted)
    geoms |= {geom for geom in range(model.ngeom) if int(model.geom_bodyid[geom]) in bodies - {0}}
    if geoms or tendons:
        _colour(model, geoms, tendons)


def _named(model: mujoco.MjModel, kind: str, count: int, wanted: set[str]) -> set[int]:
    obj = getattr(mujoco.mjtObj, f"mjOBJ_{kind}")
    return {index for index in range(count) if name_of(model, obj, index) in wanted}


def _colour(model: mujoco.MjModel, geoms: set[int], tendons: set[int]) -> None:
    ours = read_ownership(model)
    for geom in range(model.ngeom):
        if geom in geoms:
            model.geom_matid[geom] = -1
            model.geom_rgba[geom] = (*_LIT, 1.0)
        elif int(model.geom_bodyid[geom]) in ours.bodies:
            model.geom_rgba[geom, :3] += _FADING * (_FADED - model.geom_rgba[geom, :3])
            model.geom_rgba[geom, 3] *= _SEEN_THROUGH if tendons else 1.0
    for tendon in range(model.ntendon):
        model.tendon_matid[tendon] = -1
        if tendon in tendons:
            model.tendon_rgba[tendon] = (*_LIT, 1.0)
            model.tendon_width[tendon] *= _LIT_WIDTH
        else:
            model.tendon_rgba[tendon, :3] += _FADING * (_FADED - model.tendon_rgba[tendon, :3])
