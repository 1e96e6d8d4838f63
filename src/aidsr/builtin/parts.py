"""Parts that several families share: base plate, tip pad, hook, and the sensors of the tip."""

from __future__ import annotations

from lxml import etree

from aidsr.builtin.chain import Backbone
from aidsr.builtin.writing import Sheet, add

__all__ = ["add_base", "add_fingertip", "add_hook", "add_pad", "sense_tip"]


def add_base(sheet: Sheet, name: str, *, radius_m: float, thickness_m: float) -> etree._Element:
    """Add the root body: a round plate whose free face is at the root's origin."""
    body = add(sheet.worldbody, "body", name=name)
    add(
        body,
        "geom",
        name=f"{name}_mount",
        type="cylinder",
        size=(radius_m, thickness_m / 2.0),
        pos=(0.0, 0.0, -thickness_m / 2.0),
        mass=0.05,
        material="base",
    )
    return body


def add_pad(backbone: Backbone, radius_m: float) -> None:
    """Round off the chain with a ball that does the touching."""
    at = (0.0, 0.0, backbone.tip_at_m)
    add(
        backbone.tip, "geom", name="tip_pad", type="sphere", size=(radius_m,), pos=at, density=800.0, material="working"
    )


def add_hook(backbone: Backbone, length_m: float, radius_m: float) -> None:
    """Let the chain end in a finger across it, towards its own +x, with a short reach along it."""
    bottom = backbone.tip_at_m
    thin = min(radius_m, 0.005)
    shaft = (0.0, 0.0, bottom, 0.0, 0.0, bottom + 0.006)
    finger = (0.0, 0.0, bottom + 0.006, length_m, 0.0, bottom + 0.006)
    add(
        backbone.tip,
        "geom",
        name="hook_shaft",
        type="capsule",
        size=(thin,),
        fromto=shaft,
        density=1200.0,
        material="working",
    )
    add(
        backbone.tip,
        "geom",
        name="hook_finger",
        type="capsule",
        size=(thin,),
        fromto=finger,
        density=1200.0,
        material="working",
    )


def add_fingertip(sheet: Sheet, backbone: Backbone, name: str, radius_m: float, half_width_m: float = 0.0) -> None:
    """Round off one of several limbs, with a bar across it where it has to be wide, and sense what it touches."""
    end = backbone.tip_at_m
    if half_width_m > 0:
        bar = (0.0, -half_width_m, end, 0.0, half_width_m, end)
        add(backbone.tip, "geom", name=name, size=(radius_m,), fromto=bar, density=600.0, material="working")
    else:
        add(
            backbone.tip,
            "geom",
            name=name,
            type="sphere",
            size=(radius_m,),
            pos=(0.0, 0.0, end),
            density=900.0,
            material="working",
        )
    reach = radius_m * 1.2 + half_width_m
    add(backbone.tip, "site", name=f"{name}_touch", pos=(0.0, 0.0, end), size=(reach,), rgba="0 0 0 0")
    add(sheet.sensor, "touch", name=f"{name}_contact", site=f"{name}_touch")


def sense_tip(sheet: Sheet, backbone: Backbone, radius_m: float) -> None:
    """Add the site that stands for the working tip, and sensors of its pose and of what it touches."""
    at = (0.0, 0.0, backbone.tip_at_m)
    add(backbone.tip, "site", name="tip", pos=at, size=(0.003,), material="working")
    add(backbone.tip, "site", name="tip_touch", pos=at, size=(radius_m,), rgba="0 0 0 0")
    add(sheet.sensor, "framepos", name="tip_position", objtype="site", objname="tip")
    add(sheet.sensor, "framelinvel", name="tip_velocity", objtype="site", objname="tip")
    add(sheet.sensor, "touch", name="tip_contact", site="tip_touch")
