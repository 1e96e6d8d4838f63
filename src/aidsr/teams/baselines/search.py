"""The search baseline: CMA-ES over the numbers of a built-in family, with what the probe finds as its objective.

The shape (family, variant, how many limbs and segments) is that of the rules' concept of the same seed; every length,
thickness, tension, stiffness and density is searched. So the difference to the built-in team is what search alone adds.

Its budget is a number of robots. Each is validated and probed within a number of physics steps, so that a search takes
minutes and ends the same however fast the machine is. Every generation is told, and one that was told before is not
measured again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from aidsr.core.artifacts import Brief, Concept, Robot
from aidsr.core.errors import IsolationError, MjcfError, UserError
from aidsr.core.roles import Team
from aidsr.learn.openloop import probe
from aidsr.sim.assembly import assemble
from aidsr.tasks import Level, load_task
from aidsr.teams.baselines.generations import Generation
from aidsr.teams.rules.coder import RuleCoder
from aidsr.teams.rules.designer import RuleDesigner
from aidsr.teams.rules.families import Parameters, load_families
from aidsr.teams.rules.integrator import RuleIntegrator
from aidsr.teams.rules.job import read_job
from aidsr.teams.rules.judge import RuleJudge
from aidsr.validation import validate

__all__ = ["Searched", "searchable", "team"]

_GENERATION = 8
_SPREAD = 0.15
"""Standard deviation of the first generation, of the logarithm of each number. Our choice: 15 %."""
_CANDIDATES = 32
"""Motions the probe tries with one robot. Our choice: a quarter of its own; this only compares."""
_MAX_STEPS = 90_000
"""Physics steps of the probe of one robot. Our choice: the whole of those motions for most bodies, seconds for each."""
_MOST = 2.0
"""All progress and success: nothing is worth more, and the search ends."""
_UNSTABLE = -1.0
"""Worth of a robot that the validator refuses; each fault takes off a hundredth more, so that there is a way back."""

Vector = NDArray[np.float64]
Worth = Callable[[Brief, Concept], float]


def team(
    seed: int,
    level: Level,
    robots: int,
    *,
    known: Sequence[Generation] = (),
    listen: Callable[[Generation], None] = lambda _: None,
) -> Team:
    """Return the rules' team with a Designer who searches.

    Args:
        seed: Of the concepts, as for the rules, and of the search.
        level: Level of the task.
        robots: Tried for each concept, in generations of eight, beside the rules' own.
        known: Generations of the same search that were told before it was interrupted.
        listen: Told of every generation when it is measured.
    """
    before = {(each.concept, each.generation): each.worths for each in known}
    searcher = Searched(seed, partial(worth_of, level=level), robots, before, listen)
    return Team(searcher, RuleCoder(), RuleIntegrator(), RuleJudge())


@dataclass(frozen=True)
class Searched:
    """A Designer who tries many numbers for each concept of the rules.

    Attributes:
        seed: The same seed and brief give the same concepts.
        worth: What a concept is worth, larger is better.
        robots: Tried for each concept, a multiple of eight; fewer once one is worth the most there is.
        known: Worths that were measured before, by concept and generation.
        listen: Told of every generation that is measured.
    """

    seed: int
    worth: Worth
    robots: int
    known: Mapping[tuple[int, int], tuple[float, ...]] = field(default_factory=dict)
    listen: Callable[[Generation], None] = lambda _: None

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return the rules' concepts with the best numbers found for each."""
        if not brief.task:
            raise UserError("the search needs a benchmark task to measure robots by; name one of `aidsr tasks`")
        starts = RuleDesigner(self.seed).propose(brief, count)
        return tuple(self._best(brief, start, number) for number, start in enumerate(starts, start=1))

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        """Return the concept changed as the rules change it."""
        return RuleDesigner(self.seed).revise(brief, concept, robot, feedback)

    def _best(self, brief: Brief, start: Concept, number: int) -> Concept:
        from cma import CMAEvolutionStrategy

        family, job = load_families()[start.family], read_job(brief)
        space = _Space.around(family.read(start))
        rng = np.random.default_rng([self.seed, len(space.names)])
        options = {
            "popsize": _GENERATION,
            "bounds": [list(space.low), list(space.high)],
            "seed": np.nan,  # it draws from ours instead
            "randn": lambda *shape: rng.standard_normal(shape),
            "verbose": -9,
        }
        search = CMAEvolutionStrategy(np.zeros(len(space.names)), _SPREAD, options)
        (first,) = self._worths(brief, [start], number, 0)
        best, most = start, first
        tried = 0
        for generation in range(1, self.robots // _GENERATION + 1):
            if most >= _MOST:
                break
            points = search.ask()
            concepts = [family.concept(space.parameters(point), job, start.interpretation) for point in points]
            worths = self._worths(brief, concepts, number, generation)
            search.tell(points, [-worth for worth in worths])
            tried += len(points)
            top = int(np.argmax(worths))
            if worths[top] > most:
                best, most = concepts[top], worths[top]
        said = f"Numbers found by CMA-ES over {tried} robots: worth {most:.2f} to the probe, {first:.2f} at first."
        return best.model_copy(update={"rationale": f"{best.rationale} {said}"})

    def _worths(self, brief: Brief, concepts: Sequence[Concept], number: int, generation: int) -> tuple[float, ...]:
        """Return what the robots of a generation are worth, measured unless they were before."""
        known = self.known.get((number, generation))
        if known is not None:
            return known
        worths = tuple(self.worth(brief, concept) for concept in concepts)
        last = self.robots // _GENERATION
        self.listen(Generation(concept=number, generation=generation, of=last, worths=worths))
        return worths


@dataclass(frozen=True)
class _Space:
    """The numbers of a robot that are searched, each as the logarithm of its ratio to where the search began."""

    start: Parameters
    names: tuple[str, ...]
    values: Vector
    low: Vector = field(repr=False)
    high: Vector = field(repr=False)

    @classmethod
    def around(cls, start: Parameters) -> _Space:
        names = searchable(start)
        values = np.array([getattr(start, name) for name in names])
        limits = [_limits(start, name) for name in names]
        low, high = np.log(np.array(limits).T / values)
        return cls(start, names, values, np.minimum(low, 0.0), np.maximum(high, 0.0))

    def parameters(self, point: Vector) -> Parameters:
        """Return the robot at a point, its numbers as they are written in files."""
        found = self.values * np.exp(np.clip(point, self.low, self.high))
        numbers = {name: float(f"{value:.5g}") for name, value in zip(self.names, found, strict=True)}
        return type(self.start).model_validate({**self.start.model_dump(), **numbers})


def searchable(start: Parameters) -> tuple[str, ...]:
    """Return the fields of a robot's parameters that can be searched: every number with a unit that is not zero."""
    kinds = type(start).model_fields
    return tuple(name for name in kinds if isinstance(value := getattr(start, name), float) and value > 0)


def _limits(start: Parameters, name: str) -> tuple[float, float]:
    """Return the range of a field, at most a factor of two around where the search began."""
    value = getattr(start, name)
    rules = type(start).model_fields[name].metadata
    low = max([value / 2, *(rule.ge for rule in rules if hasattr(rule, "ge"))])
    high = min([value * 2, *(rule.le for rule in rules if hasattr(rule, "le"))])
    return low, high


def worth_of(brief: Brief, concept: Concept, *, level: Level) -> float:
    """Return how far a concept's robot gets on its task by open-loop motions: progress and success, 0 to 2."""
    task, robot = load_task(brief.task, level), RuleCoder().write(brief, concept)
    try:
        scene = assemble(robot, brief.environment, RuleIntegrator().place(brief, concept, robot), task.sensors)
        report = validate(scene.mjcf, needs_contact=brief.needs_contact)
        if not report.stable:
            return _UNSTABLE - 0.01 * len(report.errors)
        groups = robot.actuator_groups
        found = probe(
            scene.mjcf, task, groups=groups, candidates=_CANDIDATES, variations=1, max_steps=_MAX_STEPS, threads=1
        )
    except (MjcfError, IsolationError):
        return 2 * _UNSTABLE
    return found.progress + found.success_share
