"""Scope checks of contact: the robot must touch its surroundings, and not pass through, stick to or run on them."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from aidsr.sim.extent import UNBOUNDED, bounding_box_m, geoms_box_m, outside_m
from aidsr.sim.functional_part import FUNCTIONAL_SITE
from aidsr.sim.placement import first_shapes
from aidsr.sim.scope_reader import ScopeFinding, ScopeReader
from aidsr.sim.structure import OFF_SHARE

Vector = NDArray[np.float64]

GHOST_SHARE = 0.25
"""Largest allowed length of a limb that cannot touch anything / length of the limb. Our choice."""
COVER_SHARE = 0.05
"""Distance / L within which a colliding geom covers a geom that does not collide, as a skin or the discs of a backbone
do. Our choice: half the spacing of ten discs."""
GAP_SHARE = 0.01
"""Largest depth / L to which a geom's `gap` lets others enter without force; beyond it the geom counts as one that does
not collide."""
MARGIN_SHARE = 0.02
"""Largest allowed distance / L at which a contact begins to push. Our choice: margins for early contact detection are
far smaller."""
MOUNTED_SHARE = 0.3
"""Distance / L from the mounted part within which bodies of a limb may pass through the mount. Our choice."""


def _collides(reader: ScopeReader) -> dict[int, bool]:
    """Return for each geom of the robot whether it collides with all surroundings with which any of them collides."""
    model, structure = reader.model, reader.structure
    ours = set(structure.geoms)
    others = [g for g in range(model.ngeom) if g not in ours and (model.geom_contype[g] or model.geom_conaffinity[g])]
    types, affinities = (
        np.asarray(a)[others] if others else np.array([1]) for a in (model.geom_contype, model.geom_conaffinity)
    )
    touched = {
        g: (int(model.geom_contype[g]) & affinities) | (int(model.geom_conaffinity[g]) & types) != 0
        for g in structure.geoms
    }
    most = np.any(list(touched.values()), axis=0) if touched else np.zeros(0, dtype=bool)
    deep_m = GAP_SHARE * reader.length_m
    return {
        g: bool(most.any() and (row >= most).all() and model.geom_gap[g] - model.geom_margin[g] <= deep_m)
        for g, row in touched.items()
    }


def find_ghosts(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find limbs of which nothing can touch a large part, and no colliding geom of the robot covers that part.

    A rigid part has the length of its longest geom, so that geoms beside or inside each other count once.
    """
    model, structure = reader.model, reader.structure
    collides = _collides(reader)
    moving = [
        g
        for g in structure.geoms
        if int(model.geom_bodyid[g]) in structure.moving and int(model.geom_type[g]) not in UNBOUNDED
    ]
    solid = [g for g in structure.geoms if collides[g]]
    ghosts = [g for g in moving if not collides[g]]
    if not ghosts:
        return
    lengths = {g: 2 * float(np.max(model.geom_aabb[g][3:])) for g in moving}
    bare = {g: _uncovered(reader, g, solid) * lengths[g] if g in ghosts else 0.0 for g in moving}
    share, whole_m, limb = max(_bare_limbs(reader, lengths, bare))
    if share > GHOST_SHARE:
        names = tuple(dict.fromkeys(reader.geom(g) for g in limb if bare[g] > 0))
        message = "passes through what is around it"
        yield ScopeFinding("ghost_shape", message, names, share, GHOST_SHARE, whole=whole_m, whole_unit="m")


def _bare_limbs(
    reader: ScopeReader, lengths: dict[int, float], bare: dict[int, float]
) -> Iterator[tuple[float, float, list[int]]]:
    """Yield for each limb the share of its length that is bare, its length [m], and its geoms.

    What moves and hangs on no joint that turns is a limb of its own.

    Args:
        reader: The robot.
        lengths: Length of each moving geom [m].
        bare: Length of it that nothing can touch [m].
    """
    model = reader.model
    chain_of = {body: number for number, chain in enumerate(reader.structure.chains) for body in chain.bodies}
    limbs: dict[int, dict[int, list[int]]] = {}
    for geom in lengths:
        body = int(model.geom_bodyid[geom])
        part = int(model.body_weldid[body])
        while body and body not in chain_of:
            body = int(model.body_parentid[body])
        limbs.setdefault(chain_of.get(body, -1), {}).setdefault(part, []).append(geom)
    for parts in limbs.values():
        whole_m = sum(max(lengths[geom] for geom in part) for part in parts.values())
        bare_m = sum(max(bare[geom] for geom in part) for part in parts.values())
        yield bare_m / whole_m if whole_m > 0 else 0.0, whole_m, [geom for part in parts.values() for geom in part]


def _uncovered(reader: ScopeReader, geom: int, solid: list[int]) -> float:
    """Return the share of a geom's surface that is far from every colliding geom of the robot."""
    if not solid:
        return 1.0
    model, data = reader.model, reader.data
    box = model.geom_aabb[geom]
    points = data.geom_xpos[geom] + (box[:3] + _surface(box[3:])) @ data.geom_xmat[geom].reshape(3, 3).T
    apart = points[:, None] - data.geom_xpos[solid]
    local = np.einsum("pgi,gij->pgj", apart, data.geom_xmat[solid].reshape(-1, 3, 3)) - model.geom_aabb[solid, :3]
    away_m = np.linalg.norm(np.maximum(np.abs(local) - model.geom_aabb[solid, 3:], 0.0), axis=2).min(axis=1)
    return float(np.mean(away_m > COVER_SHARE * reader.length_m))


def find_excluded_contacts(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find contact exclusions and contact pairs between the robot and its surroundings.

    Exclusions between the beginning of a limb and its mount are allowed.
    """
    model, structure = reader.model, reader.structure
    ours = set(structure.bodies)
    found: list[int] = []
    for signature in np.asarray(model.exclude_signature).tolist():
        ends = (signature >> 16, signature & 0xFFFF)
        mine = [end for end in ends if end in ours]
        if len(mine) == 1 and not _begins_on_mount(reader, mine[0], ends[0] if mine[0] == ends[1] else ends[1]):
            found += mine
    for one, other in zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True):
        mine = [int(model.geom_bodyid[geom]) for geom in (one, other) if int(model.geom_bodyid[geom]) in ours]
        found += mine if len(mine) == 1 else []
    if found:
        names = tuple(dict.fromkeys(reader.name("BODY", body) for body in found))
        message = "has contact settings of its own towards its surroundings"
        yield ScopeFinding("contact_excluded", message, names, len(names), 0)


def find_margins(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find geoms whose contacts push at a distance."""
    margins_m = {g: float(reader.model.geom_margin[g]) for g in reader.structure.geoms}
    wide = [g for g, margin_m in margins_m.items() if margin_m > MARGIN_SHARE * reader.length_m]
    if wide:
        names = tuple(dict.fromkeys(reader.geom(g) for g in wide))
        share = max(margins_m.values()) / reader.length_m
        message = "pushes what is still away from it"
        yield ScopeFinding("contact_margin", message, names, share, MARGIN_SHARE, whole=reader.length_m, whole_unit="m")


def find_part_in_the_air(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find a functional part outside the bounding box of the robot's colliding geoms, in the reference pose."""
    model, structure = reader.model, reader.structure
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, FUNCTIONAL_SITE)
    solid = [g for g, collides in _collides(reader).items() if collides and int(model.geom_type[g]) not in UNBOUNDED]
    if site not in structure.sites or not solid:
        return
    away_m = outside_m(*geoms_box_m(model, reader.data, solid), reader.data.site_xpos[site])
    if away_m > OFF_SHARE * reader.length_m:
        names = (reader.name("BODY", int(model.site_bodyid[site])),)
        share = away_m / reader.length_m
        message = "its functional part is a point in the air, away from all that can touch something"
        yield ScopeFinding("part_in_the_air", message, names, share, OFF_SHARE, whole=reader.length_m, whole_unit="m")


def find_surfaces(reader: ScopeReader) -> Iterator[ScopeFinding]:
    """Find geoms whose surface runs as a conveyor belt does, or sticks to what it touches."""
    model = reader.model
    for code, values, message in (
        ("moving_surface", np.abs(model.geom_surfacevel).max(axis=1, initial=0.0), "runs like a conveyor belt"),
        ("adhesion", np.asarray(model.geom_adhesion), "sticks to what it touches"),
    ):
        if found := [g for g in reader.structure.geoms if values[g] != 0]:
            names = tuple(dict.fromkeys(reader.geom(g) for g in found))
            yield ScopeFinding(code, message, names, len(names), 0, "shapes")


def _begins_on_mount(reader: ScopeReader, body: int, other: int) -> bool:
    """Return whether `other` is the mount and `body` is close to the fixed base or the first body with geoms on it."""
    model, structure = reader.model, reader.structure
    fixed = [root for root in structure.roots if root not in structure.free_roots]
    if int(model.body_weldid[other]) not in {int(model.body_weldid[int(model.body_parentid[root])]) for root in fixed}:
        return False
    if body in first_shapes(model, list(structure.bodies), int(model.body_weldid[other])):
        return True
    base = [b for b in structure.bodies if b not in structure.moving]
    low, high = bounding_box_m(model, reader.data, base or fixed)
    at = reader.data.xpos[body]
    return outside_m(low, high, at) <= MOUNTED_SHARE * reader.length_m


def _surface(half: Vector) -> Vector:
    """Return points on the four sides around a box's longest axis, at five stations along this axis, (20, 3).

    `half` is the half size of the box, (3,).
    """
    order = np.argsort(half)
    points = []
    for station in np.linspace(-1, 1, 5):
        for axis in order[:2]:
            for side in (-1, 1):
                point = np.zeros(3)
                point[order[2]], point[axis] = station * half[order[2]], side * half[axis]
                points.append(point)
    return np.array(points)
