"""Write results.md from results.jsonl: does a trial without learning tell which designs fail when they are trained?

    python -m benchmarks.trial.report

The page also says how well a trial with a short training tells it.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from benchmarks.learning.suite import Half
from benchmarks.rows import read_rows
from benchmarks.trial.run import RESULTS, SHORT_STEPS, STEPS, Row, kept, taken_over
from benchmarks.trial.scenes import designs_of_teams, trained_by_teams

from aidsr.core.artifacts import SUCCESSFUL_SHARE
from aidsr.core.config import PROMISING_SHARE
from aidsr.core.rates import Rate
from aidsr.tasks import load_task

_WANTED = 40
"""Smallest desired number of compared scenes."""
_ORIGINS = {
    "scenes of `benchmarks.learning`; the limit was chosen by their curves": ("",),
    "four roles": ("four-roles", "four-roles-before"),
    "four roles, made after all choices but the limit": ("four-roles-control", "four-roles-laws"),
}
"""Groups of scenes by the arm of `benchmarks.teams` that made them, "" for none."""


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=Path, default=RESULTS)
    rows = read_rows(parser.parse_args().rows, Row)
    page = page_of(rows, trained_success(rows)) + "\n" + short_page(rows, succeeding())
    RESULTS.with_suffix(".md").write_text(page, encoding="utf-8")


def trained_success(rows: Sequence[Row]) -> dict[str, tuple[float, float]]:
    """Return success and progress of trainings by scene: own rows, and those taken over from other benchmarks."""
    found = {name: (row.curve[-1].success, row.curve[-1].progress) for name, row in taken_over().items()}
    teams = trained_by_teams(STEPS)
    for name, tried in kept(rows, "trial").items():
        if (there := teams.get(tried.scene_sha256)) is not None:
            found[name] = (there.success_share, there.progress)
    return {**found, **{name: (row.success, row.progress) for name, row in kept(rows, "training").items()}}


def page_of(rows: Sequence[Row], trained: Mapping[str, tuple[float, float]]) -> str:
    """Return the page as Markdown.

    Args:
        rows: Rows of both trials.
        trained: Success and progress of trainings, by scene.
    """
    before, now = kept(rows, "earlier"), kept(rows, "trial")
    names = sorted(trained.keys() & before.keys() & now.keys())
    lines = [
        "# What a trial tells of a training",
        "",
        f"Made by `python -m benchmarks.trial.run` and `python -m benchmarks.trial.report`. Training: protocol `best`, "
        f"{STEPS:,} control steps, one seed, success in 20 development episodes, of designs of "
        f"`benchmarks.teams` (four-roles/...) in 100 held-out ones. A scene fails where it wins less "
        f"than {SUCCESSFUL_SHARE:.0%}. {len(names)} scenes, at least {_WANTED} wanted; * of the half by which the rule "
        "was made.",
        "",
        "| | " + " | ".join(f"{title}: earlier trial | present trial" for title in _HALVES) + " |",
        "|---|" + "---|" * 2 * len(_HALVES),
    ]
    halves = [[name for name in names if half in (None, now[name].half)] for half in _HALVES.values()]
    for title, told in _FIGURES.items():
        cells = [told(half, trials, trained) for half in halves for trials in (before, now)]
        lines.append(f"| {title} | " + " | ".join(cells) + " |")
    lines += [
        "",
        "| scene | by | trained: success (progress) | earlier trial | present trial: searches; script | processor s |",
        "|---|---|---|---|---|---|",
        *(_line(before[name], now[name], *trained[name]) for name in names),
    ]
    return "\n".join(lines) + "\n"


def short_page(rows: Sequence[Row], succeeds: Mapping[str, bool]) -> str:
    """Return the page's section on short trainings as Markdown.

    Args:
        rows: Rows of the trial and of short trainings.
        succeeds: Whether each scene's whole training ends in a success, by scene; others are left out.
    """
    tried = kept(rows, "trial")
    short = {name: row for name, row in kept(rows, "short").items() if name in succeeds}
    back = {name: row.sent_back and not _solved(tried.get(name)) for name, row in short.items()}
    lines = [
        f"## With `--task-training {SHORT_STEPS}`",
        "",
        f"A scene goes back where a policy wins less than {PROMISING_SHARE:.0%} of 20 development episodes after "
        f"{SHORT_STEPS:,} control steps, or wins in a way that is not valid, and neither most motions of the present "
        "trial nor a script won. It succeeds when trained where at least half of its episodes are won after the whole "
        "training; a design of `benchmarks.teams` has to be valid as well, and some of these had 300,000 steps.",
        "",
        "| | " + " | ".join(_ORIGINS) + " |",
        "|---|" + "---|" * len(_ORIGINS),
    ]
    for title, wins in (("fail when trained (wanted: 80 % or more)", False), ("succeed (wanted: 10 % or less)", True)):
        of = [[name for name in short if origin == _origin(name) and succeeds[name] == wins] for origin in _ORIGINS]
        cells = [_rate([back[name] for name in some]) for some in of]
        lines.append(f"| sent back of those that {title} | {' | '.join(cells)} |")
    lines += [
        "",
        "| scene | whole training | a motion or script of the trial wins | short training: success, valid | |",
        "|---|---|---|---|---|",
    ]
    for name, row in sorted(short.items()):
        solved = ("yes" if _solved(tried[name]) else "no") if name in tried else ""
        valid = "valid" if row.details["valid"] == (1.0,) else "not valid"
        lines.append(
            f"| {name} | {'succeeds' if succeeds[name] else 'fails'} | {solved} | {row.success:.0%}, {valid} | "
            f"{'sent back' if back[name] else 'passed'} |"
        )
    return "\n".join(lines) + "\n"


def succeeding() -> dict[str, bool]:
    """Return whether the whole training of each scene ends in a success, by name of the scene."""
    teams = trained_by_teams()
    found = {name: row.curve[-1].success >= SUCCESSFUL_SHARE for name, row in taken_over().items()}
    for scene in designs_of_teams():
        found[scene.name] = teams[scene.load().fingerprint].successful
    return found


def _origin(scene: str) -> str:
    arm = scene.partition("/")[0] if "/" in scene else ""
    return next(title for title, arms in _ORIGINS.items() if arm in arms)


def _solved(row: Row | None) -> bool:
    """Return whether most motions of a trial succeeded, or a script did; False if there was no trial."""
    if row is None:
        return False
    searches = len(row.details["searches"])
    won = row.details["succeeded"]
    return 2 * sum(won[:searches]) > searches or any(won[searches:])


def sent_back(row: Row) -> bool:
    """Return whether a trial sends a scene back, by the task's present decisive stage."""
    if row.kind == "earlier":
        return row.sent_back
    limit = load_task(row.task).decisive_stage()[0] - 1e-6
    won = row.details["succeeded"]
    searches = [
        progress >= limit or success
        for progress, success in zip(row.details["searches"], won[: len(row.details["searches"])], strict=True)
    ]
    script = any(progress >= limit for progress in row.details["script"]) or any(won[len(searches) :])
    return not (script or 2 * sum(searches) > len(searches))


def ranking(trials: Sequence[float], trained: Sequence[float]) -> float:
    """Return Spearman's rank correlation with averaged ranks for ties; nan if all values of one sequence are equal.

    Source: Spearman 1904, "The proof and measurement of association between two things".
    """
    if len(set(trials)) < 2 or len(set(trained)) < 2:
        return float("nan")
    return float(np.corrcoef(_ranks(trials), _ranks(trained))[0, 1])


def _ranks(values: Sequence[float]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    array = np.asarray(values)
    return np.array([(array < value).sum() + (array == value).sum() / 2 for value in array], dtype=np.float64)


def _share(
    half: Sequence[str], trials: Mapping[str, Row], trained: Mapping[str, tuple[float, float]], won: bool
) -> str:
    """Return the share of sent-back scenes among those that succeed (or fail) when trained."""
    of = [name for name in half if (trained[name][0] >= SUCCESSFUL_SHARE) == won]
    return _rate([sent_back(trials[name]) for name in of])


def _rate(backs: Sequence[bool]) -> str:
    if not backs:
        return "none"
    rate = Rate(sum(backs), len(backs))
    return f"{rate.share:.0%} of {rate.of} ({rate.interval.low:.0%} to {rate.interval.high:.0%})"


def _rank(half: Sequence[str], trials: Mapping[str, Row], trained: Mapping[str, tuple[float, float]]) -> str:
    found = ranking([trials[name].progress for name in half], [trained[name][0] for name in half])
    return "not known" if np.isnan(found) else f"{found:.2f} ({len(half)})"


_HALVES: dict[str, Half | None] = {"decide": "decide", "aside": "aside", "all": None}
_FIGURES = {
    "sent back of those that fail when trained (wanted: 80 % or more)": lambda *about: _share(*about, won=False),
    "sent back of those that succeed (wanted: 10 % or less)": lambda *about: _share(*about, won=True),
    "rank correlation of progress with trained success (scenes)": _rank,
}


def _line(before: Row, now: Row, success: float, progress: float) -> str:
    searches = ", ".join(f"{value:.2f}" for value in now.details["searches"])
    script = "; " + ", ".join(f"{value:.2f}" for value in now.details["script"]) if now.details["script"] else ""
    verdicts = ["sent back" if sent_back(row) else "passed" for row in (before, now)]
    return (
        f"| {now.scene}{'*' * (now.half == 'decide')} | {now.author} | {success:.0%} ({progress:.2f}) | "
        f"{verdicts[0]}, {before.progress:.2f} | {verdicts[1]}, {searches}{script} | {before.processor_s:.0f}, "
        f"{now.processor_s:.0f} |"
    )


if __name__ == "__main__":
    main()
