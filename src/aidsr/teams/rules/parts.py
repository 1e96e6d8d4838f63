"""Parts that several families share: base plate, tip pad, hook, and the sensors of the tip."""

from __future__ import annotations

from lxml import etree

from aidsr.mjcf.edit import Value
from aidsr.teams.rules.chain import Backbone
from aidsr.teams.rules.mjcf_builder import MjcfBuilder, add

HOOK_RADIUS_M = 0.005
"""Half thickness of a hook [m]. Our choice: it fits behind a handle with a gap of 20 mm or more."""

HOOK_SHAFT_M = 0.006
"""Length of the hook along the chain, before its finger turns aside [m]."""

_PAD_DENSITY_KG_M3 = 900.0
_HOOK_DENSITY_KG_M3 = 1200.0


def add_base(builder: MjcfBuilder, name: str, *, radius_m: float, thickness_m: float) -> etree._Element:
    """Add the root body: a round plate whose free face is at the root's origin."""
    body = add(builder.worldbody, "body", name=name)
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


def add_pad(backbone: Backbone, name: str, radius_m: float, half_width_m: float = 0.0) -> None:
    """Add a ball to the end of the chain, or a bar across it if its half width is above 0."""
    end = backbone.tip_at_m
    ends = (0.0, -half_width_m, end, 0.0, half_width_m, end)
    shape: dict[str, Value] = {"type": "sphere", "pos": (0.0, 0.0, end)}
    if half_width_m > 0:
        shape = {"type": "capsule", "fromto": ends}
    add(backbone.tip, "geom", name=name, size=(radius_m,), density=_PAD_DENSITY_KG_M3, material="working", **shape)


def add_hook(backbone: Backbone, length_m: float) -> None:
    """Add a hook to the end of the chain: a finger across it, towards the chain's +x."""
    start, end = backbone.tip_at_m, backbone.tip_at_m + HOOK_SHAFT_M
    for name, ends in (
        ("hook_shaft", (0.0, 0.0, start, 0.0, 0.0, end)),
        ("hook_finger", (0.0, 0.0, end, length_m, 0.0, end)),
    ):
        shape: dict[str, Value] = {"type": "capsule", "size": (HOOK_RADIUS_M,), "fromto": ends}
        add(backbone.tip, "geom", name=name, density=_HOOK_DENSITY_KG_M3, material="working", **shape)


def add_tip_sensors(
    builder: MjcfBuilder, backbone: Backbone, radius_m: float, at_m: tuple[float, float, float] | None = None
) -> None:
    """Add the site of the working point, and sensors of its position, its velocity and the contacts around it."""
    at = at_m or (0.0, 0.0, backbone.tip_at_m)
    add(backbone.tip, "site", name="tip", pos=at, size=(0.003,), material="working")
    add(builder.sensor, "framepos", name="tip_position", objtype="site", objname="tip")
    add(builder.sensor, "framelinvel", name="tip_velocity", objtype="site", objname="tip")
    add_touch_sensor(builder, backbone, "tip", radius_m, at)


def add_touch_sensor(
    builder: MjcfBuilder, backbone: Backbone, name: str, radius_m: float, at_m: tuple[float, float, float] | None = None
) -> None:
    """Add a sensor of the contacts within a radius around the chain's end, or around `at_m` in the last link [m]."""
    at = at_m or (0.0, 0.0, backbone.tip_at_m)
    add(backbone.tip, "site", name=f"{name}_touch", pos=at, size=(radius_m,), rgba="0 0 0 0")
    add(builder.sensor, "touch", name=f"{name}_contact", site=f"{name}_touch")
