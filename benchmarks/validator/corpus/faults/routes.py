"""Faults of cable routes and of hinge axes."""

# ruff: noqa: ARG001 - every change takes a generator and a size, whether it needs them or not
from __future__ import annotations

import mujoco
import numpy as np
from benchmarks.validator.corpus.faults.anatomy import Anatomy, Array, read_anatomy
from benchmarks.validator.corpus.faults.injection import Injection, UnsuitableError, of_spec, present

_HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)


def doubled(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Move one cable next to another over the same bodies, to `size` x 1 % of their distance."""
    anatomy, (one, other) = _neighbours(spec, rng)
    for site, model_site in zip(anatomy.routes[one], anatomy.routes[other], strict=True):
        apart = anatomy.data.site_xpos[site] - anatomy.data.site_xpos[model_site]
        _move(spec, anatomy, site, anatomy.data.site_xpos[model_site] + 0.01 * size * apart)
    return f"tendon {anatomy.model.tendon(one).name} runs where {anatomy.model.tendon(other).name} does"


def _neighbours(spec: mujoco.MjSpec, rng: np.random.Generator) -> tuple[Anatomy, tuple[int, int]]:
    """Return the anatomy and two random cables that run over the same bodies."""
    anatomy = read_anatomy(spec)
    over = {
        tendon: tuple(anatomy.model.site_bodyid[list(route)].tolist()) for tendon, route in _driven(anatomy).items()
    }
    pairs = [(one, other) for one in over for other in over if one != other and over[one] == over[other]]
    if not pairs:
        raise UnsuitableError("no two cables side by side")
    return anatomy, pairs[int(rng.integers(len(pairs)))]


def cut_short(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Let every cable act only up to 1 / `size` of its sites: the others are moved onto the axis of the limb."""
    anatomy = read_anatomy(spec)
    routes = _driven(anatomy)
    if any(len(route) < 6 for route in routes.values()) or len(anatomy.limbs[0].bodies) < 6:
        raise UnsuitableError("short cables")
    for route in routes.values():
        kept = max(2, round(len(route) / size))
        for site in route[kept:]:
            _move(spec, anatomy, site, _onto_limb(anatomy, site))
        if kept >= len(route):
            raise UnsuitableError("nothing to cut")
    return f"every cable runs through the axes of its limb behind 1/{size:.3g} of its way"


def zigzag(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Let one cable change the side of its limb after every second site."""
    anatomy, tendon = _long_cable(spec, rng)
    for index, site in enumerate(anatomy.routes[tendon]):
        if index // 2 % 2:
            _mirror(spec, anatomy, site)
    return f"tendon {anatomy.model.tendon(tendon).name} changes sides every second segment"


def one_mirrored(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Move one site of a cable to the other side of its limb."""
    anatomy, tendon = _long_cable(spec, rng)
    route = anatomy.routes[tendon]
    at = int(rng.integers(2, len(route) - 2))
    _mirror(spec, anatomy, route[at])
    return f"site {at} of tendon {anatomy.model.tendon(tendon).name} is on the other side"


def same_axes(spec: mujoco.MjSpec, rng: np.random.Generator, size: float) -> str:
    """Give the second of two hinges the axis of the first, in one body or in all."""
    pairs = []
    for body in spec.bodies:
        hinges = [joint for joint in body.joints if int(joint.type) == _HINGE]
        if len(hinges) == 2 and np.allclose(hinges[0].pos, hinges[1].pos):
            pairs.append(hinges)
    if len(pairs) < 3:
        raise UnsuitableError("no universal joints")
    chosen = pairs if rng.random() < 0.5 else pairs[int(rng.integers(len(pairs))) :][:1]
    for first, second in chosen:
        second.axis = first.axis
    return f"in {len(chosen)} bodies both hinges have one axis"


def _driven(anatomy: Anatomy) -> dict[int, tuple[int, ...]]:
    model, kind = anatomy.model, int(mujoco.mjtTrn.mjTRN_TENDON)
    driven = {int(model.actuator_trnid[i, 0]) for i in range(model.nu) if int(model.actuator_trntype[i]) == kind}
    routes = {tendon: route for tendon, route in anatomy.routes.items() if tendon in driven}
    if not routes or not anatomy.limbs:
        raise UnsuitableError("no cables over sites along a limb")
    return routes


def _long_cable(spec: mujoco.MjSpec, rng: np.random.Generator) -> tuple[Anatomy, int]:
    anatomy = read_anatomy(spec)
    long = [tendon for tendon, route in _driven(anatomy).items() if len(set(route)) >= 7]
    if not long:
        raise UnsuitableError("no cable of seven sites")
    return anatomy, long[int(rng.integers(len(long)))]


def _mirror(spec: mujoco.MjSpec, anatomy: Anatomy, site: int) -> None:
    place = np.array(anatomy.data.site_xpos[site])
    _move(spec, anatomy, site, 2 * _onto_limb(anatomy, site) - place)


def _onto_limb(anatomy: Anatomy, site: int) -> Array:
    """Return the point on the line along a site's limb that is nearest to the site."""
    place, body = np.array(anatomy.data.site_xpos[site]), int(anatomy.model.site_bodyid[site])
    best: tuple[float, Array] | None = None
    for limb in anatomy.limbs:
        own = limb.bodies.index(body) if body in limb.bodies else 0
        anchor, along = limb.anchors_m[own], limb.direction(own)
        foot = anchor + ((place - anchor) @ along) * along
        apart = float(np.linalg.norm(place - foot)) + (0 if body in limb.bodies else 1e3)
        if best is None or apart < best[0]:
            best = apart, foot
    assert best is not None
    return best[1]


def _move(spec: mujoco.MjSpec, anatomy: Anatomy, site: int, place: Array) -> None:
    found = spec.site(anatomy.model.site(site).name)
    if found is None or not found.name:
        raise UnsuitableError("sites without names")
    body = int(anatomy.model.site_bodyid[site])
    parent = found.parent
    if parent.name != anatomy.model.body(body).name:
        raise UnsuitableError("a site in a frame")
    found.pos = anatomy.to_local(body, place)


ROUTES: tuple[Injection, ...] = (
    Injection("same_cables", of_spec(doubled), {"bad": (0.05, 1.5)}),
    Injection("cables_end_early", of_spec(cut_short), {"bad": (4.5, 7)}),
    Injection("cable_cancels", of_spec(zigzag), present()),
    Injection("site_misplaced", of_spec(one_mirrored), present()),
    Injection("hinges_parallel", of_spec(same_axes), present()),
)
"""Faults of cable routes and hinge axes."""
