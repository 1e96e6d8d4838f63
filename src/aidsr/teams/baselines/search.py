"""The search baseline: CMA-ES over the parameters of a built-in family, with the probe as its objective.

The structure (family, variant, number of limbs and segments) is that of the rules' concept of the same seed; every
length, thickness, tension, stiffness and density is searched. So the difference to the built-in team shows what search
alone adds.

The budget is a number of robots. Each is validated and probed within a number of physics steps, so that a search takes
minutes and its result does not depend on the speed of the machine. An interrupted search resumes after its last
complete generation.
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

_POPULATION = 8
"""Robots of a generation."""
INITIAL_STD = 0.15
"""Standard deviation of the logarithm of each parameter in the first generation. Our choice: 15 %."""
_CANDIDATES = 32
"""Number of motions that the probe tries with one robot. Our choice: a quarter of the probe's default, because the
results are only compared."""
_MAX_STEPS = 90_000
"""Maximum number of physics steps of the probe of one robot. Our choice: enough for all these motions of most bodies,
and seconds for each."""
_MAX_VALUE = 2.0
"""Value of full progress and success. No robot can have a larger value, so the search ends when it is reached."""
_UNSTABLE = -1.0
"""Value of a robot that the validator rejects; each fault subtracts another 0.01, so that fewer faults are better."""

Vector = NDArray[np.float64]
Objective = Callable[[Brief, Concept], float]


def team(
    seed: int,
    level: Level,
    robots: int,
    *,
    known: Sequence[Generation] = (),
    on_generation: Callable[[Generation], None] = lambda _: None,
) -> Team:
    """Return the rules' team with a Designer that searches.

    Args:
        seed: Seed of the concepts, as for the rules, and of the search.
        level: Level of the task.
        robots: Number of robots tried for each concept, in generations of eight, besides the rules' own.
        known: Generations of the same search before it was interrupted.
        on_generation: Function called with every generation when it has been measured.
    """
    before = {(each.concept, each.generation): each.values for each in known}
    designer = SearchDesigner(seed, partial(probe_value, level=level), robots, before, on_generation)
    return Team(designer, RuleCoder(), RuleIntegrator(), RuleJudge())


@dataclass(frozen=True)
class SearchDesigner:
    """A Designer that searches the parameters of each concept of the rules.

    Attributes:
        seed: Seed; the same seed and brief give the same concepts.
        objective: Function that returns the value of a concept; larger is better.
        robots: Number of robots tried for each concept, a multiple of eight; fewer are tried if one reaches the largest
            possible value.
        known: Values measured before, by concept and generation.
        on_generation: Function called with every generation when it has been measured.
    """

    seed: int
    objective: Objective
    robots: int
    known: Mapping[tuple[int, int], tuple[float, ...]] = field(default_factory=dict)
    on_generation: Callable[[Generation], None] = lambda _: None

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return the rules' concepts with the best parameters found for each."""
        if not brief.task:
            raise UserError("the search needs a benchmark task; name one of `aidsr tasks`")
        starts = RuleDesigner(self.seed).propose(brief, count)
        return tuple(self._best(brief, start, number) for number, start in enumerate(starts, start=1))

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        """Return the concept changed as the rules change it."""
        return RuleDesigner(self.seed).revise(brief, concept, robot, feedback)

    def _best(self, brief: Brief, start: Concept, number: int) -> Concept:
        from cma import CMAEvolutionStrategy

        family, job = load_families()[start.family], read_job(brief)
        space = Space.around(family.read(start))
        rng = np.random.default_rng([self.seed, len(space.names)])
        options = {
            "popsize": _POPULATION,
            "bounds": [list(space.low), list(space.high)],
            "seed": np.nan,  # `randn` draws from `rng` instead
            "randn": lambda *shape: rng.standard_normal(shape),
            "verbose": -9,
        }
        search = CMAEvolutionStrategy(np.zeros(len(space.names)), INITIAL_STD, options)
        (first_value,) = self._values(brief, [start], number, 0)
        best, best_value = start, first_value
        tried = 0
        for generation in range(1, self.robots // _POPULATION + 1):
            if best_value >= _MAX_VALUE:
                break
            points = search.ask()
            concepts = [family.concept(space.parameters(point), job, start.interpretation) for point in points]
            values = self._values(brief, concepts, number, generation)
            search.tell(points, [-value for value in values])
            tried += len(points)
            top = int(np.argmax(values))
            if values[top] > best_value:
                best, best_value = concepts[top], values[top]
        values_text = f"worth {best_value:.2f} to the probe, {first_value:.2f} at first"
        rationale = f"{best.rationale} Numbers found by CMA-ES over {tried} robots: {values_text}."
        return best.model_copy(update={"rationale": rationale})

    def _values(self, brief: Brief, concepts: Sequence[Concept], number: int, generation: int) -> tuple[float, ...]:
        """Return the values of a generation; they are measured unless they are in `known`."""
        known = self.known.get((number, generation))
        if known is not None:
            return known
        values = tuple(self.objective(brief, concept) for concept in concepts)
        last = self.robots // _POPULATION
        self.on_generation(Generation(concept=number, generation=generation, of=last, values=values))
        return values


@dataclass(frozen=True)
class Space:
    """The parameters that are searched, each as the logarithm of its ratio to its start value."""

    start: Parameters
    names: tuple[str, ...]
    values: Vector
    low: Vector = field(repr=False)
    high: Vector = field(repr=False)

    @classmethod
    def around(cls, start: Parameters) -> Space:
        """Return the space around the parameters of a robot."""
        names = searchable(start)
        values = np.array([getattr(start, name) for name in names])
        limits = [_limits(start, name) for name in names]
        low, high = np.log(np.array(limits).T / values)
        return cls(start, names, values, np.minimum(low, 0.0), np.maximum(high, 0.0))

    def parameters(self, point: Vector) -> Parameters:
        """Return the robot's parameters at a point, rounded as in files."""
        found = self.values * np.exp(np.clip(point, self.low, self.high))
        numbers = {name: float(f"{value:.5g}") for name, value in zip(self.names, found, strict=True)}
        return type(self.start).model_validate({**self.start.model_dump(), **numbers})


def searchable(start: Parameters) -> tuple[str, ...]:
    """Return the parameters that can be searched: every positive float."""
    kinds = type(start).model_fields
    return tuple(name for name in kinds if isinstance(value := getattr(start, name), float) and value > 0)


def _limits(start: Parameters, name: str) -> tuple[float, float]:
    """Return the range of a parameter, at most a factor of two around its start value."""
    value = getattr(start, name)
    rules = type(start).model_fields[name].metadata
    low = max([value / 2, *(rule.ge for rule in rules if hasattr(rule, "ge"))])
    high = min([value * 2, *(rule.le for rule in rules if hasattr(rule, "le"))])
    return low, high


def probe_value(brief: Brief, concept: Concept, *, level: Level) -> float:
    """Return progress plus success share of a concept's robot by open-loop motions, 0 to 2; negative if unstable."""
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
