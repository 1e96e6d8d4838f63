"""The Designer as rules: which families suit a job, and how large they have to be."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from aidsr.core.artifacts import Brief, Concept, Robot
from aidsr.teams.rules import apply_feedback as wishes
from aidsr.teams.rules import user_robot as own_robot
from aidsr.teams.rules.families import FAMILIES, Parameters
from aidsr.teams.rules.job import Job, read_job
from aidsr.teams.rules.job_kinds import Kind
from aidsr.teams.rules.number_text import mm

__all__ = ["IDEAS", "RuleDesigner"]

Idea = tuple[str, str]
"""A family and one of its variants."""

IDEAS: dict[Kind, dict[str, tuple[str, ...]]] = {
    "reach": {"arm": ("two sections", "three sections", "four cables"), "tentacle": ("space", "two stages")},
    "brush": {"tentacle": ("sweep",), "arm": ("two sections", "three sections", "four cables")},
    "conform": {"arm": ("three sections", "three sections, four cables")},
    "grasp": {
        "gripper": ("three fingers", "four fingers", "five fingers", "facing pairs", "pincer"),
        "tentacle": ("wrap",),
    },
    "crawl": {
        "crawler": ("four legs", "six legs", "four legs, two cables"),
        "worm": ("inchworm", "wave", "long wave"),
        "ring": ("four sectors", "five sectors", "six sectors"),
    },
    "insert": {"arm": ("two sections", "three sections"), "tentacle": ("space", "two stages")},
    "squeeze": {
        "worm": ("wave", "inchworm", "long wave"),
        "ring": ("small, four sectors", "small, five sectors"),
    },
    "pull": {"arm": ("hook",), "tentacle": ("curl",), "gripper": ("pincer", "facing pairs", "three fingers")},
}
"""Families and variants that can do each kind of job. Our choice: all were driven
open-loop on the benchmark's tasks."""

_DEMANDS: dict[Kind, str] = {
    "reach": "The functional part has to be brought to a place beside the mount and press there",
    "brush": "The functional part has to be led over a surface and press on it, neither too little nor too much",
    "conform": "Half the body has to lie along the surface, so it has to bend towards it and back again on the way",
    "grasp": "An object has to be enclosed from several sides and kept while the mount moves",
    "crawl": "The body has to carry and move itself on the ground, with the same friction in every direction",
    "insert": "A slender body has to go in lengthwise and give way where the way bends",
    "squeeze": "The body has to carry and move itself and stay narrow and low",
    "pull": "Something has to be hooked or held behind its handle, because friction alone would slip, and drawn back",
}


@dataclass(frozen=True)
class RuleDesigner:
    """Chooses families by the kind of job and sizes them by the environment.

    Attributes:
        seed: The same seed and brief give the same concepts.
    """

    seed: int

    def propose(self, brief: Brief, count: int) -> tuple[Concept, ...]:
        """Return `count` concepts of different families, or of different variants where families run out."""
        if brief.starting_robot:
            return own_robot.concepts(brief, count)
        job = read_job(brief)
        rng = np.random.default_rng([self.seed, zlib.crc32(brief.objective.encode())])
        ideas = _shuffled(IDEAS[job.kind], rng, job.first[0] if job.first else None)
        return tuple(self._concept(job, next(ideas), rng) for _ in range(count))

    def _concept(self, job: Job, idea: Idea, rng: np.random.Generator) -> Concept:
        label, variant = idea
        return describe(label, FAMILIES[label].sample(job, rng, variant), job)

    def revise(self, brief: Brief, concept: Concept, robot: Robot | None, feedback: str) -> Concept:
        """Return the concept changed as far as the rules understand the feedback; its rationale says how far."""
        del robot
        family = FAMILIES.get(concept.family)
        if family is None:
            return own_robot.revised(concept, feedback)
        job = read_job(brief)
        wanted = wishes.other_family(feedback, concept.family, IDEAS[job.kind])
        if wanted:
            rng = np.random.default_rng([self.seed, zlib.crc32(feedback.encode())])
            changed: Parameters = FAMILIES[wanted].sample(job, rng, IDEAS[job.kind][wanted][0])
            return _answered(describe(wanted, changed, job), [f"a {wanted} instead of the {concept.family}"])
        parameters, understood = wishes.granted(family.read(concept), feedback)
        return _answered(describe(concept.family, parameters, job), understood)


_ON_AXIS_M = 0.001


def describe(label: str, parameters: Parameters, job: Job) -> Concept:
    """Return the concept that a family's parameters stand for, in words made from its numbers."""
    family = FAMILIES[label]
    texts, robot = family.describe(parameters, job), family.write(parameters)
    return Concept(
        name=texts.name,
        interpretation=_interpretation(job),
        morphology=texts.morphology,
        actuation=texts.actuation,
        functional_part=robot.functional_part,
        family=label,
        parameters=parameters.model_dump(),
        actuator_groups=robot.actuator_groups,
        rationale=f"{texts.rationale} Chosen by the built-in rules, not by a language model.",
    )


def _shuffled(table: dict[str, tuple[str, ...]], rng: np.random.Generator, first: str | None) -> Iterator[Idea]:
    """Yield all ideas for ever, one family after the other, each in an order of its own.

    Args:
        table: Variants of each family.
        rng: Decides on the orders.
        first: Family that comes before the others.
    """
    families = sorted((str(name) for name in rng.permutation(list(table))), key=lambda name: name != first)
    variants = {name: [str(variant) for variant in rng.permutation(list(table[name]))] for name in families}
    turn = 0
    while True:
        fresh = [name for name in families if turn < len(variants[name])]
        yield from ((name, variants[name][turn % len(variants[name])]) for name in fresh or families)
        turn += 1


def _interpretation(job: Job) -> str:
    """Say what the job demands of a body, and what made the rules think so."""
    sentences = [f"{_DEMANDS[job.kind]}: {job.because}."]
    if job.first:
        sentences.append(f"{job.first[0].capitalize()} first: {job.first[1]}.")
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


def _answered(concept: Concept, understood: list[str]) -> Concept:
    said = (
        f"Changed as asked: {', '.join(understood)}."
        if understood
        else "The built-in rules understood no wish in it and changed nothing."
    )
    return concept.model_copy(update={"rationale": f"{concept.rationale} {said}"})
