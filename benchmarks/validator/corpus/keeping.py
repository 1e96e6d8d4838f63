"""The whole corpus, made by several processes and kept in files, so that a stopped run can be continued."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import mujoco
from benchmarks.validator.corpus.faults import DOCUMENT, INJECTIONS
from benchmarks.validator.corpus.making import Made, make_bad, make_good, make_mistake
from benchmarks.validator.corpus.plans import PLANS, Plan
from benchmarks.validator.corpus.specimen import Specimen, Split
from benchmarks.validator.oracle import BUILDING_SEVERITIES


@dataclass
class Corpus:
    """The robots of the corpus, and the number of rejected attempts.

    Attributes:
        specimens: The robots.
        put_aside: Number of attempts that did not give the intended robot, by reason: the oracle disagreed, or MuJoCo
            refused the document.
    """

    specimens: list[Specimen] = field(default_factory=list)
    put_aside: dict[str, int] = field(default_factory=dict)

    def add(self, made: list[Specimen], put_aside: dict[str, int]) -> None:
        """Add the robots that a worker made, and its rejected attempts."""
        self.specimens += made
        for reason, count in put_aside.items():
            self.put_aside[reason] = self.put_aside.get(reason, 0) + count


def _quiet() -> None:
    """Discard MuJoCo's warnings in a worker, so that no MUJOCO_LOG.TXT is written."""
    mujoco.set_mju_user_warning(lambda _message: None)


@dataclass(frozen=True)
class _Job:
    """Robots that one worker makes. They are kept in a file, so that a stopped run can be continued.

    Attributes:
        label: The robots in words.
        file: File in which the robots are kept.
        function: Function that makes the robots.
        arguments: Arguments of that function.
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
    """Return the corpus of a split; robots made before by the same sources of corpus and oracle are read from files."""
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
    for number, injection in enumerate(DOCUMENT):
        corpus.add(*make_mistake(number, plan.bad_of(injection, DOCUMENT), split, good))
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
            f"{injection.code}, {grade}, wanted {len(batch)}",
            kept / f"{injection.code}-{number}-{grade.replace(' ', '-')}-{batch.start}.json",
            make_bad,
            (number, grade, batch, split, small, plan.patience),
        )
        for number, injection in enumerate(INJECTIONS)
        for grade in injection.sizes
        if grade in plan.graded
        for batch in plan.batches(injection, grade)
    ]


def _fingerprint() -> str:
    """Return a hash of everything that determines the corpus: sources of corpus and oracle, and MuJoCo's version."""
    here = Path(__file__).parents[1]
    sources = sorted([*(here / "corpus").rglob("*.py"), *(here / "oracle").rglob("*.py")])
    text = "".join(source.read_text("utf-8") for source in sources) + mujoco.__version__
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def codes_in(specimens: Iterable[Specimen]) -> list[str]:
    """Return the codes of the bad robots, with those of buildability last."""
    found = dict.fromkeys(specimen.code for specimen in specimens if specimen.code)
    return sorted(found, key=lambda code: code in BUILDING_SEVERITIES)
