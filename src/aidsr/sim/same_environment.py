"""Comparison of the environment in a scene with the environment of its task."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.ownership import equality_bodies, joins_bodies, read_ownership, tendon_wraps

_OPTIONS = (
    "gravity", "wind", "magnetic", "density", "viscosity", "impratio", "integrator", "cone", "disableflags",
    "enableflags", "disableactuator", "o_margin", "o_solref", "o_solimp", "o_friction", "solver", "iterations",
    "tolerance", "ls_iterations", "ls_tolerance", "noslip_iterations", "noslip_tolerance", "ccd_iterations",
    "ccd_tolerance",
)  # fmt: skip
_FIELDS = {
    "body": ("pos", "quat", "ipos", "iquat", "mass", "inertia", "gravcomp"),
    "jnt": (
        "type", "pos", "axis", "stiffness", "stiffnesspoly", "limited", "range", "margin", "solref", "solimp",
        "actfrclimited", "actfrcrange", "actgravcomp",
    ),
    "dof": ("damping", "dampingpoly", "armature", "frictionloss", "solref", "solimp"),
    "geom": (
        "type", "contype", "conaffinity", "condim", "priority", "size", "pos", "quat", "friction", "solmix", "solref",
        "solimp", "margin", "gap", "fluid", "adhesion", "surfacevel",
    ),
    "site": ("pos", "quat"),
    "actuator": (
        "trntype", "dyntype", "gaintype", "biastype", "dynprm", "gainprm", "biasprm", "ctrllimited", "ctrlrange",
        "forcelimited", "forcerange", "actlimited", "actrange", "gear", "damping", "dampingpoly", "armature", "delay",
    ),
    "sensor": ("type", "objtype", "reftype", "cutoff"),
    "eq": ("type", "active0", "solref", "solimp", "data"),
    "tendon": (
        "stiffness", "stiffnesspoly", "damping", "dampingpoly", "frictionloss", "armature", "limited", "range",
        "lengthspring", "margin", "solref_lim", "solimp_lim", "solref_fri", "solimp_fri", "actfrclimited",
        "actfrcrange",
    ),
}  # fmt: skip
"""Model fields of an environment that affect a task, by the kind of element."""
_KINDS = {
    "body": mujoco.mjtObj.mjOBJ_BODY,
    "jnt": mujoco.mjtObj.mjOBJ_JOINT,
    "geom": mujoco.mjtObj.mjOBJ_GEOM,
    "site": mujoco.mjtObj.mjOBJ_SITE,
    "actuator": mujoco.mjtObj.mjOBJ_ACTUATOR,
    "sensor": mujoco.mjtObj.mjOBJ_SENSOR,
    "eq": mujoco.mjtObj.mjOBJ_EQUALITY,
    "tendon": mujoco.mjtObj.mjOBJ_TENDON,
}
_WRAPPED = {
    mujoco.mjtWrap.mjWRAP_SITE: mujoco.mjtObj.mjOBJ_SITE,
    mujoco.mjtWrap.mjWRAP_SPHERE: mujoco.mjtObj.mjOBJ_GEOM,
    mujoco.mjtWrap.mjWRAP_CYLINDER: mujoco.mjtObj.mjOBJ_GEOM,
    mujoco.mjtWrap.mjWRAP_JOINT: mujoco.mjtObj.mjOBJ_JOINT,
}
_TARGETS = {
    int(mujoco.mjtTrn.mjTRN_JOINT): mujoco.mjtObj.mjOBJ_JOINT,
    int(mujoco.mjtTrn.mjTRN_JOINTINPARENT): mujoco.mjtObj.mjOBJ_JOINT,
    int(mujoco.mjtTrn.mjTRN_TENDON): mujoco.mjtObj.mjOBJ_TENDON,
    int(mujoco.mjtTrn.mjTRN_SITE): mujoco.mjtObj.mjOBJ_SITE,
    int(mujoco.mjtTrn.mjTRN_BODY): mujoco.mjtObj.mjOBJ_BODY,
    int(mujoco.mjtTrn.mjTRN_SLIDERCRANK): mujoco.mjtObj.mjOBJ_SITE,
}
_WORDS = {"jnt": "joint", "dof": "joint", "eq": "equality"}
_RELATIVE, _ABSOLUTE = 1e-3, 1e-5
"""Tolerances of the comparison: MJCF is written with six digits."""


def find_environment_change(scene: mujoco.MjModel, environment: mujoco.MjModel) -> str:
    """Return the first difference between the environment of a scene and the expected one, empty if there is none.

    A time step that is a whole fraction of the environment's does not count as a difference, since assembly reduces it
    for a robot that needs it.

    Args:
        scene: Compiled scene of a robot in an environment.
        environment: Compiled expected environment, without a robot or as a scene with one.
    """
    return next(_differences(_Environment(scene), _Environment(environment)), "")


class _Environment:
    """The elements of a model that do not belong to the robot, by kind of element and in order."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.owned = read_ownership(model)

    @cached_property
    def bodies(self) -> list[int]:
        ours = set(self.owned.bodies) if self.owned.is_scene else set()
        return [body for body in range(self.model.nbody) if body not in ours]

    def elements(self, kind: str) -> list[int]:
        model, bodies = self.model, set(self.bodies)
        if kind == "body":
            return self.bodies
        if kind in ("jnt", "dof", "geom", "site"):
            return np.flatnonzero(np.isin(getattr(model, f"{kind}_bodyid"), self.bodies)).tolist()
        if kind == "actuator":
            mine = self.owned.actuator if self.owned.is_scene else lambda _: False
            return [index for index in range(model.nactuator) if not mine(index)]
        if kind == "eq":
            return [index for index in range(model.neq) if self._couples(index, bodies)]
        if kind == "tendon":
            mine = self.owned.tendon if self.owned.is_scene else lambda _: False
            return [index for index in range(model.ntendon) if not mine(index)]
        return [index for index in range(model.nsensor) if self.name(kind, index)]

    def _couples(self, equality: int, bodies: set[int]) -> bool:
        """Return whether an equality constraint concerns the environment.

        What joins the robot to it is a matter of scope, see `aidsr.sim.scope_holding`.
        """
        ends = set(equality_bodies(self.model, equality))
        return ends <= bodies or (bool(ends & bodies) and not joins_bodies(self.model, equality))

    def rest(self, field: str) -> dict[str, NDArray[np.float64]]:
        """Return the positions of each joint in qpos0 or qpos_spring, by the joint's name or its number."""
        model, found = self.model, {}
        values = np.asarray(getattr(model, field))
        for place, joint in enumerate(self.elements("jnt"), start=1):
            first = int(model.jnt_qposadr[joint])
            size = {0: 7, 1: 4}.get(int(model.jnt_type[joint]), 1)
            found[self.name("jnt", joint) or f"number {place}"] = values[first : first + size]
        return found

    def refers_to(self, kind: str, index: int) -> tuple[str, ...]:
        """Return the names of what an actuator acts on, a sensor measures, an equality connects or a tendon runs along.

        Nothing for other elements.
        """
        model = self.model
        if kind == "actuator":
            found = _TARGETS[int(model.actuator_trntype[index])]
            return (mujoco.mj_id2name(model, found, int(model.actuator_trnid[index, 0])) or "",)
        if kind == "sensor":
            ends = (("objtype", "objid"), ("reftype", "refid"))
            pairs = [(getattr(model, f"sensor_{a}")[index], getattr(model, f"sensor_{b}")[index]) for a, b in ends]
            return tuple(mujoco.mj_id2name(model, int(a), int(b)) or "" for a, b in pairs if b >= 0)
        if kind == "eq":
            return tuple(self.name("body", body) for body in equality_bodies(model, index))
        if kind == "tendon":
            path = [(_WRAPPED.get(mujoco.mjtWrap(wrap)), target) for wrap, target in tendon_wraps(model, index)]
            return tuple(mujoco.mj_id2name(model, found, target) or "" if found else "" for found, target in path)
        return ()

    def contacts(self) -> list[tuple[str, ...]]:
        """Return the names in contact pairs and contact exclusions that concern none of the robot's bodies."""
        model, bodies = self.model, set(self.bodies)
        apart = [(int(ends) >> 16, int(ends) & 0xFFFF) for ends in model.exclude_signature]
        found = [tuple(sorted(self.name("body", end) for end in ends)) for ends in apart if set(ends) <= bodies]
        for ends in zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True):
            if {int(model.geom_bodyid[geom]) for geom in ends} <= bodies:
                found.append(tuple(sorted(self.name("geom", geom) for geom in ends)))
        return sorted(found)

    def name(self, kind: str, index: int) -> str:
        if kind == "dof":
            return self.name("jnt", int(self.model.dof_jntid[index]))
        return mujoco.mj_id2name(self.model, _KINDS[kind], index) or ""


def _differences(scene: _Environment, wanted: _Environment) -> Iterator[str]:
    for option in _OPTIONS:
        present, right = (np.atleast_1d(getattr(side.model.opt, option)) for side in (scene, wanted))
        if not np.allclose(present, right, rtol=_RELATIVE, atol=_ABSOLUTE):
            yield f"option has {option} {_numbers(present)}, not {_numbers(right)}"
    steps = wanted.model.opt.timestep / scene.model.opt.timestep
    if steps < 1 - _RELATIVE or abs(steps - round(steps)) > _RELATIVE * steps:
        yield f"the time step is {scene.model.opt.timestep:g} s, which does not divide {wanted.model.opt.timestep:g} s"
    for kind, fields in _FIELDS.items():
        here, there = scene.elements(kind), wanted.elements(kind)
        if kind in ("sensor", "site", "actuator", "tendon"):  # a task adds sensors, and the order does not matter
            by_name = {scene.name(kind, index): index for index in here}
            if missing := [name for index in there if (name := wanted.name(kind, index)) not in by_name]:
                yield f"{_WORDS.get(kind, kind)} {missing[0]} is missing"
                continue
            extra = set(by_name) - {wanted.name(kind, index) for index in there}
            if kind in ("actuator", "site", "tendon") and extra:
                yield f"{kind} {min(extra)} is none of the environment"
            here = [by_name[wanted.name(kind, index)] for index in there]
        if len(here) != len(there):
            yield f"it has {len(here)} elements of the kind {_WORDS.get(kind, kind)}, not {len(there)}"
            continue
        yield from _numbers_differ(kind, fields, scene, here, wanted, there)
        for mine, theirs in zip(here, there, strict=True):
            if scene.refers_to(kind, mine) != wanted.refers_to(kind, theirs):
                ends = " and ".join(scene.refers_to(kind, mine))
                yield f"{_WORDS.get(kind, kind)} {wanted.name(kind, theirs)} refers to {ends}"
    for field in ("qpos0", "qpos_spring"):
        asked = wanted.rest(field)
        for name, found in scene.rest(field).items():
            if name in asked and not np.allclose(found, asked[name], rtol=_RELATIVE, atol=_ABSOLUTE):
                yield f"joint {name} has {field} {_numbers(found)}, not {_numbers(asked[name])}"
    if scene.contacts() != wanted.contacts():
        yield "its pairs of contact or exclusions of contact differ"


def _numbers_differ(
    kind: str, fields: Sequence[str], scene: _Environment, here: list[int], wanted: _Environment, there: list[int]
) -> Iterator[str]:
    for field in fields:
        name = f"{kind}_{field}"
        present, right = (_rows(side.model, name, ids) for side, ids in ((scene, here), (wanted, there)))
        if field == "quat":  # q and -q are the same rotation
            present = present * np.where((present * right).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
        bad = np.flatnonzero(~np.isclose(present, right, rtol=_RELATIVE, atol=_ABSOLUTE).all(axis=1))
        if bad.size:
            row = int(bad[0])
            called = wanted.name(kind, there[row]) or f"number {row + 1}"
            what = f"{_WORDS.get(kind, kind)} {called}"
            yield f"{what} has {field} {_numbers(present[row])}, not {_numbers(right[row])}"


def _rows(model: mujoco.MjModel, name: str, ids: list[int]) -> NDArray[np.float64]:
    values = np.asarray(getattr(model, name), dtype=np.float64)
    return values.reshape(len(values), -1)[ids] if len(values) else np.zeros((0, 1))


def _numbers(values: NDArray[np.float64]) -> str:
    return " ".join(f"{value:g}" for value in np.asarray(values, dtype=np.float64))
