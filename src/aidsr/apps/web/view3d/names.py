"""The bodies and tendons that belong to each name in a model.

A fault may name a joint, an actuator or a sensor, but a view can highlight only bodies and tendons.
"""

from __future__ import annotations

from collections.abc import Iterator

import mujoco

from aidsr.sim.structure import name_of

_BODY, _TENDON, _JOINT = mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_TENDON, mujoco.mjtObj.mjOBJ_JOINT
_GEOM, _SITE = mujoco.mjtObj.mjOBJ_GEOM, mujoco.mjtObj.mjOBJ_SITE
_ACTUATOR, _SENSOR = mujoco.mjtObj.mjOBJ_ACTUATOR, mujoco.mjtObj.mjOBJ_SENSOR
_BY = {
    int(mujoco.mjtTrn.mjTRN_TENDON): _TENDON,
    int(mujoco.mjtTrn.mjTRN_JOINT): _JOINT,
    int(mujoco.mjtTrn.mjTRN_JOINTINPARENT): _JOINT,
    int(mujoco.mjtTrn.mjTRN_BODY): _BODY,
    int(mujoco.mjtTrn.mjTRN_SITE): _SITE,
    int(mujoco.mjtTrn.mjTRN_SLIDERCRANK): _SITE,
}

_Place = tuple[str, str]
"""("body" or "tendon", its name)."""


def locate_elements(model: mujoco.MjModel) -> dict[str, list[_Place]]:
    """Return the bodies and tendons that belong to each name; if two elements share a name, those of both."""
    found: dict[str, list[_Place]] = {}
    for name, place in _every(model):
        places = found.setdefault(name, [])
        if place not in places:
            places.append(place)
    return found


def _every(model: mujoco.MjModel) -> Iterator[tuple[str, _Place]]:
    counts = {
        _BODY: model.nbody,
        _TENDON: model.ntendon,
        _JOINT: model.njnt,
        _GEOM: model.ngeom,
        _SITE: model.nsite,
        _ACTUATOR: model.nactuator,
        _SENSOR: model.nsensor,
    }
    for kind, count in counts.items():
        for index in range(count):
            place = _place(model, kind, index)
            if place is not None:
                yield name_of(model, kind, index), place


def _place(model: mujoco.MjModel, kind: mujoco.mjtObj, index: int) -> _Place | None:
    if kind == _ACTUATOR:
        target = _BY.get(int(model.actuator_trntype[index]))
        return None if target is None else _place(model, target, int(model.actuator_trnid[index, 0]))
    if kind == _SENSOR:
        target = mujoco.mjtObj(int(model.sensor_objtype[index]))
        known = (_BODY, _TENDON, _JOINT, _GEOM, _SITE, _ACTUATOR, mujoco.mjtObj.mjOBJ_XBODY)
        return _place(model, target, int(model.sensor_objid[index])) if target in known else None
    if kind == _TENDON:
        return "tendon", name_of(model, _TENDON, index)
    owner = {_JOINT: model.jnt_bodyid, _GEOM: model.geom_bodyid, _SITE: model.site_bodyid}.get(kind)
    body = index if owner is None else int(owner[index])
    return ("body", name_of(model, _BODY, body)) if body else None
