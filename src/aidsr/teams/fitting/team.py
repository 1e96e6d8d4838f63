"""The four roles for a user's own goal.

Goal and geometry determine which bodies are tried; the results of the probe determine which of them are proposed.
"""

from __future__ import annotations

import threading
import time
import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice, zip_longest

import numpy as np

from aidsr.core.artifacts import Brief, Concept, Placement, Robot
from aidsr.core.errors import IsolationError, MjcfError, NoBetterDesignError
from aidsr.core.roles import BodyTried, Feedback, Team
from aidsr.sim.assembly import assemble
from aidsr.sim.measure import measure
from aidsr.tasks.goals import AnyGoal, Goal, GoalTask
from aidsr.teams.fitting.judge import INSTEAD, REFUSED, UNTRIED, FittingJudge, task_of
from aidsr.teams.fitting.trial import Fit, Round, fit, is_in_the_way, overlaps, spare_tension
from aidsr.teams.fitting.views import (
    View,
    as_placed,
    as_the_rules_read,
    as_viewed,
    candidates,
    detour,
    own_views,
    place_of_work,
    tilted,
    turns_of,
    with_view,
    without_view,
)
from aidsr.teams.rules.apply_feedback import scaled
from aidsr.teams.rules.coder import RuleCoder
from aidsr.teams.rules.designer import RuleDesigner
from aidsr.teams.rules.families import Families, Family, load_families
from aidsr.teams.rules.families.family import P
from aidsr.teams.rules.integrator import RuleIntegrator
from aidsr.teams.rules.job import read_job

ROUNDS = (Round(24, 16, 120_000), Round(5, 64, 400_000), Round(2, 192, 800_000))
"""Rounds of trials in which a body is chosen. Our choice: many bodies in many placements briefly, few of them
thoroughly; a minute on one core."""
_BROUGHT = Round(1, 48, 300_000)
"""Round for each placement of a robot that the user provided. Our choice: three seconds."""
_SIDE_BY_SIDE = 8
"""Number of bodies whose placements are tried alternately. Our choice: more than the families for a kind of job."""
_ROOM = 2
"""Number of placements without overlap below which a body is also tried pointing farther beside the place of work. Our
choice."""
_MORE = 2
"""Maximum number of bodies that are judged after the first one if none succeeds. Our choice: each takes one probe."""
_BELOW = 0.98
"""Tension to which a too strong body is reduced, as a share of what the validator allows. Our choice: room for
rounding."""
_RANK, _COUNT = "view_rank", "view_count"
"""Parameters of a concept with its rank among the tried bodies, and with the number of concepts proposed."""


@dataclass(frozen=True)
class Fitted:
    """A concept with the trial result of its body."""

    concept: Concept
    fit: Fit
    number: int = 0
    """Number of the body among those tried, from 1 on; 0 if bodies are not counted."""


def fitting_team(goal: AnyGoal, seed: int) -> Team:
    """Return the built-in team for a goal.

    Args:
        goal: Goal as read from its file, not yet resolved in an environment.
        seed: Seed; the same seed, brief and goal give the same designs.
    """
    return Team(FittingDesigner(goal, seed), FittingCoder(goal), FittingIntegrator(goal), FittingJudge(goal))


def _with_rank(concept: Concept, rank: int, count: int) -> Concept:
    """Return a concept with its rank among the tried bodies and the number of concepts in its parameters."""
    parameters = {**concept.parameters, _RANK: float(rank), _COUNT: float(count)}
    return concept.model_copy(update={"parameters": parameters})


def _is_same_body(one: Concept, other: Concept) -> bool:
    """Whether two concepts have the same body in the same placement; texts and ranks may differ."""
    without = {_RANK: 0.0, _COUNT: 0.0}
    return (one.name, {**one.parameters, **without}) == (other.name, {**other.parameters, **without})


def _within_tension(family: Family[P], parameters: P) -> P:
    """Return parameters with cable tensions that the validator allows; stiffness is reduced alike, so the bend stays.

    Otherwise a body could succeed in its trial and be approved with a warning, but be refused when parts are exported.
    """
    try:
        spare = spare_tension(family.write(parameters).mjcf)
    except (MjcfError, IsolationError):
        return parameters  # such a body is not tried either, and the validator reports what is wrong with it
    return parameters if spare >= 1.0 else scaled(parameters, ("tension", "stiffness"), _BELOW * spare)


@dataclass(frozen=True)
class FittingDesigner:
    """A Designer that tries bodies of all suitable families, and proposes those with the best trial results."""

    goal: AnyGoal
    seed: int
    families: Families = field(default_factory=load_families)
    listen: Callable[[BodyTried], None] = lambda _body: None
    """Function called with each body that was tried."""
    _ranked: dict[tuple[str, int], tuple[Concept, ...]] = field(default_factory=dict, compare=False, repr=False)
    """All concepts that were tried, those to propose first, by environment and number of concepts."""
    _ranking: threading.Lock = field(default_factory=threading.Lock, compare=False, repr=False)

    def with_listener(self, listen: Callable[[BodyTried], None]) -> FittingDesigner:
        """Return the same Designer, which calls `listen` with each body that was tried."""
        return replace(self, listen=listen)

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return the `count` best concepts; they are of different families if those families make decisive progress."""
        if brief.starting_robot:
            return self._own_robot(brief, count)
        ranked = self._rank(brief, count)
        return tuple(_with_rank(ranked[index % len(ranked)], index, count) for index in range(count))

    def _rank(self, brief: Brief, count: int, refused: Concept | None = None) -> tuple[Concept, ...]:
        """Return all bodies that were tried, those to propose first; a resumed run tries them again.

        Args:
            brief: The job.
            count: Number of designs.
            refused: A body that the Judge refused; it is reported as refused when it is tried again.
        """
        with self._ranking:
            key = brief.environment, count
            if key not in self._ranked:
                self._ranked[key] = self._tried_in_order(brief, count, refused)
            return self._ranked[key]

    def _tried_in_order(self, brief: Brief, count: int, refused: Concept | None) -> tuple[Concept, ...]:
        found = self.tried(brief, enough=count, refused=refused) or [self._untried(brief)]
        best = sorted(found, key=lambda each: each.fit.rank)
        task = task_of(self.goal, brief)
        firsts = {
            each.concept.family: each
            for each in reversed(best)
            if task.is_decisive(each.fit.progress) or each is best[0]
        }
        chosen = sorted(firsts.values(), key=lambda each: each.fit.rank)
        chosen += [each for each in best if each not in chosen]
        return tuple(self._with_reason(each, best) for each in chosen)

    def tried(
        self, brief: Brief, rounds: Sequence[Round] = (), *, enough: int = 1, refused: Concept | None = None
    ) -> list[Fitted]:
        """Return every body that was tried with its result; empty if each overlaps something.

        Args:
            brief: The job.
            rounds: Rounds of trials; the best bodies of a round go on to the next. `ROUNDS` if empty.
            enough: Number of successful bodies after which no more are tried.
            refused: A body that the Judge refused before; it is reported as refused.
        """
        task = task_of(self.goal, brief)
        first, *others = rounds or ROUNDS
        found: list[Fitted] = []

        def play(concept: Concept, how: Round, number: int) -> Fitted | None:
            began = time.monotonic()
            result = self._play(brief, task, concept, how)
            progress, won = (result.fit.progress, result.fit.success) if result else (None, False)
            took_s = time.monotonic() - began
            before = refused is not None and _is_same_body(concept, refused)
            motions = 0 if how is first else how.candidates
            body = BodyTried(concept.name, number, first.bodies, progress, won, round(took_s, 2), before, motions)
            self.listen(body)
            return replace(result, number=number) if result else None

        for number, concept in enumerate(islice(self._free(brief, task), first.bodies), start=1):
            result = play(concept, first, number)
            found += [result] if result else []
            if sum(each.fit.success for each in found) >= enough:
                return found
        for again in others:
            found.sort(key=lambda each: -each.fit.value)
            for index, each in enumerate(found[: again.bodies]):
                if sum(other.fit.success for other in found) >= enough:
                    return found
                if not each.fit.success:
                    found[index] = play(each.concept, again, each.number) or each
        return found

    def _free(self, brief: Brief, task: GoalTask) -> Iterator[Concept]:
        """Yield concepts in placements without overlap: for each body of a group the first, then the second ones."""
        rng = self._rng(brief)
        blocked = self._blocked(brief, task.goal)
        every = candidates(brief, task.goal, self.families)
        room = True
        while room and (some := list(islice(every, _SIDE_BY_SIDE))):
            room = False  # if no body of the group fits, no further one will
            placed = [
                self._placed(brief, task, detour(view) if view.mount in blocked else view, name, variant, rng)
                for view, name, variant in some
            ]
            for turn in zip_longest(*placed):
                for concept in filter(None, turn):
                    room = True
                    yield concept

    def _placed(
        self, brief: Brief, task: GoalTask, view: View, name: str, variant: str, rng: np.random.Generator
    ) -> Iterator[Concept]:
        """Yield the concepts of one body in all placements without overlap."""
        free = 0
        for turned in (*turns_of(view), *tilted(view)):
            if turned.tilt_deg and free >= _ROOM:
                return
            concept = self._concept(brief, task.goal, turned, name, variant, rng)
            if self._scene(brief, task, concept) is not None:
                free += 1
                yield concept

    def _blocked(self, brief: Brief, goal: Goal) -> set[int]:
        """Return the indices of the mounts with an obstacle on the way to the place of work."""
        place = place_of_work(brief, goal)
        if place is None:
            return set()
        carriers = {site.body for site in brief.summary.sites if site.name in goal.points} - {"world"}
        worked_on = tuple(sorted({*goal.bodies, *carriers} - {""}))
        return {
            index
            for index, mount in enumerate(brief.summary.mounts)
            if is_in_the_way(brief.environment, mount.position_m, place, worked_on)
        }

    def _untried(self, brief: Brief) -> Fitted:
        """Return the first body, for the case that none could be placed; the validator reports what it overlaps."""
        goal = task_of(self.goal, brief).goal
        view, name, variant = next(candidates(brief, goal, self.families))
        concept = self._concept(brief, goal, view, name, variant, self._rng(brief))
        return Fitted(concept, Fit(progress=0.0, success=False, reached="no body could be placed"))

    def _rng(self, brief: Brief) -> np.random.Generator:
        return np.random.default_rng([self.seed, zlib.crc32(brief.environment.encode())])

    def _own_robot(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return versions of the robot that the user provided, with the placement and scale of the best trial."""
        task = task_of(self.goal, brief)
        versions = RuleDesigner(self.seed).propose(brief, count)
        robot = FittingCoder(self.goal, self.families).write(brief, versions[0])
        try:
            extent = measure(robot)
        except (MjcfError, IsolationError):
            return versions  # the validator reports what is wrong with the robot
        views = list(own_views(brief, task.goal, extent.low_m, extent.high_m))
        tried = [self._play(brief, task, with_view(versions[0], view), _BROUGHT) for view in views]
        found = [each for each in tried if each is not None]
        best = max(found, key=lambda each: each.fit.value, default=None)
        view = View.of(best.concept) if best else views[0]
        words = (
            f"Tried in {len(found)} placements; scaled by {view.scale:g} it came to progress {best.fit.progress:.2f} "
            f"({best.fit.reached})."
            if best
            else f"In none of {len(views)} placements it was free of what surrounds it."
        )
        return tuple(
            with_view(each, view).model_copy(update={"rationale": f"{each.rationale} {words}"}) for each in versions
        )

    def _scene(self, brief: Brief, task: GoalTask, concept: Concept) -> tuple[str, Robot] | None:
        """Return the scene of a concept and its robot; None if it overlaps something or cannot be assembled."""
        robot = FittingCoder(self.goal, self.families).write(brief, concept)
        placement = FittingIntegrator(self.goal, self.families).place(brief, concept, robot)
        try:
            scene = assemble(robot, brief.environment, placement, task.sensors).mjcf
            return None if overlaps(scene) else (scene, robot)
        except (MjcfError, IsolationError):
            return None

    def _play(self, brief: Brief, task: GoalTask, concept: Concept, how: Round) -> Fitted | None:
        """Return a concept with the trial result of its body; None if it cannot be tried."""
        if (placed := self._scene(brief, task, concept)) is None:
            return None
        scene, robot = placed
        try:
            return Fitted(concept, fit(scene, task, robot.actuator_groups, how.candidates, 1, how.max_steps))
        except (MjcfError, IsolationError):
            return None

    def _concept(
        self, brief: Brief, goal: Goal, view: View, name: str, variant: str, rng: np.random.Generator
    ) -> Concept:
        job = read_job(as_the_rules_read(brief, goal, view))
        family = self.families[name]
        parameters = _within_tension(family, family.size(job, rng, variant))
        interpretation = f"{goal.success_text} Read from the goal and the geometry as a job to {view.kind}."
        return with_view(family.concept(parameters, job, interpretation), view)

    def _with_reason(self, chosen: Fitted, tried: Sequence[Fitted]) -> Concept:
        words = (
            f"The built-in rules tried {len(tried)} bodies without learning; this one came to progress "
            f"{chosen.fit.progress:.2f} ({chosen.fit.reached}), the best to {tried[0].fit.progress:.2f}."
        )
        return chosen.concept.model_copy(update={"rationale": f"{chosen.concept.rationale} {words}".strip()})

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        """Return the next best body if this one was refused or not tried, else the concept changed by the feedback.

        Raises:
            NoBetterDesignError: No other tried body is left, or enough of them were judged.
        """
        if REFUSED in feedback or UNTRIED in feedback:
            return self._next(brief, concept, feedback)
        goal, view = task_of(self.goal, brief).goal, View.of(concept)
        read = as_the_rules_read(brief, goal, view)
        revised = RuleDesigner(self.seed).revise(read, without_view(concept), robot, feedback)
        kept = {name: value for name, value in concept.parameters.items() if name in (_RANK, _COUNT)}
        return with_view(revised, view).model_copy(
            update={
                "interpretation": concept.interpretation,  # the rules derive it from words, which a goal does not have
                "parameters": {**revised.parameters, **view.parameters, **kept},
            }
        )

    def _next(self, brief: Brief, concept: Concept, feedback: str) -> Concept:
        """Return the body that ranks next for this design after one that the Judge refused."""
        rank, count = (int(concept.parameters.get(name, 0.0)) for name in (_RANK, _COUNT))
        problem = feedback.partition(": ")[2] or feedback
        ranked = self._rank(brief, count, concept) if count else ()
        if rank + count >= len(ranked) or rank // max(count, 1) >= _MORE:
            tried = rank // count + 1 if count else 1
            bodies = "1 body was" if tried == 1 else f"{tried} bodies were"
            raise NoBetterDesignError(f"{bodies} judged for this design, and no motion of any wins. {INSTEAD}")
        found = _with_rank(ranked[rank + count], rank + count, count)
        return found.model_copy(
            update={
                "rationale": f"{found.rationale} It takes the place of {concept.name}: {problem.partition('. ')[0]}."
            }
        )


@dataclass(frozen=True)
class FittingCoder:
    """The rules' Coder, which gets concepts without the parameters of their views."""

    goal: AnyGoal
    families: Families = field(default_factory=load_families)
    """Families whose robots it can write."""

    def write(self, brief: Brief, concept: Concept) -> Robot:
        """Return the robot of a concept."""
        return RuleCoder(self.families).write(brief, without_view(concept))

    def repair(self, brief: Brief, concept: Concept, robot: Robot, feedback: Feedback) -> Robot:
        """Return the robot with the reported faults edited out."""
        return RuleCoder(self.families).repair(brief, without_view(concept), robot, feedback)


@dataclass(frozen=True)
class FittingIntegrator:
    """The rules' Integrator, which gets a brief with the mount turned towards the place of work."""

    goal: AnyGoal
    families: Families = field(default_factory=load_families)
    """Families; their records define how their robots are rotated on a mount."""

    def place(self, brief: Brief, concept: Concept, robot: Robot) -> Placement:
        """Return the placement of a robot in the environment."""
        goal, view = task_of(self.goal, brief).goal, View.of(concept)
        read = as_the_rules_read(brief, goal, view)
        return as_placed(brief, goal, view, RuleIntegrator(self.families).place(read, without_view(concept), robot))

    def adjust(
        self, brief: Brief, concept: Concept, robot: Robot, placement: Placement, feedback: Feedback
    ) -> Placement:
        """Return the placement with overlaps and falls removed."""
        goal, view = task_of(self.goal, brief).goal, View.of(concept)
        read, seen = as_the_rules_read(brief, goal, view), as_viewed(brief, goal, view, placement)
        return as_placed(
            brief, goal, view, RuleIntegrator(self.families).adjust(read, without_view(concept), robot, seen, feedback)
        )
