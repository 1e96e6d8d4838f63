"""Repair of overlaps between a link and what it is jointed to."""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

import mujoco
from lxml import etree

from aidsr.core.errors import MjcfError
from aidsr.mjcf.compile import compile_mjcf
from aidsr.mjcf.location import Element
from aidsr.mjcf.names import named
from aidsr.sim.structure import read_structure
from aidsr.validation.repairs.telling import told
from aidsr.validation.thresholds import OVERLAP_LENGTH, OVERLAP_NOTICED, OVERLAP_SHARE

__all__ = ["attached_overlaps"]


def attached_overlaps(root: Element) -> Iterator[str]:
    """Exclude from contact two bodies that overlap where one is jointed to the other.

    MuJoCo does this itself for parent and child, but not where the parent stands still in the world, nor across a body
    without shape that only carries a joint.

    Source: MuJoCo documentation, Computation, collision detection, filtering.
    """
    try:
        model = compile_mjcf(etree.tostring(root, encoding="unicode"))
    except MjcfError:
        return
    bodies = {element.get("name", ""): element for element, kind in named(root) if kind == "body"}
    for upper, lower in sorted(_overlapping(model)):
        first, second = (
            cast("str", mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body)) for body in (upper, lower)
        )
        if first in bodies and second in bodies:
            _exclude(root, first, second)
            yield told(
                bodies[second],
                f"excluded from contact with '{first}', which it is jointed to and overlaps in the drawn pose",
            )


def _overlapping(model: mujoco.MjModel) -> set[tuple[int, int]]:
    """Return pairs of a body and the body it is jointed to that overlap by more than the validator lets pass."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    length_m = read_structure(model).characteristic_length_m
    found = set()
    for contact in data.contact:
        geoms = [int(contact.geom1), int(contact.geom2)]
        pair = sorted(int(model.geom_bodyid[geom]) for geom in geoms)
        depth_m = -float(contact.dist)
        thickness_m = min(2.0 * float(min(model.geom_aabb[geom][3:])) for geom in geoms)
        too_deep = depth_m > OVERLAP_SHARE * thickness_m and depth_m > OVERLAP_NOTICED * length_m
        if (too_deep or depth_m > OVERLAP_LENGTH * length_m) and _is_jointed(model, pair[0], pair[1]):
            found.add((pair[0], pair[1]))
    return found


def _is_jointed(model: mujoco.MjModel, upper: int, lower: int) -> bool:
    """Whether a body hangs from another by joints, with nothing between them that has a shape."""
    jointed, body = False, lower
    while body > upper:
        if body != lower and model.body_geomnum[body]:
            return False
        jointed = jointed or bool(model.body_jntnum[body])
        body = int(model.body_parentid[body])
    return jointed and body == upper and upper > 0


def _exclude(root: Element, first: str, second: str) -> None:
    contact = root.find("contact")
    if contact is None:
        contact = etree.SubElement(root, "contact")
    etree.SubElement(contact, "exclude", body1=first, body2=second)
