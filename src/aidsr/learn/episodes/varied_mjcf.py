"""MJCF of a scene as one episode has it, for pictures."""

from __future__ import annotations

import mujoco
from lxml import etree

from aidsr.mjcf.read import parse_document
from aidsr.tasks import Change, Variation

_VISIBLE = {
    "body_pos": "body",
    "body_quat": "body",
    "geom_pos": "geom",
    "geom_quat": "geom",
    "geom_size": "geom",
    "site_pos": "site",
}
"""MJCF element for each field of MjModel whose change is visible. Changes of mass and friction are not; positions in
`qpos` are drawn from the recorded motion."""


def varied_mjcf(mjcf: str, variation: Variation) -> str:
    """Return the MJCF of a scene with the objects that a variation moves or resizes changed, for pictures."""
    root = parse_document(mjcf).root
    elements = {(str(e.tag), e.get("name")): e for e in root.iter(etree.Element) if e.get("name")}
    for change in variation.changes:
        if change.field == "geom_type":
            elements["geom", change.name].set("type", _shape(change))
        elif change.field in _VISIBLE:
            numbers = " ".join(f"{number:.9g}" for number in change.value)
            elements[_VISIBLE[change.field], change.name].set(change.field.partition("_")[2], numbers)
    return str(etree.tostring(root, encoding="unicode"))


def _shape(change: Change) -> str:
    return str(mujoco.mjtGeom(int(change.value[0])).name.removeprefix("mjGEOM_").lower())
