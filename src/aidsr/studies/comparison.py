"""Comparison of two studies: which differences are significant, and what else differs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from aidsr.core.artifacts import Artifact
from aidsr.studies.outcomes import DesignRow, evaluated_by, read_outcomes
from aidsr.studies.report import other_episodes_in_words
from aidsr.studies.study import Study, as_study
from aidsr.studies.tables import Difference, differences

_FIRST, _SECOND = "first", "second"


class StudyComparison(Artifact):
    """Differences between the first arms of two studies."""

    differences: tuple[Difference, ...]
    """One for each quantity; empty if no design is finished in both studies."""
    notes: tuple[str, ...] = ()
    """What to know about the differences, in sentences: arms that are left out, plans that differ."""


def compare(one: str | Path | Study, other: str | Path | Study) -> StudyComparison:
    """Test whether the difference between two studies is statistically significant.

    Designs are paired by task, run and number; the first arm of each study is compared. A difference is that of the
    second study from the first.

        compared = aidsr.compare("studies/before", "studies/after")
        for each in compared.differences:
            print(each.what, *each.in_words, each.p_value, each.real)

    Args:
        one: The first study, or its folder.
        other: The second study, or its folder.

    Raises:
        TypeError: An argument has the wrong type.
        UserError: A folder holds no study.
    """
    studies = {_FIRST: as_study(one), _SECOND: as_study(other)}
    rows = {name: _first_arm(study, name) for name, study in studies.items()}
    found = differences([row for each in rows.values() for row in each], _FIRST)
    if not found:
        nothing = "The studies have no finished design in common: no design with the same task, run and number is "
        return StudyComparison(differences=(), notes=(f"{nothing}finished in both.",))
    notes = [note for name, study in studies.items() for note in _notes(study, rows[name])]
    unlike = _unlike(studies[_FIRST], studies[_SECOND], rows[_FIRST], rows[_SECOND])
    return StudyComparison(differences=found, notes=(*notes, *([unlike] if unlike else [])))


def _first_arm(study: Study, name: str) -> list[DesignRow]:
    """Return the rows of the first arm of a study, with another name of the arm."""
    arm = study.plan.arms[0].name
    return [row.model_copy(update={"arm": name}) for row in read_outcomes(study) if row.arm == arm]


def _notes(study: Study, rows: list[DesignRow]) -> Iterator[str]:
    """Yield a sentence on the arms of a study that are left out, and one on unlike evaluations."""
    used, *unused = (arm.name for arm in study.plan.arms)
    if unused:
        yield (
            f"{study.path.name}: only the first arm is compared: {used}, not {', '.join(unused)}. The report of the "
            "study compares its arms."
        )
    if other := other_episodes_in_words(study.plan, rows):
        yield f"{study.path.name}: {other}"


def _unlike(one: Study, other: Study, rows: Sequence[DesignRow], others: Sequence[DesignRow]) -> str:
    """Return a sentence with other differences of two studies that could explain one of the results; empty if none.

    Args:
        one: The first study.
        other: The second study.
        rows: The rows of the first study that are compared.
        others: The rows of the second study that are compared.
    """
    unlike = [
        f"{name} {getattr(one.plan, name)} and {getattr(other.plan, name)}"
        for name in ("benchmark_version", "level", "seeds", "steps", "protocol", "perturbed", "versions")
        if getattr(one.plan, name) != getattr(other.plan, name)
    ]
    software = [sorted(evaluated_by(each)) for each in (rows, others)]
    if all(software) and software[0] != software[1]:
        unlike.append("policies evaluated by " + " and ".join(" or ".join(each) for each in software))
    return f"The studies also differ in: {'; '.join(unlike)}" if unlike else ""
