"""Removal of scenery from a robot's file: floor, lights, sky, and compiler settings for masses.

The MJCF of a robot alone often has a floor, lights and a sky. In a scene these belong to the environment.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import mujoco
import numpy as np

from aidsr.mjcf.compile import warnings_as_notes

_FLOOR_SHAPES = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
_FLOOR_WORDS = ("floor", "ground")
_FLOOR_HALF_SIZE_M = 0.5
"""Half size of a box in two directions from which it is a floor and not a base plate. Our choice: robots of the
benchmark are at most 0.6 m long."""


_OBJ, _TRN, _EQ = mujoco.mjtObj, mujoco.mjtTrn, mujoco.mjtEq
_FINDERS = {
    int(_OBJ.mjOBJ_BODY): "body",
    int(_OBJ.mjOBJ_XBODY): "body",
    int(_OBJ.mjOBJ_JOINT): "joint",
    int(_OBJ.mjOBJ_GEOM): "geom",
    int(_OBJ.mjOBJ_SITE): "site",
    int(_OBJ.mjOBJ_CAMERA): "camera",
    int(_OBJ.mjOBJ_TENDON): "tendon",
    int(_OBJ.mjOBJ_ACTUATOR): "actuator",
    int(_OBJ.mjOBJ_SENSOR): "sensor",
    int(_OBJ.mjOBJ_MATERIAL): "material",
    int(_OBJ.mjOBJ_LIGHT): "light",
}
"""Name of the `MjSpec` method that looks up an element of each kind."""
_TARGETS = {
    _TRN.mjTRN_JOINT: _OBJ.mjOBJ_JOINT,
    _TRN.mjTRN_JOINTINPARENT: _OBJ.mjOBJ_JOINT,
    _TRN.mjTRN_TENDON: _OBJ.mjOBJ_TENDON,
    _TRN.mjTRN_SITE: _OBJ.mjOBJ_SITE,
    _TRN.mjTRN_SLIDERCRANK: _OBJ.mjOBJ_SITE,
    _TRN.mjTRN_BODY: _OBJ.mjOBJ_BODY,
}
_KINDS = {_EQ.mjEQ_JOINT: _OBJ.mjOBJ_JOINT, _EQ.mjEQ_TENDON: _OBJ.mjOBJ_TENDON}
"""Kinds of the elements that equality constraints connect, for those whose `objtype` does not say it."""


def is_free(body: Any) -> bool:
    """Return whether a body has a free joint."""
    return any(joint.type == mujoco.mjtJoint.mjJNT_FREE for joint in body.joints)


def strip_scenery(spec: mujoco.MjSpec) -> list[str]:
    """Delete scenery and everything that refers to it, in place.

    Floors, lights, keyframes, sky and cameras outside the robot are always deleted. Other elements that are fixed to
    the world are the base of a fixed robot and are kept; beside a free robot they are scenery and are deleted.

    Returns:
        One sentence for each kind of deleted element.
    """
    notes: list[str] = []
    world = spec.worldbody
    free = any(is_free(body) for body in world.bodies)
    materials = _used_materials(spec)
    _delete(spec, [body for body in world.bodies if _is_floor_body(body)], "floor", notes)
    _delete(spec, [geom for geom in world.geoms if _is_floor(geom)], "floor", notes)
    _delete(spec, [geom for geom in spec.geoms if geom.type in _FLOOR_SHAPES], "floor", notes)
    if free:
        _delete(spec, list(world.geoms), "shape fixed to the world beside the free robot", notes)
        _delete(spec, list(world.sites), "site fixed to the world beside the free robot", notes)
        still = [body for body in world.bodies if not body.find_all("joint") and not is_free(body)]
        _delete(spec, still, "body fixed to the world beside the free robot", notes)
    _delete(spec, [e for e in spec.equalities if _holds_to_world(e)], "equality with the world", notes)
    _delete(spec, list(spec.lights), "light", notes)
    _delete(spec, list(world.cameras), "camera outside the robot", notes)
    _delete(spec, list(spec.keys), "keyframe", notes)
    notes += delete_dangling_references(spec, scenery_gone=True)
    for material in list(spec.materials):
        if material.name in materials - _used_materials(spec):
            spec.delete(material)
    textures = {name for material in spec.materials for name in material.textures if name}
    for texture in list(spec.textures):
        if texture.type == mujoco.mjtTexture.mjTEXTURE_SKYBOX or texture.name not in textures:
            spec.delete(texture)
    return notes


def delete_dangling_references(spec: mujoco.MjSpec, *, scenery_gone: bool = False) -> list[str]:
    """Delete elements that refer to a deleted element, in place, and return one sentence for each kind.

    Otherwise a reference to a deleted "floor", for example, would refer to the environment's floor in a scene.

    Args:
        spec: The robot.
        scenery_gone: Whether contact exclusions with the world are deleted too, because the geoms of the world that
            they referred to have been deleted.
    """
    notes: list[str] = []
    _delete(spec, [t for t in spec.tendons if any(_is_cut(wrap) for wrap in t.path)], "tendon", notes)
    _delete(
        spec, [a for a in spec.actuators if not _exists(spec, _TARGETS.get(a.trntype), a.target)], "actuator", notes
    )
    pairs = [p for p in spec.pairs if not (spec.geom(p.geomname1) and spec.geom(p.geomname2))]
    _delete(spec, pairs, "contact pair", notes)
    bodies = {body.name for body in spec.bodies} - ({"world"} if scenery_gone else set())
    _delete(spec, [e for e in spec.excludes if not {e.bodyname1, e.bodyname2} <= bodies], "contact exclusion", notes)
    equalities = [
        e
        for e in spec.equalities
        if not all(_exists(spec, _KINDS.get(e.type, e.objtype), n) for n in (e.name1, e.name2))
    ]
    _delete(spec, equalities, "equality", notes)
    sensors = [
        s for s in spec.sensors if not (_exists(spec, s.objtype, s.objname) and _exists(spec, s.reftype, s.refname))
    ]
    _delete(spec, sensors, "sensor", notes)
    tuples = [t for t in spec.tuples if not all(_exists(spec, *o) for o in zip(t.objtype, t.objname, strict=True))]
    _delete(spec, tuples, "tuple", notes)
    return notes


def _holds_to_world(equality: Any) -> bool:
    """Return whether an equality constraint connects a body to the world; in a scene only the mount may do that."""
    bodies = equality.objtype == mujoco.mjtObj.mjOBJ_BODY
    return bodies and bool({equality.name1, equality.name2} & {"", "world"})


def _is_cut(wrap: Any) -> bool:
    return bool(wrap.type != mujoco.mjtWrap.mjWRAP_PULLEY and wrap.target is None)


def _exists(spec: mujoco.MjSpec, kind: Any, name: str) -> bool:
    """Return whether there is an element of this kind and name; true as well for an empty name or an unknown kind."""
    if not name or kind is None or int(kind) not in _FINDERS:
        return True
    return getattr(spec, _FINDERS[int(kind)])(name) is not None


def _delete(spec: mujoco.MjSpec, elements: Iterable[Any], what: str, notes: list[str]) -> None:
    names = []
    for element in elements:
        names.append(f'"{element.name}"' if element.name else "without a name")
        spec.delete(element)
    if names:
        notes.append(f"Removed from the robot: {what} {', '.join(names)}.")


def _is_floor(geom: Any) -> bool:
    if geom.type in _FLOOR_SHAPES or any(word in geom.name.lower() for word in _FLOOR_WORDS):
        return True
    return bool(geom.type == mujoco.mjtGeom.mjGEOM_BOX and np.sort(geom.size)[1] >= _FLOOR_HALF_SIZE_M)


def _is_floor_body(body: Any) -> bool:
    geoms = body.find_all("geom")
    return bool(geoms) and not body.find_all("joint") and all(_is_floor(geom) for geom in geoms)


def _used_materials(spec: mujoco.MjSpec) -> set[str]:
    return {element.material for element in (*spec.geoms, *spec.sites, *spec.tendons, *spec.skins, *spec.meshes)}


def write_out_inertias(spec: mujoco.MjSpec) -> None:
    """Replace compiler settings that determine masses and inertias by explicit values, in place.

    All parts of a scene share one set of compiler settings.
    """
    compiler = spec.compiler
    settings = (compiler.settotalmass > 0, compiler.boundmass, compiler.boundinertia, compiler.balanceinertia)
    by_geoms = compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
    if any(settings) or by_geoms or tuple(compiler.inertiagrouprange) != (0, 5):
        with warnings_as_notes():
            model = spec.compile()
        for body in spec.bodies[1:]:
            _write_inertia(body, model)
    compiler.settotalmass = -1.0
    compiler.boundmass = compiler.boundinertia = 0.0
    compiler.balanceinertia = False
    compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
    compiler.inertiagrouprange = (0, 5)


def _write_inertia(body: Any, model: mujoco.MjModel) -> None:
    if model.body_mass[body.id] == 0:
        for geom in body.geoms:
            geom.mass = 0.0
        return
    body.explicitinertial = True
    body.mass = model.body_mass[body.id]
    body.inertia = model.body_inertia[body.id]
    body.ipos = model.body_ipos[body.id]
    body.iquat = model.body_iquat[body.id]
    body.ialt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    body.fullinertia = np.full(6, np.nan)
