"""The environment as a page of facts that a model can calculate with."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from aidsr.core.artifacts import BodySummary, EnvironmentSummary, MountSummary, Vec3
from aidsr.teams.llm.arrangements import row_length
from aidsr.teams.llm.describe_shapes import MUJOCO_GRIP, Grip, grip_words, shape_lines
from aidsr.teams.llm.numbers import at, number, vector
from aidsr.teams.llm.repeated_bodies import Copies, copied_bodies

__all__ = ["describe_environment"]


def describe_environment(summary: EnvironmentSummary) -> str:
    """Return the environment in words and numbers; lengths in metres, positions in world coordinates at the start.

    Shapes that nothing can touch are told only where they have a name. Shapes of one kind that follow each other in a
    pattern are told together, and so are bodies that are copies of one another.
    """
    mounts = {mount.name for mount in summary.mounts}
    sites = [f"- {s.name} on {s.body}, at {vector(s.position_m)}" for s in summary.sites if s.name not in mounts]
    usual = _usual_grip(summary)
    sections = [
        f"Gravity {vector(summary.gravity_m_s2)} m/s2, time step {number(summary.timestep_s)} s. "
        "Lengths in metres; positions in world coordinates at the start. "
        f"Friction {grip_words(usual)} unless said otherwise; this counts where the robot touches, not its own.",
        _section("Mounts, where a robot's root can be attached", [_mount(mount) for mount in summary.mounts]),
        _section("Bodies", [line for copies in copied_bodies(summary.bodies) for line in _bodies(copies, usual)]),
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
        f"- {mount.name}, at {vector(mount.position_m)}; the robot's +z points along {vector(mount.z_axis)}, "
        f"its +x along {vector(mount.x_axis)}, its +y along {vector(_cross(mount.z_axis, mount.x_axis))}; {moved}"
    )


def _usual_grip(summary: EnvironmentSummary) -> Grip:
    """Return what most of the shapes that can be touched have."""
    solid = Counter((geom.friction, geom.priority) for body in summary.bodies for geom in body.geoms if geom.solid)
    return solid.most_common(1)[0][0] if solid else MUJOCO_GRIP


def _bodies(copies: Copies, usual: Grip) -> list[str]:
    """Tell all of a body and what is on it, and of its copies where they are."""
    lines = [line for body in copies.first for line in _body(body, usual)]
    if copies.others:
        like = f"each like {copies.first[0].name}{' and all that is on it' if copies.first[1:] else ''}"
        lines.append(f"- {_names(copies.others)}: {like}, with its own number in all names, {_places(copies.others)}")
    return lines


def _names(trees: Sequence[Sequence[BodySummary]]) -> str:
    """Return the names of all bodies, in short where they only count up."""
    if len(trees) > 3 and not trees[0][1:]:
        return f"{trees[0][0].name} to {trees[-1][0].name}"
    return ", ".join(" with ".join(filter(None, (tree[0].name, _and(tree[1:])))) for tree in trees)


def _body(body: BodySummary, usual: Grip) -> list[str]:
    if body.name == "world":
        facts = ["world (does not move)"]
    else:
        facts = [f"{body.name} on {body.parent}, at {vector(body.position_m)}, {number(body.mass_kg)} kg"]
        facts += body.joints or ("no joint",)
    geoms = [geom for geom in body.geoms if geom.solid or geom.name]
    return [f"- {'; '.join(facts)}", *(f"  {line}" for line in shape_lines(geoms, usual))]


def _and(bodies: Iterable[BodySummary]) -> str:
    return " and ".join(body.name for body in bodies)


def _places(trees: Sequence[Sequence[BodySummary]]) -> str:
    places = [tree[0].position_m for tree in trees]
    if row_length(np.array(places)) == len(places):
        return f"evenly in a row from {vector(places[0])} to {vector(places[-1])}"
    return at(places)


def _cross(a: Vec3, b: Vec3) -> Vec3:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
