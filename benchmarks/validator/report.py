"""Measure the validator on the corpus: which faults it finds and misses, and which robots it blames wrongly.

python -m benchmarks.validator.report --split tuning
"""

from __future__ import annotations

import argparse
import hashlib
import json
import platform
import sys
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mujoco
from benchmarks.validator.corpus.keeping import Corpus, codes_in, load_or_make
from benchmarks.validator.corpus.plans import PLANS
from benchmarks.validator.corpus.specimen import Specimen, Split
from benchmarks.validator.oracle import BUILDING_SEVERITIES, SEVERITIES, measure_of
from benchmarks.validator.oracle.loop import Bench
from benchmarks.validator.tables import markdown

import aidsr
from aidsr.core.artifacts import Fault, ValidationReport
from aidsr.validation import validate
from aidsr.validation.registry import require_rule

_HERE = Path(__file__).parent
ONLY_WARNED = "faults that are only warned of"
WARNED = ("tendon_skips_segments", "tendon_slack", "thin_wall", "cable_shared", "overlap_hidden", "only_opens")
"""Codes whose faults are only reported as warnings."""


@dataclass(frozen=True)
class Verdict:
    """One robot and the validator's report."""

    specimen: Specimen
    report: ValidationReport

    @property
    def found(self) -> bool:
        """Whether the robot's fault was reported, as an error unless its rule only warns."""
        faults = self.report.faults if self.specimen.code in WARNED else self.report.errors
        return self.specimen.code in {fault.code for fault in faults}

    @property
    def kind(self) -> str:
        """Kind of the robot's fault, or the writer of a good robot."""
        if self.specimen.grade == "good":
            return self.specimen.style
        return ONLY_WARNED if self.specimen.code in WARNED else require_rule(self.specimen.code).stage.title

    @property
    def others(self) -> list[Fault]:
        """Errors with other codes than that of the robot's fault."""
        return [fault for fault in self.report.errors if fault.code != self.specimen.code]


@dataclass
class RuleScore:
    """Results of one fault code.

    Attributes:
        bad, found: Number of robots with the fault, and of those in which it was reported.
        instead: Reports for the robots in which the fault was missed.
        missed: Robots in which the fault was missed.
        near, near_blamed: Number of near misses (at most half of the limit), and of those blamed for the fault.
        band, band_blamed: Number of robots between half and twice the limit, and of those blamed for the fault.
        good_blamed: Names of the good robots that were blamed for the fault.
        beside: Number of robots with another fault in which this one was reported too, and the oracle confirms it.
        beside_false: Names of robots with another fault in which this one was reported, and the oracle denies it.
    """

    bad: int = 0
    found: int = 0
    instead: Counter[str] = field(default_factory=Counter)
    missed: list[Specimen] = field(default_factory=list)
    near: int = 0
    near_blamed: int = 0
    band: int = 0
    band_blamed: int = 0
    good_blamed: list[str] = field(default_factory=list)
    beside: int = 0
    beside_false: Counter[str] = field(default_factory=Counter)

    @property
    def recall(self) -> float:
        """Share of the robots with the fault in which it was reported."""
        return self.found / self.bad if self.bad else float("nan")

    @property
    def precision(self) -> float:
        """Share of the reports that are true; robots in the band count neither as true nor as false."""
        false = self.near_blamed + len(self.good_blamed) + self.beside_false.total()
        true = self.found + self.beside
        return true / (true + false) if true + false else float("nan")


def judge_corpus(specimens: Sequence[Specimen], kept: Path, threads: int = 2) -> list[Verdict]:
    """Validate every robot; each call has its own worker process.

    Args:
        specimens: The robots.
        kept: Folder in which reports are kept, so that a stopped run can be continued. After a change of the validator,
            all robots are validated again.
        threads: Number of robots that are validated at the same time.

    Raises:
        TimeoutError: A robot that loads has a load error, so its worker must have been stopped.
    """
    folder = kept / f"reports-{_fingerprint()}"
    folder.mkdir(parents=True, exist_ok=True)

    def judge(specimen: Specimen) -> Verdict:
        asked = json.dumps([specimen.mjcf, dict(specimen.arguments)], sort_keys=True)
        file = folder / f"{hashlib.sha256(asked.encode()).hexdigest()[:24]}.json"
        if not file.exists():
            report = validate(specimen.mjcf, **specimen.arguments)
            if specimen.loads and any(fault.code == "load_error" for fault in report.faults):
                raise TimeoutError(f"{specimen.name} was not judged in time; run this again when the machine is free")
            file.with_suffix(".part").write_text(report.model_dump_json(), "utf-8")
            file.with_suffix(".part").replace(file)
        return Verdict(specimen, ValidationReport.model_validate_json(file.read_text("utf-8")))

    with ThreadPoolExecutor(threads) as pool:
        return list(pool.map(judge, specimens))


def _fingerprint() -> str:
    """Return a hash of everything that determines the validator's reports: its sources and MuJoCo's version."""
    package = Path(aidsr.__file__).parent
    folders = ("core", "sandbox", "mjcf", "sim", "validation")
    files = (path for folder in folders for path in sorted((package / folder).rglob("*")))
    sources = [path for path in files if path.suffix in (".py", ".toml")]
    text = "".join(source.read_text("utf-8") for source in sources) + mujoco.__version__
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def score(verdicts: Sequence[Verdict]) -> dict[str, RuleScore]:
    """Return the results of every code in the corpus and in the reports."""
    scores = {code: RuleScore() for code in codes_in(v.specimen for v in verdicts)}
    for verdict in verdicts:
        specimen = verdict.specimen
        if specimen.grade == "good":
            for code in {fault.code for fault in verdict.report.errors}:
                scores.setdefault(code, RuleScore()).good_blamed.append(specimen.name)
            for fault in verdict.report.warnings:
                if fault.code in specimen.symptoms and specimen.symptoms[fault.code] <= 0.5:
                    scores.setdefault(fault.code, RuleScore()).good_blamed.append(specimen.name)
            continue
        own = scores[specimen.code]
        if specimen.grade == "bad":
            own.bad += 1
            own.found += verdict.found
            if not verdict.found:
                own.instead[_summary(verdict.report)] += 1
                own.missed.append(specimen)
        elif specimen.grade == "band":
            own.band += 1
            own.band_blamed += verdict.found
        else:
            own.near += 1
            own.near_blamed += verdict.found
        _judge_others(scores, verdict)
    return scores


def _judge_others(scores: dict[str, RuleScore], verdict: Verdict) -> None:
    """Let the oracle check every other fault reported in a robot that loads; all its checks share one set of tests."""
    others, specimen = {fault.code for fault in verdict.others}, verdict.specimen
    bench = Bench(specimen.mjcf) if others and specimen.loads else None
    for code in others:
        other = scores.setdefault(code, RuleScore())
        # one mistake in a document can break other elements that refer to it; the oracle cannot check that
        there = bench is None or (code in SEVERITIES | BUILDING_SEVERITIES and measure_of(code)(bench) >= 0.5)
        if there:
            other.beside += 1
        else:
            other.beside_false[specimen.name] += 1


def _summary(report: ValidationReport) -> str:
    errors = sorted({fault.code for fault in report.errors})
    warnings = sorted({f"({fault.code})" for fault in report.warnings if fault.layer != "realizability"})
    return ", ".join([*errors, *warnings]) or "nothing"


def summarize(corpus: Corpus, verdicts: Sequence[Verdict], scores: dict[str, RuleScore]) -> dict[str, Any]:
    """Return all figures as plain values."""
    good = [verdict for verdict in verdicts if verdict.specimen.grade == "good"]
    blamed = [verdict for verdict in good if verdict.report.errors]
    warned = [v for v in good if any(f.layer != "realizability" for f in v.report.warnings)]
    bad, found = (sum(getattr(s, name) for s in scores.values()) for name in ("bad", "found"))
    return {
        "good": len(good),
        "families": dict(Counter(verdict.specimen.family for verdict in good)),
        "writers": dict(Counter(verdict.specimen.style for verdict in good)),
        "good_with_errors": {v.specimen.name: _summary(v.report) for v in blamed},
        "good_with_warnings": {v.specimen.name: _summary(v.report) for v in warned},
        "false_alarm_share": len(blamed) / max(1, len(good)),
        "kinds": _by_kind([verdict for verdict in verdicts if verdict.specimen.grade == "bad"]),
        "good_kinds": _by_kind(good),
        "bad": bad,
        "found": found,
        "recall": found / max(1, bad),
        "rules": {
            code: {
                "bad": s.bad,
                "found": s.found,
                "recall": s.recall,
                "precision": s.precision,
                "instead": dict(s.instead),
                "missed": [{"robot": m.name, "severity": m.severity, "change": m.change} for m in s.missed],
                "near_misses": s.near,
                "near_misses_blamed": s.near_blamed,
                "band": s.band,
                "band_blamed": s.band_blamed,
                "good_blamed": s.good_blamed,
                "also_there": s.beside,
                "also_said_and_not_there": dict(s.beside_false),
            }
            for code, s in scores.items()
        },
        "put_aside": corpus.put_aside,
        "versions": {**verdicts[0].report.versions, "python": platform.python_version()},
    }


def _by_kind(verdicts: Sequence[Verdict]) -> dict[str, dict[str, int]]:
    """Return, by kind, the number of robots, of those with an error, and of those whose own fault was reported."""
    kinds: dict[str, dict[str, int]] = {}
    for verdict in verdicts:
        kind = kinds.setdefault(verdict.kind, {"robots": 0, "refused": 0, "right_code": 0})
        kind["robots"] += 1
        kind["refused"] += bool(verdict.report.errors)
        kind["right_code"] += verdict.found
    return kinds


def main(arguments: Sequence[str] | None = None) -> None:
    """Make or read the corpus, validate it, write `results.md` and `results.json`."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--split", action="append", choices=list(PLANS), help="default: tuning and held out")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--kept", type=Path, default=Path("build/validator"), help="where made corpora are kept")
    parser.add_argument(
        "--out",
        type=Path,
        default=_HERE,
        help="folder of results.md and results.json, with the splits in their names where some are named",
    )
    parser.add_argument("--code", help="only robots with this fault, and nothing is written")
    options = parser.parse_args(arguments)
    mujoco.set_mju_user_warning(lambda _message: None)
    figures: dict[str, Any] = {}
    splits: list[Split] = options.split or ["tuning", "held out"]
    for split in splits:
        corpus = load_or_make(split, options.kept, options.processes, lambda text: _say(text))
        chosen = [s for s in corpus.specimens if options.code in (None, s.code or "good")]
        verdicts = judge_corpus(chosen, options.kept, options.processes)
        scores = score(verdicts)
        figures[split] = summarize(corpus, verdicts, scores)
        _say_misses(verdicts)
    text = markdown(figures)
    if options.code:
        _say(text)
        return
    named = "" if options.split is None else "".join(f" --split '{split}'" for split in splits)
    command = f"python -m benchmarks.validator.report{named}" if named else "make corpus-report"
    stem = "-".join(["results", *(split.replace(" ", "-") for split in options.split or [])])
    text = text.replace("COMMAND", command).replace("`results.json`", f"`{stem}.json`")
    options.out.joinpath(f"{stem}.md").write_text(text, "utf-8")
    options.out.joinpath(f"{stem}.json").write_text(json.dumps(figures, indent=1, default=str) + "\n", "utf-8")
    _say(f"written to {options.out / stem}.md")


def _say_misses(verdicts: Sequence[Verdict]) -> None:
    for verdict in verdicts:
        specimen = verdict.specimen
        wrong = specimen.grade == "bad" and not verdict.found
        wrong |= specimen.grade == "near miss" and verdict.found
        wrong |= specimen.grade == "good" and bool(verdict.report.errors)
        if wrong:
            severity = "" if specimen.severity is None else f" {specimen.severity:.3g} x the limit;"
            _say(f"{specimen.name} ({specimen.grade};{severity} {specimen.change}): {_summary(verdict.report)}")


def _say(text: str) -> None:
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


if __name__ == "__main__":
    main()
