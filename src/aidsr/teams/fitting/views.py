"""Ways to read a goal: what kind of job it may be, from which mount, pointing where.

The rules read a brief by its words and see one target. A view is a brief that says to them what the goal and the
geometry say: one kind of job, one mount, perhaps turned towards the place of work, and that place as all that is named.
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
"""The word by which the rules know each kind of job that is tried."""
_KINDS = tuple(_WORDS)
_NAME = "workpiece"
"""What the place of work is called in a view. It speaks for no kind of job."""
_PREFIX = "view_"
"""Of the parameters in which a concept keeps its view."""
_ASIDE_DEG = (0.0, 90.0, 180.0, 270.0)
"""Turns about the way to the place of work. Our choice: one suits a body that leans aside, or bends in a plane."""
_BESIDE_DEG = 25.0
"""How far a body that pulls points beside the place of work. Our choice: as the rules lean an arm that reaches."""
_ASLANT_DEG = 50.0
"""The same where most of these begin inside of something. Our choice: twice as far."""
_ROUND_ABOUT = 1.25
"""Length of a body that has to get round something, as a share of what the straight way asks for. Our choice: the two
sides of a triangle whose top is a third of its base high."""
_LONGER = 1.05
"""Length of a robot that is brought, after scaling, as a share of the way to the place of work. Our choice: as arms of
the rules have it."""
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
"""Rotations that bring -x, +x, -y, +y, +z and -z of a robot to the mount's z axis, as in a `Placement`."""
_FLAT = 1e-9
"""Cosine of an angle that is a quarter turn. Our choice: well above rounding, far below what a placement keeps."""


@dataclass(frozen=True)
class View:
    """One way to read a goal."""

    kind: JobKindName
    mount: int = -1
    """Which of the environment's mounts; -1 for the world."""
    turn_deg: float | None = None
    """None: along the mount's axis. Else along the way to the place of work, turned by so much about it."""
    aslant_deg: float = 0.0
    """How far beside the place of work it points; 0: as is usual for the kind."""
    longer: float = 1.0
    """Length as a share of what the straight way asks for."""
    scale: float = 1.0
    """Of a robot that its user brought."""
    axis: int = _ALONG_Z
    """Which way that robot extends in its own frame: 0 to 5 for -x, +x, -y, +y, +z, -z."""

    @property
    def parameters(self) -> dict[str, float]:
        """What a concept keeps of it."""
        turn = {} if self.turn_deg is None else {f"{_PREFIX}turn_deg": self.turn_deg}
        numbers = {
            "kind": _KINDS.index(self.kind),
            "mount": self.mount,
            "aslant_deg": self.aslant_deg,
            "longer": self.longer,
            "scale": self.scale,
            "axis": self.axis,
        }
        return {f"{_PREFIX}{name}": float(number) for name, number in numbers.items()} | turn

    @classmethod
    def of(cls, concept: Concept) -> View:
        """Return the view of a concept; one that has none is of the first kind, along the first mount."""
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
    """Return a concept as the rules know it."""
    own = {name: value for name, value in concept.parameters.items() if not name.startswith(_PREFIX)}
    return concept.model_copy(update={"parameters": own})


def with_view(concept: Concept, view: View) -> Concept:
    """Return a concept that keeps its view."""
    return concept.model_copy(update={"parameters": {**concept.parameters, **view.parameters}})


def kinds_of(goal: Goal) -> tuple[JobKindName, ...]:
    """Return the kinds of job that a goal may be, by which contact it needs."""
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
    """Return a view along the mount's axis, and those along the way to the place of work."""
    if view.mount < 0:
        return (view,)
    return (view, *(replace(view, turn_deg=turn) for turn in _ASIDE_DEG))


def aslant_of(view: View) -> tuple[View, ...]:
    """Return views that point farther beside the place of work, for where little room is before it."""
    return tuple(replace(each, aslant_deg=_ASLANT_DEG) for each in turns_of(view) if each.turn_deg is not None)


def round_about(view: View) -> View:
    """Return a view of a body that is long enough to get round something."""
    return replace(view, longer=_ROUND_ABOUT)


def own_views(brief: Brief, goal: Goal, low_m: Vec3, high_m: Vec3) -> Iterator[View]:
    """Yield views of a robot that its user brought: as it is and scaled to the way, from each mount, along either way.

    Args:
        brief: The job.
        goal: Resolved.
        low_m: Lower corner of the box around the robot, in its own frame [m].
        high_m: Upper corner [m].
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
            # beside the place of work: straight at it, so long a robot would begin inside of it
            yield from turns_of(View("pull", index, scale=scale, axis=axis))


def as_the_rules_read(brief: Brief, goal: Goal, view: View) -> Brief:
    """Return the brief of a view."""
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
    """Return a placement made for a view as it is in the environment."""
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
    """Return a placement in the environment as a view has it; the inverse of `as_placed`."""
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
    """Return where a goal is worked at first [m]; None where the robot only travels."""
    place = _place_of_work(brief, goal, handle=False)
    return None if place is None else place.position_m


def _kept(brief: Brief, names: tuple[str, ...]) -> tuple[str, ...]:
    known = {body.name for body in brief.summary.bodies}
    return tuple(name for name in names if name in known)


def _farther(place: BodySummary | None, brief: Brief, view: View) -> BodySummary | None:
    """Return the place of work as far away as the length that a view asks for."""
    if place is None or view.mount < 0 or view.longer == 1.0:
        return place
    start = np.array(brief.summary.mounts[view.mount].position_m)
    (geom,) = place.geoms
    position_m = _vector(start + view.longer * (np.array(geom.position_m) - start))
    return place.model_copy(
        update={"position_m": position_m, "geoms": (geom.model_copy(update={"position_m": position_m}),)}
    )


def _place_of_work(brief: Brief, goal: Goal, *, handle: bool) -> BodySummary | None:
    """Return what is worked on first, as a body by itself; None where the robot only travels."""
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
    """Return how a view turns its mount, in the mount's own frame, (3, 3)."""
    place = _place_of_work(brief, goal, handle=False)
    if view.turn_deg is None or place is None:
        return np.eye(3)
    mount = brief.summary.mounts[view.mount]
    frame = _frame(mount)
    way = frame.T @ (np.array(place.position_m) - np.array(mount.position_m))
    way /= max(float(np.linalg.norm(way)), 1e-9)
    lean = _matrix((math.degrees(math.atan2(-way[1], way[2])), math.degrees(math.asin(np.clip(way[0], -1, 1))), 0.0))
    # the rules lean a body that reaches themselves; one that pulls would grow into what it is to hook
    tilt_deg = view.aslant_deg or (_BESIDE_DEG if view.kind == "pull" else 0.0)
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
    """Return the rotation of a `Placement`: about x, then the new y, then the new z."""
    a, b, c = np.deg2rad(angles_deg)
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    about_z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return np.asarray(about_x @ about_y @ about_z)


def _angles_deg(turn: Matrix) -> Vec3:
    """Return the rotation of a `Placement` that a matrix is."""
    flat = math.hypot(turn[0, 0], turn[0, 1])
    b = math.atan2(float(turn[0, 2]), flat)
    if flat < _FLAT:  # a quarter turn about y: turns about x and z are one, and nothing but rounding tells them apart
        a, c = 0.0, math.atan2(float(turn[1, 0]), float(turn[1, 1]))
    else:
        a = math.atan2(-float(turn[1, 2]), float(turn[2, 2]))
        c = math.atan2(-float(turn[0, 1]), float(turn[0, 0]))
    x, y, z = (round(math.degrees(angle), 3) + 0.0 for angle in (a, b, c))
    return x, y, z
