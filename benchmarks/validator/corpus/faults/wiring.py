"""Faults of tendons and actuators that cannot have an effect, and of the initial pose."""

# ruff: noqa: ARG001 - every change takes a generator and a size, whether it needs them or not
from __future__ import annotations

import mujoco
import numpy as np
from benchmarks.validator.corpus.faults.anatomy import Anatomy, Array, Limb, first_of, pull_actuators, read_anatomy
from benchmarks.validator.corpus.faults.injection import Injection, UnsuitableError, of_spec, present
from benchmarks.validator.corpus.faults.parts import tree_of
from lxml import etree


def zero_gear(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Set the gear, or gain and bias, of one or all actuators to zero."""
    actuators = pull_actuators(spec)
    chosen = actuators if rng.random() < 0.4 else [actuators[int(rng.integers(len(actuators)))]]
    by_gear = bool(rng.random() < 0.6)
    for actuator in chosen:
        if by_gear:
            actuator.gear = np.zeros(6)
        else:
            actuator.gainprm, actuator.biasprm = np.zeros(10), np.zeros(10)
    return f"{'gear' if by_gear else 'gain'} of {len(chosen)} actuators set to 0"


def tendon_one_body(mjcf: str, rng: np.random.Generator, size: float) -> tuple[str, str]:
    """Route a driven tendon over sites of one body only."""
    anatomy = read_anatomy(mujoco.MjSpec.from_string(mjcf))
    tendon = _some_route(anatomy, rng)
    site = anatomy.routes[tendon][int(rng.integers(len(anatomy.routes[tendon])))]
    body = int(anatomy.model.site_bodyid[site])
    on_body = [anatomy.model.site(s).name for s in range(anatomy.model.nsite) if anatomy.model.site_bodyid[s] == body]
    if len(on_body) < 2 or not all(on_body):
        raise UnsuitableError("one site on the body")
    root = tree_of(mjcf)
    name = anatomy.model.tendon(tendon).name
    element = next(e for e in root.findall("tendon/spatial") if e.get("name") == name)
    for child in list(element):
        element.remove(child)
    for each in on_body[:3]:
        element.append(etree.Element("site", site=each))
    return etree.tostring(root, encoding="unicode"), f"tendon {name} runs on one body"


def tendon_no_moment(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Move the sites of a driven tendon to 1 / `size` of their distance from the backbone."""
    anatomy = read_anatomy(spec)
    tendon = _some_route(anatomy, rng)
    for site in anatomy.routes[tendon]:
        point = np.array(anatomy.data.site_xpos[site])
        foot = _backbone_foot(anatomy, int(anatomy.model.site_bodyid[site]), point)
        local = anatomy.to_local(int(anatomy.model.site_bodyid[site]), foot + (point - foot) / size)
        found = spec.site(anatomy.model.site(site).name)
        if found is None:
            raise UnsuitableError("sites without names")
        found.pos = local
    return f"tendon {anatomy.model.tendon(tendon).name} runs at 1/{size:.3g} of its distance from the backbone"


def _backbone_foot(anatomy: Anatomy, body: int, point: Array) -> Array:
    """Return the point nearest to `point` on the line along the limb that a body belongs to, or that is nearest."""
    nearest: tuple[float, Limb, int] | None = None
    for limb in anatomy.limbs:
        for index, anchor in enumerate(limb.anchors_m):
            apart = 0.0 if limb.bodies[index] == body else float(np.linalg.norm(anchor - point)) + 1e-6
            if nearest is None or apart < nearest[0]:
                nearest = apart, limb, index
    if nearest is None:
        raise UnsuitableError("no limb")
    _, limb, index = nearest
    along, anchor = limb.direction(index), limb.anchors_m[index]
    return np.asarray(anchor + ((point - anchor) @ along) * along)


def _some_route(anatomy: Anatomy, rng: np.random.Generator) -> int:
    model = anatomy.model
    kind = int(mujoco.mjtTrn.mjTRN_TENDON)
    driven = {int(model.actuator_trnid[i, 0]) for i in range(model.nu) if int(model.actuator_trntype[i]) == kind}
    routes = [tendon for tendon in sorted(anatomy.routes) if tendon in driven]
    if not routes:
        raise UnsuitableError("no driven tendon over sites alone")
    return routes[int(rng.integers(len(routes)))]


def bump(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Add a ball to a segment that overlaps the segment two before it, by `size` x 0.2 of that segment's width."""
    anatomy = read_anatomy(spec)
    limb = first_of(anatomy.limbs)
    if len(limb.bodies) < 4:
        raise UnsuitableError("a short limb")
    index = int(rng.integers(2, len(limb.bodies)))
    body, other = limb.bodies[index], limb.bodies[index - 2]
    wide = anatomy.half_width_m(other)
    centre = anatomy.data.xipos[other]
    along = limb.direction(index - 2)
    side = np.cross(along, rng.normal(size=3))
    side /= np.linalg.norm(side)
    reach = centre + side * (2 * wide - 0.2 * size * 2 * wide)
    found = spec.body(anatomy.model.body(body).name)
    if found is None:
        raise UnsuitableError("bodies without names")
    found.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[wide, 0, 0], pos=anatomy.to_local(body, reach), mass=1e-4)
    return f"a ball on {found.name} overlaps the segment two before it"


def sunk(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Let a free robot start inside its floor, by `size` x 0.2 of the thickness of its thinnest part."""
    anatomy = read_anatomy(spec)
    model = anatomy.model
    floors = [geom for geom in spec.worldbody.geoms if int(geom.type) == int(mujoco.mjtGeom.mjGEOM_PLANE)]
    if not floors or not any(int(kind) == 0 for kind in model.jnt_type):
        raise UnsuitableError("no floor of its own")
    thin = min(2 * model.geom_aabb[geom][3:].min() for geom in range(model.ngeom) if model.geom_bodyid[geom])
    root = next(body for body in spec.worldbody.bodies)
    root.pos = np.array(root.pos) - np.array([0, 0, 0.2 * size * thin])
    return f"begins {200 * size * thin:.3g} mm inside the floor"


def tendon_limit_violated(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Let the range of a tendon end `size` x 2 % below the tendon's length, or begin as much above it."""
    anatomy = read_anatomy(spec)
    tendon = _some_route(anatomy, rng)
    length = float(anatomy.data.ten_length[tendon])
    found = spec.tendon(anatomy.model.tendon(tendon).name)
    too_long = bool(rng.random() < 0.5)
    edge = length * (1 - 0.02 * size if too_long else 1 + 0.02 * size)
    found.range = [0.3 * length, edge] if too_long else [edge, 2 * length]
    found.limited = int(mujoco.mjtLimited.mjLIMITED_TRUE)
    return f"range of tendon {found.name} {'ends' if too_long else 'begins'} {2 * size:.3g} % away from its length"


WIRING: tuple[Injection, ...] = (
    Injection("zero_gear", of_spec(zero_gear), present()),
    Injection("tendon_one_body", tendon_one_body, present()),
    Injection(
        "tendon_no_moment", of_spec(tendon_no_moment), {"bad": (60, 1e4), "near miss": (1.5, 6), "band": (12, 25)}
    ),
    Injection("initial_penetration", of_spec(bump), {"bad": (1, 4), "near miss": (0.02, 0.2), "band": (0.3, 1)}),
    Injection("initial_penetration", of_spec(sunk), {"bad": (1, 3), "near miss": (0.02, 0.2), "band": (0.3, 1)}),
    Injection(
        "tendon_limit_violated",
        of_spec(tendon_limit_violated),
        {"bad": (2.1, 12), "near miss": (0.05, 0.48), "band": (0.6, 1.8)},
    ),
)
"""Faults of tendons, actuators and the initial pose."""
