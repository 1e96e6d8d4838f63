"""Fixes of contact: overlapping parts, robots that lock themselves, geoms that cannot touch anything."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import combinations, islice
from typing import TYPE_CHECKING, cast

from lxml import etree

from aidsr.core.errors import MjcfError
from aidsr.core.formatting import counted
from aidsr.fixes.record import EditDocument, Fix, Request, note
from aidsr.mjcf.edit import effective_numbers, effective_value, exclude_contact, set_numbers
from aidsr.mjcf.elements import Element, elements
from aidsr.mjcf.names import named_elements

if TYPE_CHECKING:
    import mujoco


def attached_overlaps(root: Element, _: Request) -> Iterator[str]:
    """Exclude from contact two bodies that overlap where one is jointed to the other.

    MuJoCo itself excludes contact between parent and child, but not if the parent is fixed to the world, nor across a
    body without geoms that only carries a joint.

    Source: MuJoCo documentation, Computation, collision detection, filtering.
    """
    import mujoco

    from aidsr.mjcf.compile import compile_mjcf

    try:
        model = compile_mjcf(etree.tostring(root, encoding="unicode"))
    except MjcfError:
        return
    bodies = {element.get("name", ""): element for element, kind in named_elements(root) if kind == "body"}
    for upper, lower in sorted(_attached_overlaps(model)):
        first, second = (
            cast("str", mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body)) for body in (upper, lower)
        )
        if first in bodies and second in bodies:
            exclude_contact(root, first, second)
            yield note(
                bodies[second],
                f"excluded from contact with '{first}', which it is jointed to and overlaps in the drawn pose",
            )


def _attached_overlaps(model: mujoco.MjModel) -> set[tuple[int, int]]:
    """Return the pairs of jointed bodies that overlap by more than the validator allows; see `_is_jointed`."""
    import mujoco

    from aidsr.sim.overlap import overlaps_too_much
    from aidsr.sim.structure import read_structure

    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    length_m = read_structure(model).characteristic_length_m
    found = set()
    for contact in data.contact:
        geoms = [int(contact.geom1), int(contact.geom2)]
        upper, lower = sorted(int(model.geom_bodyid[geom]) for geom in geoms)
        thickness_m = min(2.0 * float(min(model.geom_aabb[geom][3:])) for geom in geoms)
        if overlaps_too_much(-float(contact.dist), thickness_m, length_m) and _is_jointed(model, upper, lower):
            found.add((upper, lower))
    return found


def _is_jointed(model: mujoco.MjModel, upper: int, lower: int) -> bool:
    """Return whether `lower` is connected to its ancestor `upper` by joints, with no body with geoms between them.

    False if `upper` is the world.
    """
    jointed, body = False, lower
    while body > upper:
        if body != lower and model.body_geomnum[body]:
            return False
        jointed = jointed or bool(model.body_jntnum[body])
        body = int(model.body_parentid[body])
    return jointed and body == upper and upper > 0


def part_base(root: Element, request: Request) -> Iterator[str]:
    """Move the only shape of a root that stands still out of the part that it overlaps."""
    import mujoco
    import numpy as np

    from aidsr.mjcf.compile import compile_mjcf

    bases = [body for body in root.iterfind("worldbody/body") if not any(map(body.findall, ("joint", "freejoint")))]
    shapes = {geoms[0].get("name"): geoms[0] for geoms in (body.findall("geom") for body in bases) if len(geoms) == 1}
    found = [name for name in request.names if name in shapes]
    if len(request.names) != 2 or len(found) != 1 or shapes[found[0]].get("fromto"):
        return
    try:
        model = compile_mjcf(etree.tostring(root, encoding="unicode"))
    except MjcfError:
        return
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    geoms = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name) for name in request.names]
    base = geoms[request.names.index(found[0])]
    depths = [contact for contact in data.contact if sorted(contact.geom) == sorted(geoms)]
    if not depths:
        return
    deepest = min(depths, key=lambda contact: contact.dist)
    # the normal points from the first geom to the second
    away = np.asarray(deepest.frame[:3]) * (deepest.dist if deepest.geom[0] == base else -deepest.dist)
    shift_m = data.xmat[model.geom_bodyid[base]].reshape(3, 3).T @ away
    place_m = effective_numbers(root, shapes[found[0]], "pos") or [0.0, 0.0, 0.0]
    set_numbers(shapes[found[0]], "pos", *(float(f"{value:.6g}") for value in np.add(place_m, shift_m)))
    yield f"moved {found[0]} by {-1000 * deepest.dist:.3g} mm, out of {(set(request.names) - set(found)).pop()}"


def exclude_overlapping(root: Element, request: Request) -> Iterator[str]:
    """Exclude contact between overlapping bodies; of more than two, only pairs with at most two bodies between them."""
    owners = _owners(root, request)
    yield from _exclude(root, _near_pairs(root, owners) if len(request.names) > 2 else combinations(owners, 2))


def exclude_locking(root: Element, request: Request) -> Iterator[str]:
    """Exclude contact between bodies of one limb that hold it, with at most two bodies between them."""
    yield from _exclude(root, _near_pairs(root, _owners(root, request)))


def _exclude(root: Element, pairs: Iterable[tuple[str, str]]) -> Iterator[str]:
    done = [f"{first} and {second}" for first, second in pairs if exclude_contact(root, first, second)]
    if done:
        yield f"excluded contact between {', '.join(done)}"


def _owners(root: Element, request: Request) -> list[str]:
    """Return the names of the bodies that a fault names, by their own names or by those of their geoms."""
    return list(dict.fromkeys(owner for owner in (_owner(root, name) for name in request.names) if owner))


def _near_pairs(root: Element, bodies: Iterable[str]) -> list[tuple[str, str]]:
    return [pair for pair in combinations(bodies, 2) if _are_near(root, *pair)]


def _owner(root: Element, name: str) -> str:
    """Return the name of the body with this name or with a geom of this name; "" if there is none or it has no name."""
    for element in elements(root, "body", "geom"):
        if element.get("name") == name:
            body = element if element.tag == "body" else next(element.iterancestors("body"), None)
            return "" if body is None else body.get("name", "")
    return ""


def _are_near(root: Element, first: str, second: str) -> bool:
    """Return whether one of two bodies is an ancestor of the other, with at most two bodies between them."""
    bodies = {body.get("name"): body for body in elements(root, "body")}
    above = [ancestor for name in (first, second) for ancestor in islice(bodies[name].iterancestors("body"), 3)]
    return bodies[first] in above or bodies[second] in above


def allow_contact(root: Element, _: Request) -> Iterator[str]:
    """Let shapes that cannot touch anything collide again, and switch contact on."""
    mute = [
        geom
        for geom in elements(root, "geom")
        if effective_value(root, geom, "contype") == "0"
        and effective_value(root, geom, "conaffinity") == "0"
        and effective_value(root, geom, "mass") != "0"
    ]
    for geom in mute:
        geom.set("contype", "1")
        geom.set("conaffinity", "1")
    if mute:
        yield f"let {counted(len(mute), 'shape')} collide"
    for flag in elements(root, "flag"):
        if flag.get("contact") == "disable":
            del flag.attrib["contact"]
            yield note(flag, "dropped contact, which was switched off")


FIXES: tuple[Fix[EditDocument], ...] = (
    Fix(part_base, cures=("initial_penetration",)),
    Fix(attached_overlaps, cures=("initial_penetration", "self_collision_lock"), safe=True),
    Fix(exclude_overlapping, cures=("initial_penetration",)),
    Fix(exclude_locking, cures=("self_collision_lock",)),
    Fix(allow_contact, cures=("contact_disabled",)),
)
