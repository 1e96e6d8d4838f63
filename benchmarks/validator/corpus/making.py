"""The corpus: good robots from writers, bad ones from good ones, each confirmed by the oracle.

A robot counts as good when the oracle finds no symptom above half its limit, as bad when its own symptom is at least
twice its limit, and as a near miss when it is at most half. What was meant to be one and is found to be another is put
aside and counted.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from benchmarks.validator.corpus.faults import DOCUMENT, INJECTIONS, Injection, UnsuitableError
from benchmarks.validator.corpus.specimen import Grade, Specimen, Split
from benchmarks.validator.corpus.writers import HELD_OUT_WRITERS
from benchmarks.validator.oracle import BUILDING_SEVERITIES, examine_good, severity_of

__all__ = ["Corpus", "Plan", "grade_of", "load_or_make", "make_bad", "make_good", "make_mistake"]

Made = tuple[list[Specimen], dict[str, int]]
"""Robots, and how many attempts were put aside by reason."""

_FIRST_SEED: dict[Split, int] = {"tuning": 1000, "held out": 2000}


@dataclass(frozen=True)
class Plan:
    """How many robots of each kind are made.

    Attributes:
        good: By writer.
        graded: Of each injection.
        largest: Degrees of freedom of a robot that is made bad; larger ones only cost time.
        patience: Attempts for each robot wanted.
    """

    good: dict[str, int]
    graded: dict[Grade, int]
    largest: int = 30
    patience: int = 8


PLANS: dict[Split, Plan] = {
    "tuning": Plan(
        {"hinges": 5, "balls": 4, "tapered": 4, "discs": 4, "ground": 6, "loops": 3, "own": 4},
        {"bad": 3, "near miss": 1, "band": 1},
    ),
    "held out": Plan(
        {"hinges": 3, "balls": 3, "tapered": 3, "discs": 3, "ground": 4, "loops": 3, "own": 3, "hands": 4, "frames": 4},
        {"bad": 3, "near miss": 1, "band": 1},
    ),
}


@dataclass
class Corpus:
    """Robots and how many were put aside.

    Attributes:
        specimens: The robots.
        put_aside: Attempts that did not come out as meant, by kind: the oracle disagreed, or MuJoCo refused.
    """

    specimens: list[Specimen] = field(default_factory=list)
    put_aside: dict[str, int] = field(default_factory=dict)

    def add(self, made: list[Specimen], put_aside: dict[str, int]) -> None:
        """Take over what a worker made."""
        self.specimens += made
        for reason, count in put_aside.items():
            self.put_aside[reason] = self.put_aside.get(reason, 0) + count


def grade_of(severity: float) -> Grade:
    """Return what a measured symptom makes of a robot."""
    if severity >= 2:
        return "bad"
    return "near miss" if severity <= 0.5 else "band"


def make_good(writer: str, split: Split, index: int, patience: int) -> Made:
    """Write robots until the oracle finds nothing wrong with one."""
    put_aside: dict[str, int] = {}
    for attempt in range(patience):
        rng = np.random.default_rng([_FIRST_SEED[split], _number(writer), index, attempt])
        written = HELD_OUT_WRITERS[writer](rng)
        found, symptoms = examine_good(written.mjcf)
        if found:
            reason = f"good, {writer}: {next(iter(found))}"
            put_aside[reason] = put_aside.get(reason, 0) + 1
            continue
        name = f"{writer}-{index}"
        made = Specimen(name, split, written.family, writer, written.mjcf, symptoms=symptoms)
        return [made], put_aside
    return [], put_aside


def make_bad(number: int, grade: Grade, count: int, split: Split, bases: Sequence[Specimen], patience: int) -> Made:
    """Make robots bad by one injection until enough came out as meant."""
    injection, made, put_aside = INJECTIONS[number], list[Specimen](), dict[str, int]()
    rng = np.random.default_rng([_FIRST_SEED[split], 1, number, _number(grade)])
    for _ in range(count * patience):
        if len(made) == count:
            break
        base = bases[int(rng.integers(len(bases)))]
        try:
            mjcf, words = injection.change(base.mjcf, rng, injection.draw_size(grade, rng))
            severity = severity_of(injection.code, mjcf)
        except UnsuitableError:
            continue
        except ValueError as error:  # MuJoCo refuses the changed robot
            reason = f"{injection.code}, {grade}: refused, {str(error)[:60]}"
            put_aside[reason] = put_aside.get(reason, 0) + 1
            continue
        if grade_of(severity) != grade or not _is_as_named(injection, mjcf):
            reason = f"{injection.code}, {grade}: came out as {grade_of(severity)}"
            put_aside[reason] = put_aside.get(reason, 0) + 1
            continue
        made.append(_changed(base, injection, number, len(made), grade, mjcf, words, severity))
    return made, put_aside


def _is_as_named(injection: Injection, mjcf: str) -> bool:
    """Whether a robot that drops lands, where that is what tells two codes apart."""
    from benchmarks.validator.oracle.passive import lands

    if injection.code == "base_not_attached":
        return lands(mjcf)
    return injection.code != "free_fall" or not lands(mjcf)


def make_mistake(number: int, count: int, split: Split, bases: Sequence[Specimen]) -> Made:
    """Make documents with one mistake; all must be refused by MuJoCo, or be forbidden here."""
    injection, made, put_aside = DOCUMENT[number], list[Specimen](), dict[str, int]()
    rng = np.random.default_rng([_FIRST_SEED[split], 2, number])
    for base in (bases[int(k)] for k in rng.permutation(len(bases))):
        if len(made) == count:
            break
        try:
            mjcf, words = injection.change(base.mjcf, rng, 1.0)
        except UnsuitableError:
            continue
        if injection.code != "forbidden" and _loads(mjcf):
            reason = f"{injection.code}: MuJoCo accepts it"
            put_aside[reason] = put_aside.get(reason, 0) + 1
            continue
        made.append(_changed(base, injection, number, len(made), "bad", mjcf, words, None, loads=False))
    return made, put_aside


def _changed(
    base: Specimen,
    injection: Injection,
    number: int,
    index: int,
    grade: Grade,
    mjcf: str,
    words: str,
    severity: float | None,
    *,
    loads: bool = True,
) -> Specimen:
    return Specimen(
        name=f"{injection.code}-{number}-{grade.replace(' ', '-')}-{index} of {base.name}",
        split=base.split,
        family=base.family,
        style=base.style,
        mjcf=mjcf,
        grade=grade,
        code=injection.code,
        change=words,
        arguments=dict(injection.arguments),
        severity=severity,
        loads=loads,
    )


def _loads(mjcf: str) -> bool:
    try:
        mujoco.MjSpec.from_string(mjcf).compile()
    except ValueError:
        return False
    return True


def _number(text: str) -> int:
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "little")


def _quiet() -> None:
    """Workers keep MuJoCo's warnings to themselves instead of writing MUJOCO_LOG.TXT."""
    mujoco.set_mju_user_warning(lambda _message: None)


@dataclass(frozen=True)
class _Job:
    """Robots that one worker makes; what it made is kept, so that a stopped run goes on where it was.

    Attributes:
        label: What is made, in words.
        file: Where it is kept.
        function: Makes it.
        arguments: Of that function.
    """

    label: str
    file: Path
    function: Callable[..., Made]
    arguments: tuple[Any, ...]

    def run(self) -> Made:
        if not self.file.exists():
            specimens, put_aside = self.function(*self.arguments)
            text = json.dumps([[asdict(specimen) for specimen in specimens], put_aside])
            self.file.with_suffix(".part").write_text(text, "utf-8")
            self.file.with_suffix(".part").replace(self.file)
        specimens, put_aside = json.loads(self.file.read_text("utf-8"))
        return [Specimen(**each) for each in specimens], put_aside


def load_or_make(split: Split, folder: Path, processes: int, say: Callable[[str], None]) -> Corpus:
    """Return the corpus of a split; what was made before by the same writers, faults and oracle is read from files."""
    plan, corpus = PLANS[split], Corpus()
    kept = folder / f"corpus-{split.replace(' ', '-')}-{_fingerprint()}"
    kept.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(processes, initializer=_quiet) as pool:
        for job, made in _all(pool, _good_jobs(plan, split, kept)):
            corpus.add(*made)
            say(f"{job.label}: {len(made[0])}")
        good = list(corpus.specimens)
        for job, made in _all(pool, _bad_jobs(plan, split, good, kept)):
            corpus.add(*made)
            say(f"{job.label}: {len(made[0])}")
    each = max(1, plan.graded["bad"] // 3)
    for number in range(len(DOCUMENT)):
        corpus.add(*make_mistake(number, each, split, good))
    return corpus


def _all(pool: ProcessPoolExecutor, jobs: Sequence[_Job]) -> Iterator[tuple[_Job, Made]]:
    return zip(jobs, pool.map(_Job.run, jobs), strict=True)


def _good_jobs(plan: Plan, split: Split, kept: Path) -> list[_Job]:
    return [
        _Job(f"good, {writer} {i}", kept / f"good-{writer}-{i}.json", make_good, (writer, split, i, plan.patience))
        for writer, count in plan.good.items()
        for i in range(count)
    ]


def _bad_jobs(plan: Plan, split: Split, good: Sequence[Specimen], kept: Path) -> list[_Job]:
    small = [base for base in good if mujoco.MjModel.from_xml_string(base.mjcf).nv <= plan.largest]
    return [
        _Job(
            f"{injection.code}, {grade}, wanted {plan.graded[grade]}",
            kept / f"{injection.code}-{number}-{grade.replace(' ', '-')}.json",
            make_bad,
            (number, grade, plan.graded[grade], split, small, plan.patience),
        )
        for number, injection in enumerate(INJECTIONS)
        for grade in injection.sizes
        if grade in plan.graded
    ]


def _fingerprint() -> str:
    """Of everything that decides what the corpus is."""
    here = Path(__file__).parents[1]
    sources = sorted([*(here / "corpus").rglob("*.py"), *(here / "oracle").rglob("*.py")])
    text = "".join(source.read_text("utf-8") for source in sources) + mujoco.__version__
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def codes_in(specimens: Iterable[Specimen]) -> list[str]:
    """Return the codes that bad robots of the corpus have, those of buildability last."""
    found = dict.fromkeys(specimen.code for specimen in specimens if specimen.code)
    return sorted(found, key=lambda code: code in BUILDING_SEVERITIES)
