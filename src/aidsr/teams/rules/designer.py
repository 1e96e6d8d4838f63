"""The Designer as rules: it chooses families that suit a job, and sizes their robots."""

from __future__ import annotations

import itertools
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from aidsr.core.artifacts import Brief, Concept, Robot
from aidsr.core.formatting import mm
from aidsr.teams.rules import user_robot
from aidsr.teams.rules.apply_feedback import apply_feedback, other_family, with_changes
from aidsr.teams.rules.families import Families, Parameters, load_families, preferred_family, variants_for
from aidsr.teams.rules.job import Job, read_job
from aidsr.teams.rules.job_kinds import JOB_KINDS

_ON_AXIS_M = 0.001


@dataclass(frozen=True)
class RuleDesigner:
    """A Designer that chooses families by the kind of job and sizes their robots by the environment.

    Attributes:
        seed: Seed; the same seed and brief give the same concepts.
        families: Families to choose from.
    """

    seed: int
    families: Families = field(default_factory=load_families)

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return `count` concepts of different families, or of different variants if there are too few families."""
        if brief.starting_robot:
            return user_robot.concepts(brief, count)
        job = read_job(brief)
        preferred = preferred_family(job.kind, brief.objective, self.families)
        interpretation = interpret(job, preferred)
        rng = np.random.default_rng([self.seed, zlib.crc32(brief.objective.encode())])
        ideas = _shuffled(variants_for(job.kind, self.families), rng, preferred[0] if preferred else None)
        concepts = []
        for name, variant in itertools.islice(ideas, count):
            family = self.families[name]
            concepts.append(family.concept(family.size(job, rng, variant), job, interpretation))
        return tuple(concepts)

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        """Return the concept changed as far as the rules understand the feedback; its rationale says how far."""
        del robot
        family = self.families.get(concept.family)
        if family is None:
            return user_robot.revise(concept, feedback)
        job = read_job(brief)
        interpretation = interpret(job, preferred_family(job.kind, brief.objective, self.families))
        suitable = variants_for(job.kind, self.families)
        if wanted := other_family(feedback, concept.family, suitable):
            rng = np.random.default_rng([self.seed, zlib.crc32(feedback.encode())])
            other = self.families[wanted]
            changed: Parameters = other.size(job, rng, suitable[wanted][0])
            understood = [f'"{wanted}" (a {wanted} instead of the {concept.family})']
            return with_changes(other.concept(changed, job, interpretation), concept, feedback, understood)
        parameters, understood = apply_feedback(family.read(concept), feedback)
        return with_changes(family.concept(parameters, job, interpretation), concept, feedback, understood)


def _shuffled(
    table: dict[str, tuple[str, ...]], rng: np.random.Generator, first: str | None
) -> Iterator[tuple[str, str]]:
    """Yield pairs of family and variant without end, one family after the other, with shuffled variants.

    Args:
        table: Variants of each family.
        rng: Random generator for the orders of families and variants.
        first: Family that comes before the others.
    """
    families = sorted((str(name) for name in rng.permutation(list(table))), key=lambda name: name != first)
    variants = {name: [str(variant) for variant in rng.permutation(list(table[name]))] for name in families}
    turn = 0
    while True:
        fresh = [name for name in families if turn < len(variants[name])]
        yield from ((name, variants[name][turn % len(variants[name])]) for name in fresh or families)
        turn += 1


def interpret(job: Job, preferred: tuple[str, str] | None) -> str:
    """Return sentences with what the job demands of a body, the reason for this reading, and the preferred family."""
    sentences = [f"{JOB_KINDS[job.kind].demand}: {job.because}."]
    if preferred:
        sentences.append(f"{preferred[0].capitalize()} first: {preferred[1]}.")
    if job.pull < 1.0:
        sentences.append(f"What is held breaks easily: cables pull at most {job.pull:.0%} of what they else would.")
    if job.target is not None:
        beside = f"{mm(job.target.beside_m)} off it" if job.target.beside_m > _ON_AXIS_M else "on it"
        sentences.append(
            f"{job.target.part} is {mm(job.target.along_m)} along the axis of {job.mount_name} and {beside}, "
            f"{mm(2 * job.target.half_width_m)} wide; its body weighs {1000 * job.target.mass_kg:.0f} g."
        )
    if job.approach_m > 0:
        sentences.append(f"The mount itself can come {mm(job.approach_m)} closer.")
    sentences.append(f"The base is {job.base}.")
    return " ".join(sentences)
