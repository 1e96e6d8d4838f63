"""Facts about a goal in its environment that need no trial: what is judged, mounts, distances, and faults of these."""

from __future__ import annotations

import math

import numpy as np

from aidsr.core.artifacts import Artifact, Brief, EnvironmentSummary, MountSummary, Vec3
from aidsr.core.suggestions import closest_name
from aidsr.sim.environment_summary import summarize_environment
from aidsr.tasks import GoalTask
from aidsr.tasks.goals.bring import Bring
from aidsr.tasks.goals.environment_index import EnvironmentIndex
from aidsr.tasks.goals.goal import Goal
from aidsr.tasks.goals.stages import Stages
from aidsr.tasks.goals.turn import Turn
from aidsr.tasks.goals.unattended import (
    INSIDE_M,
    MOVED_M,
    SETTLE_S,
    refuse,
    remarks,
    run_unattended,
)
from aidsr.teams.fitting.views import place_of_work
from aidsr.teams.rules.sizing import LENGTH_RANGE_M

_DRIFT = 0.1
"""Share of the required motion above which a target that moves by itself is reported. Our choice."""
_OUT_OF_REACH = 10.0
"""Distance of the place of work from a fixed mount, in lengths of the longest built-in body, from which nothing is
tried. Our choice: millimetres taken for metres are a thousand times too long, and no real job is refused."""
_SIMILAR = 0.75
"""Similarity from which the name of a site counts as a misspelt "mount". Our choice: one or two wrong letters."""


class EnvironmentFacts(Artifact):
    """Facts about an environment without a goal."""

    mounts: tuple[str, ...]
    """Each mount in words: its position, its direction and what moves it."""
    bodies: tuple[str, ...]
    """Each named body in words: its position and whether it can move."""
    faults: tuple[str, ...]
    """Reasons why nothing can be tried, in sentences."""

    @property
    def lines(self) -> tuple[str, ...]:
        """All facts in words, without the faults."""
        return (*_mount_lines(self.mounts), *(f"Body: {body}" for body in self.bodies))


class GoalFacts(Artifact):
    """Facts about a goal in its environment."""

    judging: dict[str, str]
    """How success is judged, in the words that the team gets, by title."""
    mounts: tuple[str, ...]
    """Each mount in words: its position, what moves it, how far away the place of work is."""
    alone: tuple[str, ...]
    """Sentences about what the environment does without a robot, as far as a user should know it."""
    drifts: tuple[str, ...]
    """Targets that move by themselves by a relevant share of the required motion, in words."""
    faults: tuple[str, ...] = ()
    """Reasons why nothing is tried, in sentences: a misspelt mount, a place of work far out of reach."""

    @property
    def fact_lines(self) -> tuple[str, ...]:
        """The facts in words, without the faults."""
        said = [f"{title}: {words}" for title, words in self.judging.items()]
        said += _mount_lines(self.mounts)
        said += [f"Without a robot: {remark}" for remark in self.alone] or [
            f"Without a robot: no target overlaps anything by more than {1000 * INSIDE_M:g} mm and a fifth of the "
            f"thinner part, or moves by more than {1000 * MOVED_M:g} mm in {SETTLE_S:g} s, and no joint that is to "
            "move is stopped on its way."
        ]
        return tuple(said)


def goal_facts(task: GoalTask) -> GoalFacts:
    """Return the facts about a goal that has been read and resolved in its environment."""
    brief = brief_of(task)
    return GoalFacts(
        judging=brief.judging,
        mounts=tuple(_mount_in_words(mount, place_of_work(brief, task.goal)) for mount in brief.summary.mounts),
        alone=remarks(task.unattended),
        drifts=_drifts(task),
        faults=(*_misspelt_mount(brief.summary), *_out_of_reach(brief, task.goal)),
    )


def environment_facts(environment: str) -> EnvironmentFacts:
    """Return the facts about an environment for which there is no goal yet.

    Args:
        environment: MJCF of the environment, without a robot.

    Raises:
        MjcfError: The environment cannot be loaded, or no robot can be placed in it.
        UserError: Its simulation diverges by itself.
        IsolationError: Reading it exceeded its limits of time or memory.
    """
    summary = summarize_environment(environment)
    refuse(run_unattended(environment, (), (), ((),))[0])
    return EnvironmentFacts(
        mounts=tuple(_mount_in_words(mount, None) for mount in summary.mounts),
        bodies=tuple(
            f"{body.name} at ({_numbers(body.position_m)}) m, "
            + (
                f"moves ({'; '.join(body.joints) or 'with the body that carries it'})"
                if body.joints or body.movable
                else "cannot move"
            )
            for body in summary.bodies
            if body.name not in ("", "world")
        ),
        faults=_misspelt_mount(summary),
    )


def brief_of(task: GoalTask) -> Brief:
    """Return the job of a goal as a team gets it, with the objective of its kind."""
    return Brief(
        objective=task.objective,
        environment=task.environment,
        summary=summarize_environment(task.environment),
        base=task.base,
        needs_contact=task.needs_contact,
        judging=task.judging(),
    )


def _mount_lines(mounts: tuple[str, ...]) -> list[str]:
    return [f"Mount: {mount}" for mount in mounts] or ['Mount: none; robots start at the origin, "world"']


def _mount_in_words(mount: MountSummary, place: Vec3 | None) -> str:
    words = f"{mount.name} at ({_numbers(mount.position_m)}) m, pointing along ({_numbers(mount.z_axis)})"
    if mount.moved_by:
        words += f", moved by {', '.join(mount.moved_by)}"
    if place is not None:
        way = np.array(place) - np.array(mount.position_m)
        far = float(np.linalg.norm(way))
        aside = math.degrees(math.acos(float(np.clip(way @ np.array(mount.z_axis) / max(far, 1e-9), -1.0, 1.0))))
        words += f"; the place of work is {far:.3g} m away, {aside:.0f} deg off this direction"
    return words


def _misspelt_mount(summary: EnvironmentSummary) -> tuple[str, ...]:
    """Return why an environment has no mount, if one was probably meant; empty otherwise."""
    if summary.mounts:
        return ()
    found = 'no site is named "mount"'
    bodies = {body.name: 'write <site name="mount"/> into this body' for body in summary.bodies}
    geoms = {geom.name: 'write <site name="mount" pos="…"/> in its place' for b in summary.bodies for geom in b.geoms}
    for kind, cures in (("body", bodies), ("geom", geoms)):
        for name, cure in cures.items():
            if name == "mount" or name.startswith("mount_"):
                return (f'{found}: "{name}" is a {kind}, and a robot attaches to a site; {cure}.',)
    sites = {site.name.lower(): site.name for site in summary.sites}
    near = sites.get(closest_name("mount", sites, cutoff=_SIMILAR), "")
    return (f'{found}; did you mean "{near}"?',) if near else ()


def _out_of_reach(brief: Brief, goal: Goal) -> tuple[str, ...]:
    """Return which places of work are far out of reach; empty for a robot that travels or whose mount moves."""
    mounts = brief.summary.mounts
    if goal.robot_travels or any(mount.moved_by for mount in mounts):
        return ()
    start = "the mount" if len(mounts) == 1 else "the nearest mount" if mounts else "the origin, where robots start"
    points = np.array([mount.position_m for mount in mounts] or [(0.0, 0.0, 0.0)])
    environment = EnvironmentIndex(brief.environment, brief.summary)
    longest_m = LENGTH_RANGE_M[1]
    for stage in goal.stages if isinstance(goal, Stages) else (goal,):
        far = []
        if (place := place_of_work(brief, stage)) is not None:
            name = next(iter((*stage.bodies, *stage.points)), "the place of work")
            far.append((name, np.linalg.norm(points - np.array(place), axis=1)))
        if isinstance(stage, Bring):
            middle = np.array(stage.region.start_m(environment))[None]
            far.append((stage.region.words, stage.region.outside_m(points[None], middle)[0]))
        for name, way_m in far:
            if way_m.min() > _OUT_OF_REACH * longest_m:
                return (
                    f"{name} is {way_m.min():.3g} m from {start}, and the longest built-in body is {longest_m:g} m: "
                    "are these millimetres? Lengths are in metres.",
                )
    return ()


def _drifts(task: GoalTask) -> tuple[str, ...]:
    """Return in words which targets move by themselves by more than `_DRIFT` of the required motion."""
    goal, found = task.goal, []
    for stage in goal.stages if isinstance(goal, Stages) else (goal,):
        ways = dict(stage.ways)
        for drift in task.unattended[0].drifts:
            share = drift.way_m / ways[drift.body] if drift.body in ways else 0.0
            if isinstance(stage, Turn) and stage.target == drift.body:
                share = abs(drift.turned_deg / stage.by_deg)
            if share > _DRIFT:
                found.append(f"{drift.text}, {100 * share:.0f} % of what is asked")
    return tuple(dict.fromkeys(found))


def _numbers(values: tuple[float, ...]) -> str:
    return ", ".join(f"{value:.3g}" for value in values)
