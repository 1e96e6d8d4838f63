"""The environment as a page of facts that a model can calculate with."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from aidsr.artifacts import BodySummary, EnvironmentSummary, GeomSummary, MountSummary, Vec3

__all__ = ["describe_environment"]

_SIZES = {
    "sphere": ("radius",),
    "capsule": ("radius", "half length"),
    "cylinder": ("radius", "half length"),
    "ellipsoid": ("half axes",),
    "box": ("half sizes",),
}
"""What MuJoCo's size numbers mean. Source: MuJoCo XML reference, geom size."""

_UPRIGHT = (0.0, 0.0, 1.0)

_Grip = tuple[Vec3, int]
"""Friction and priority of a shape."""
_MUJOCO: _Grip = (1.0, 0.005, 0.0001), 0
"""What MuJoCo takes where a model says nothing. Source: MuJoCo XML reference, geom friction and priority."""


def describe_environment(summary: EnvironmentSummary) -> str:
    """Return the environment in words and numbers; lengths in metres, positions in world coordinates at the start.

    Shapes that nothing can touch are told only where they have a name.
    """
    mounts = {mount.name for mount in summary.mounts}
    sites = [f"- {s.name} on {s.body}, at {_vector(s.position_m)}" for s in summary.sites if s.name not in mounts]
    usual = _usual_grip(summary)
    sections = [
        f"Gravity {_vector(summary.gravity_m_s2)} m/s2, time step {_number(summary.timestep_s)} s. "
        "Lengths in metres; positions in world coordinates at the start. "
        f"Friction {_grip(usual)} unless said otherwise; where a robot touches, it holds whatever the robot's is.",
        _section("Mounts, where a robot's root can be attached", [_mount(mount) for mount in summary.mounts]),
        _section("Bodies", [line for body in summary.bodies for line in _body(body, usual)]),
        _section("Sites", sites),
        f"Sensors: {', '.join(summary.sensors)}" if summary.sensors else "",
        f"Actuators of the environment: {', '.join(summary.actuators)}" if summary.actuators else "",
    ]
    return "\n\n".join(section for section in sections if section)


def _section(title: str, lines: Sequence[str]) -> str:
    return f"{title}:\n" + "\n".join(lines) if lines else ""


def _mount(mount: MountSummary) -> str:
    moved = f"moved by {', '.join(mount.moved_by)}" if mount.moved_by else "stands still"
    return (
        f"- {mount.name}, at {_vector(mount.position_m)}; the robot's +z points along {_vector(mount.z_axis)}, "
        f"its +x along {_vector(mount.x_axis)}, its +y along {_vector(_cross(mount.z_axis, mount.x_axis))}; {moved}"
    )


def _usual_grip(summary: EnvironmentSummary) -> _Grip:
    """Return what most of the shapes that can be touched have."""
    solid = Counter((geom.friction, geom.priority) for body in summary.bodies for geom in body.geoms if geom.solid)
    return solid.most_common(1)[0][0] if solid else _MUJOCO


def _grip(grip: _Grip) -> str:
    """Return friction and priority in words; the torsional and rolling friction only where they are not MuJoCo's."""
    friction, priority = grip
    shown = friction if friction[1:] != _MUJOCO[0][1:] else friction[:1]
    return f"{_vector(shown)}" + (f" at priority {priority}" if priority else "")


def _body(body: BodySummary, usual: _Grip) -> list[str]:
    if body.name == "world":
        facts = ["world (does not move)"]
    else:
        facts = [f"{body.name} on {body.parent}, at {_vector(body.position_m)}, {_number(body.mass_kg)} kg"]
        facts += body.joints or ("no joint",)
    return [
        f"- {'; '.join(facts)}",
        *(f"  - {_geom(geom)}{_contact(geom, usual)}" for geom in body.geoms if geom.solid or geom.name),
    ]


def _contact(geom: GeomSummary, usual: _Grip) -> str:
    """Say what is particular about touching a shape."""
    if not geom.solid:
        return "; only drawn"
    grip = geom.friction, geom.priority
    return "" if grip == usual else f"; friction {_grip(grip)}"


def _geom(geom: GeomSummary) -> str:
    named = f"{geom.name}: {geom.shape}" if geom.name else geom.shape
    meanings = _SIZES.get(geom.shape, ())
    if len(meanings) == 1:
        size = f", {meanings[0]} {_vector(geom.size_m)}"
    else:
        size = "".join(f", {word} {_number(value)}" for word, value in zip(meanings, geom.size_m, strict=False))
    turned = "" if geom.shape == "sphere" or geom.z_axis == _UPRIGHT else f", its z axis along {_vector(geom.z_axis)}"
    return f"{named}{size}, at {_vector(geom.position_m)}{turned}"


def _cross(a: Vec3, b: Vec3) -> Vec3:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _vector(values: Iterable[float]) -> str:
    return " ".join(_number(value) for value in values)


def _number(value: float) -> str:
    """Return a number to a tenth of a millimetre or four digits, without a negative zero."""
    rounded = round(value, 4) if abs(value) >= 0.001 else value
    return f"{rounded if abs(rounded) > 1e-9 else 0.0:.6g}"
