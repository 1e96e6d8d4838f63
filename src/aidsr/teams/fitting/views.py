"""Ways to read a goal: as which kind of job, from which mount, and pointing in which direction.

The rules read a brief by its words and see one target. A view turns a goal and the geometry into such a brief: it has
one kind of job, one mount, which may be turned towards the place of work, and this place as the only named body.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import BodySummary, Brief, Concept, MountSummary, Placement, Vec3
from aidsr.tasks.goals import Goal
from aidsr.tasks.goals.stages import Stages
from aidsr.teams.fitting.working_points import worked_on, working_geom
from aidsr.teams.rules.families import Families, variants_for
from aidsr.teams.rules.job_kinds import JobKindName

Matrix = NDArray[np.float64]

_WORDS: dict[JobKindName, str] = {
    "reach": "reach",
    "pull": "pull",
    "grasp": "grasp",
    "brush": "brush",
    "crawl": "crawl",
    "squeeze": "tunnel",
}
"""Kinds of job that are tried, with the word by which the rules recognize each."""
_KINDS = tuple(_WORDS)
_NAME = "workpiece"
"""Name of the place of work in a view. It contains no word of any kind of job."""
_PREFIX = "view_"
"""Prefix of the parameters in which a concept keeps its view."""
_ASIDE_DEG = (0.0, 90.0, 180.0, 270.0)
"""Rotations about the direction to the place of work [deg]. Our choice: one of them suits a body that leans aside, or
bends in a plane."""
_TILT_DEG = 25.0
"""Angle by which a body that pulls points beside the place of work [deg]. Our choice: the angle by which the rules lean
an arm that reaches."""
_WIDE_TILT_DEG = 50.0
"""The same angle if most placements with the usual one overlap something [deg]. Our choice: twice as much."""
_DETOUR_FACTOR = 1.25
"""Length of a body that has to get around an obstacle, relative to the length for the straight way. Our choice: the two
sides of a triangle whose height is three eighths of its base."""
_LONGER = 1.05
"""Length of a robot provided by the user after scaling, relative to the distance to the place of work. Our choice: as
for arms of the rules."""
_ALONG_Z = 4
"""Index in `_TO_Z` of a robot that needs no rotation."""
_TO_Z: tuple[Vec3, ...] = (
    (0.0, 90.0, 0.0),
    (0.0, -90.0, 0.0),
    (-90.0, 0.0, 0.0),
    (90.0, 0.0, 0.0),
    (0.0, 0.0, 0.0),
    (180.0, 0.0, 0.0),
)
"""Rotations that turn -x, +x, -y, +y, +z and -z of a robot to the mount's z axis, as in a `Placement` [deg]."""
_FLAT = 1e-9
"""Cosine below which an angle counts as a quarter turn. Our choice: well above rounding errors, far below the precision
of a placement."""


@dataclass(frozen=True)
class View:
    """One way to read a goal."""

    kind: JobKindName
    mount: int = -1
    """Index of the environment's mount; -1 for the world."""
    turn_deg: float | None = None
    """None if the robot points along the mount's axis. Otherwise it points to the place of work, rotated about this
    direction by this angle [deg]."""
    tilt_deg: float = 0.0
    """Angle by which the robot points beside the place of work [deg]; 0 for the usual angle of the kind of job."""
    length_factor: float = 1.0
    """Length relative to the length for the straight way."""
    scale: float = 1.0
    """Scale of a robot that the user provided."""
    axis: int = _ALONG_Z
    """Direction in which that robot extends in its own frame: 0 to 5 for -x, +x, -y, +y, +z, -z."""

    @property
    def parameters(self) -> dict[str, float]:
        """The parameters in which a concept keeps the view."""
        turn = {} if self.turn_deg is None else {f"{_PREFIX}turn_deg": self.turn_deg}
        numbers = {
            "kind": _KINDS.index(self.kind),
            "mount": self.mount,
            "aslant_deg": self.tilt_deg,
            "longer": self.length_factor,
            "scale": self.scale,
            "axis": self.axis,
        }
        return {f"{_PREFIX}{name}": float(number) for name, number in numbers.items()} | turn

    @classmethod
    def of(cls, concept: Concept) -> View:
        """Return the view of a concept; without its parameters, the view has the first kind of job and the world."""
        found = concept.parameters
        kind = _KINDS[int(found.get(f"{_PREFIX}kind", 0.0))]
        return cls(
            kind,
            int(found.get(f"{_PREFIX}mount", -1.0)),
            found.get(f"{_PREFIX}turn_deg"),
            found.get(f"{_PREFIX}aslant_deg", 0.0),
            found.get(f"{_PREFIX}longer", 1.0),
            found.get(f"{_PREFIX}scale", 1.0),
            int(found.get(f"{_PREFIX}axis", _ALONG_Z)),
        )


def without_view(concept: Concept) -> Concept:
    """Return a concept without the parameters of its view, as the rules expect it."""
    own = {name: value for name, value in concept.parameters.items() if not name.startswith(_PREFIX)}
    return concept.model_copy(update={"parameters": own})


def with_view(concept: Concept, view: View) -> Concept:
    """Return a concept with the parameters of a view."""
    return concept.model_copy(update={"parameters": {**concept.parameters, **view.parameters}})


def kinds_of(goal: Goal) -> tuple[JobKindName, ...]:
    """Return the kinds of job that a goal may be: by whether the robot travels, and whether bodies are to be moved."""
    if goal.robot_travels:
        return ("crawl", "squeeze")
    if goal.moves_bodies:
        return ("reach", "pull", "grasp")
    return ("reach", "pull", "brush")


def candidates(brief: Brief, goal: Goal, families: Families) -> Iterator[tuple[View, str, str]]:
    """Yield views with families and variants, the most different first: each family once, then further variants."""
    mounts = range(len(brief.summary.mounts)) if not goal.robot_travels else ()
    tried: list[tuple[int, int, View, str, str]] = []
    for kind in kinds_of(goal):
        for name, variants in variants_for(kind, families).items():
            for rank, variant in enumerate(variants):
                for mount in mounts or (-1,):
                    tried.append((rank, len(tried), View(kind, mount), name, variant))
    seen = set()
    for _, _, view, name, variant in sorted(tried, key=lambda each: each[:2]):
        if (view.mount, name, variant) not in seen:
            seen.add((view.mount, name, variant))
            yield view, name, variant


def turns_of(view: View) -> tuple[View, ...]:
    """Return the view along the mount's axis, and those towards the place of work; without a mount only the view."""
    if view.mount < 0:
        return (view,)
    return (view, *(replace(view, turn_deg=turn) for turn in _ASIDE_DEG))


def tilted(view: View) -> tuple[View, ...]:
    """Return views that point farther beside the place of work, for the case that there is little room before it."""
    return tuple(replace(each, tilt_deg=_WIDE_TILT_DEG) for each in turns_of(view) if each.turn_deg is not None)


def detour(view: View) -> View:
    """Return a view of a body that is long enough to get around an obstacle."""
    return replace(view, length_factor=_DETOUR_FACTOR)


def own_views(brief: Brief, goal: Goal, low_m: Vec3, high_m: Vec3) -> Iterator[View]:
    """Yield views of a robot that the user provided: with and without scaling, from each mount, in all directions.

    It is scaled to the distance of the place of work. The directions are those of `turns_of`.

    Args:
        brief: The job.
        goal: Goal resolved in its environment.
        low_m: Lower corner of the box around the robot, in its own frame [m].
        high_m: Upper corner of this box [m].
    """
    ends = [-low_m[0], high_m[0], -low_m[1], high_m[1], high_m[2], -low_m[2]]
    axis = int(np.argmax(ends))
    place = place_of_work(brief, goal)
    if goal.robot_travels or place is None or not brief.summary.mounts:
        yield View("crawl" if goal.robot_travels else "reach", -1)
        return
    for index, mount in enumerate(brief.summary.mounts):
        way_m = float(np.linalg.norm(np.array(place) - np.array(mount.position_m)))
        wanted = round(float(np.clip(_LONGER * way_m / max(ends[axis], 1e-6), 0.5, 2.0)), 3)
        for scale in dict.fromkeys((1.0, wanted)):
            # "pull" points beside the place of work: pointing straight at it, so long a robot would overlap it
            yield from turns_of(View("pull", index, scale=scale, axis=axis))


def as_the_rules_read(brief: Brief, goal: Goal, view: View) -> Brief:
    """Return the brief of a view, by which the rules read the goal."""
    place = _farther(_place_of_work(brief, goal, handle=view.kind == "pull"), brief, view)
    mounts: tuple[MountSummary, ...] = ()
    if view.mount >= 0:
        mounts = (_turned(brief.summary.mounts[view.mount], _rotation(brief, goal, view)),)
    elif brief.summary.mounts and goal.robot_travels:
        mounts = brief.summary.mounts[:1]
    bodies = tuple(
        body.model_copy(update={"geoms": tuple(geom.model_copy(update={"name": ""}) for geom in body.geoms)})
        for body in brief.summary.bodies
        if place is None or body.name not in worked_on(brief, goal)
    )
    base = brief.base
    if base == "any":
        base = "free" if goal.robot_travels else "moving" if mounts and mounts[0].moved_by else "fixed"
    found = bodies if place is None else (*bodies, place)
    return brief.model_copy(
        update={
            "objective": f"{_WORDS[view.kind]} {_NAME}",
            "base": base,
            "summary": brief.summary.model_copy(update={"mounts": mounts, "bodies": found}),
            "starting_robot": "",
        }
    )


def as_placed(brief: Brief, goal: Goal, view: View, placement: Placement) -> Placement:
    """Return a placement made for a view, converted to the environment."""
    update: dict[str, object] = {
        "intended_contacts": goal.bodies or _kept(brief, placement.intended_contacts),
        "scale": view.scale,
    }
    if view.turn_deg is not None or view.axis != _ALONG_Z:
        turn = _rotation(brief, goal, view)
        position = turn @ np.array(placement.position_m)
        update["rotation_deg"] = _angles_deg(turn @ _matrix(placement.rotation_deg) @ _matrix(_TO_Z[view.axis]))
        update["position_m"] = tuple(round(float(each), 5) + 0.0 for each in position)
        update["reason"] = f"{placement.reason} It points at the place of work."
    return placement.model_copy(update=update)


def as_viewed(brief: Brief, goal: Goal, view: View, placement: Placement) -> Placement:
    """Return a placement in the environment, converted to a view; the inverse of `as_placed`."""
    if view.turn_deg is None and view.axis == _ALONG_Z:
        return placement
    back = _rotation(brief, goal, view).T
    position = back @ np.array(placement.position_m)
    return placement.model_copy(
        update={
            "rotation_deg": _angles_deg(back @ _matrix(placement.rotation_deg) @ _matrix(_TO_Z[view.axis]).T),
            "position_m": tuple(round(float(each), 5) + 0.0 for each in position),
        }
    )


def place_of_work(brief: Brief, goal: Goal) -> Vec3 | None:
    """Return the position at which a goal is worked at first [m]; None if the robot only travels."""
    place = _place_of_work(brief, goal, handle=False)
    return None if place is None else place.position_m


def _kept(brief: Brief, names: tuple[str, ...]) -> tuple[str, ...]:
    known = {body.name for body in brief.summary.bodies}
    return tuple(name for name in names if name in known)


def _farther(place: BodySummary | None, brief: Brief, view: View) -> BodySummary | None:
    """Return the place of work, moved away from the mount by the relative length of a view."""
    if place is None or view.mount < 0 or view.length_factor == 1.0:
        return place
    start = np.array(brief.summary.mounts[view.mount].position_m)
    (geom,) = place.geoms
    position_m = _vector(start + view.length_factor * (np.array(geom.position_m) - start))
    return place.model_copy(
        update={"position_m": position_m, "geoms": (geom.model_copy(update={"position_m": position_m}),)}
    )


def _place_of_work(brief: Brief, goal: Goal, *, handle: bool) -> BodySummary | None:
    """Return the shape that is worked on first, as a separate body; None if the robot only travels."""
    first = goal.stages[0] if isinstance(goal, Stages) else goal
    if first.robot_travels:
        return None
    geom = working_geom(brief, first)
    mass_kg = sum(body.mass_kg for body in brief.summary.bodies if body.name in worked_on(brief, first))
    named = geom.model_copy(update={"name": "handle" if handle else ""})
    return BodySummary(
        name=_NAME,
        parent="world",
        position_m=geom.position_m,
        mass_kg=mass_kg,
        joints=("workpiece: free",),
        free=first.moves_bodies,
        movable=True,
        geoms=(named,),
    )


def _rotation(brief: Brief, goal: Goal, view: View) -> Matrix:
    """Return the rotation matrix by which a view turns its mount, in the mount's own frame, (3, 3)."""
    place = _place_of_work(brief, goal, handle=False)
    if view.turn_deg is None or place is None:
        return np.eye(3)
    mount = brief.summary.mounts[view.mount]
    frame = _frame(mount)
    way = frame.T @ (np.array(place.position_m) - np.array(mount.position_m))
    way /= max(float(np.linalg.norm(way)), 1e-9)
    lean = _matrix((math.degrees(math.atan2(-way[1], way[2])), math.degrees(math.asin(np.clip(way[0], -1, 1))), 0.0))
    # a body that reaches is leaned by the rules; without a lean, one that pulls would grow into what it has to hook
    tilt_deg = view.tilt_deg or (_TILT_DEG if view.kind == "pull" else 0.0)
    return np.asarray(lean @ _matrix((0.0, 0.0, view.turn_deg)) @ _matrix((0.0, tilt_deg, 0.0)))


def _turned(mount: MountSummary, rotation: Matrix) -> MountSummary:
    frame = _frame(mount) @ rotation
    return mount.model_copy(update={"x_axis": _vector(frame[:, 0]), "z_axis": _vector(frame[:, 2])})


def _frame(mount: MountSummary) -> Matrix:
    x, z = np.array(mount.x_axis), np.array(mount.z_axis)
    return np.column_stack([x, np.cross(z, x), z])


def _vector(values: Matrix) -> Vec3:
    x, y, z = (round(float(value), 6) + 0.0 for value in values)
    return x, y, z


def _matrix(angles_deg: tuple[float, float, float]) -> Matrix:
    """Return the rotation matrix of a `Placement`, (3, 3): about x, then the new y, then the new z."""
    a, b, c = np.deg2rad(angles_deg)
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    about_z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return np.asarray(about_x @ about_y @ about_z)


def _angles_deg(turn: Matrix) -> Vec3:
    """Return a rotation matrix as the angles of a `Placement` [deg]."""
    flat = math.hypot(turn[0, 0], turn[0, 1])
    b = math.atan2(float(turn[0, 2]), flat)
    if flat < _FLAT:  # a quarter turn about y (gimbal lock): rotations about x and z cannot be told apart
        a, c = 0.0, math.atan2(float(turn[1, 0]), float(turn[1, 1]))
    else:
        a = math.atan2(-float(turn[1, 2]), float(turn[2, 2]))
        c = math.atan2(-float(turn[0, 1]), float(turn[0, 0]))
    x, y, z = (round(math.degrees(angle), 3) + 0.0 for angle in (a, b, c))
    return x, y, z
