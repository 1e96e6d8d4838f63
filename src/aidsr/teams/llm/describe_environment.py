"""Description of an environment as a list of facts with which a language model can calculate."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from aidsr.core.artifacts import BodySummary, EnvironmentSummary, MountSummary, Vec3
from aidsr.core.formatting import format_coordinate, format_vector
from aidsr.teams.llm.arrangements import format_positions, row_length
from aidsr.teams.llm.describe_shapes import MUJOCO_FRICTION, Friction, describe_shapes, format_friction
from aidsr.teams.llm.repeated_bodies import RepeatedBody, group_repeated_bodies


def describe_environment(summary: EnvironmentSummary) -> str:
    """Return the environment in words and numbers; lengths in metres, positions in world coordinates at the start.

    Shapes without collisions are described only if they have a name. Shapes of one kind in a pattern are grouped, and
    so are bodies that are copies of one another.
    """
    mounts = {mount.name for mount in summary.mounts}
    sites = [f"- {s.name} on {s.body}, at {format_vector(s.position_m)}" for s in summary.sites if s.name not in mounts]
    usual = _usual_friction(summary)
    sections = [
        f"Gravity {format_vector(summary.gravity_m_s2)} m/s2, time step {format_coordinate(summary.timestep_s)} s. "
        "Lengths in metres; positions in world coordinates at the start. "
        f"Friction {format_friction(usual)} unless stated otherwise; at contacts it replaces the robot's own.",
        _section("Mounts, where a robot's root can be attached", [_describe_mount(mount) for mount in summary.mounts]),
        _section(
            "Bodies",
            [line for repeated in group_repeated_bodies(summary.bodies) for line in _describe_bodies(repeated, usual)],
        ),
        _section("Sites", sites),
        f"Sensors: {', '.join(summary.sensors)}" if summary.sensors else "",
        _section("Actuators of the environment", [f"- {actuator}" for actuator in summary.actuators]),
    ]
    return "\n\n".join(section for section in sections if section)


def _section(title: str, lines: Sequence[str]) -> str:
    return f"{title}:\n" + "\n".join(lines) if lines else ""


def _describe_mount(mount: MountSummary) -> str:
    moved = f"moved by {', '.join(mount.moved_by)}" if mount.moved_by else "stands still"
    x, y, z = map(format_vector, (mount.x_axis, _cross(mount.z_axis, mount.x_axis), mount.z_axis))
    return (
        f"- {mount.name}, at {format_vector(mount.position_m)}; the robot's +z points along {z}, "
        f"its +x along {x}, its +y along {y}; {moved}"
    )


def _usual_friction(summary: EnvironmentSummary) -> Friction:
    """Return the most common friction of shapes with collisions; MuJoCo's default if there are none."""
    solid = Counter((geom.friction, geom.priority) for body in summary.bodies for geom in body.geoms if geom.solid)
    return solid.most_common(1)[0][0] if solid else MUJOCO_FRICTION


def _describe_bodies(repeated: RepeatedBody, usual: Friction) -> list[str]:
    """Describe a body with its descendants in full, and its copies by names and positions."""
    lines = [line for body in repeated.first for line in _describe_body(body, usual)]
    if repeated.copies:
        like = f"each like {repeated.first[0].name}{' and all that is on it' if repeated.first[1:] else ''}"
        names, places = _format_names(repeated.copies), _format_places(repeated.copies)
        lines.append(f"- {names}: {like}, with its own number in all names, {places}")
    return lines


def _format_names(trees: Sequence[Sequence[BodySummary]]) -> str:
    """Return the names of copies with those of their descendants; more than three without descendants as a range."""
    if len(trees) > 3 and not trees[0][1:]:
        return f"{trees[0][0].name} to {trees[-1][0].name}"
    return ", ".join(" with ".join(filter(None, (tree[0].name, _join(tree[1:])))) for tree in trees)


def _describe_body(body: BodySummary, usual: Friction) -> list[str]:
    if body.name == "world":
        facts = ["world (does not move)"]
    else:
        facts = [
            f"{body.name} on {body.parent}, at {format_vector(body.position_m)}, {format_coordinate(body.mass_kg)} kg"
        ]
        facts += body.joints or ("no joint",)
    geoms = [geom for geom in body.geoms if geom.solid or geom.name]
    return [f"- {'; '.join(facts)}", *(f"  {line}" for line in describe_shapes(geoms, usual))]


def _join(bodies: Iterable[BodySummary]) -> str:
    return " and ".join(body.name for body in bodies)


def _format_places(trees: Sequence[Sequence[BodySummary]]) -> str:
    places = [tree[0].position_m for tree in trees]
    if row_length(np.array(places)) == len(places):
        return f"evenly in a row from {format_vector(places[0])} to {format_vector(places[-1])}"
    return format_positions(places)


def _cross(a: Vec3, b: Vec3) -> Vec3:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
