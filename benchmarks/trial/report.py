"""Write results.md from results.jsonl: does a trial without learning tell which designs fail when they are trained?

    python -m benchmarks.trial.report

The page also says whether a short training as part of the trial would tell more; this is read from the curves of the
same trainings.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from benchmarks.learning.hopeless import kept as ended_trainings
from benchmarks.learning.suite import Half
from benchmarks.rows import read_rows
from benchmarks.trial.run import RESULTS, STEPS, Row, kept, taken_over
from benchmarks.trial.scenes import trained_by_teams

from aidsr.core.artifacts import SUCCESSFUL_SHARE
from aidsr.core.rates import Rate
from aidsr.tasks import load_task

_WANTED = 40
"""Smallest desired number of compared scenes."""
TRAINING = 30_000
"""Control steps of the short training, `--task-training`."""


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=Path, default=RESULTS)
    rows = read_rows(parser.parse_args().rows, Row)
    page = page_of(rows, trained_success(rows)) + "\n" + training_page(short_trainings(rows))
    RESULTS.with_suffix(".md").write_text(page, encoding="utf-8")


def trained_success(rows: Sequence[Row]) -> dict[str, tuple[float, float]]:
    """Return success and progress of trainings by scene: own rows, and those taken over from other benchmarks."""
    found = {name: (row.curve[-1].success, row.curve[-1].progress) for name, row in taken_over().items()}
    teams = trained_by_teams()
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


@dataclass(frozen=True)
class ShortTraining:
    """What a short training would have shown about a scene."""

    won: bool
    """Whether an episode without noise succeeded within `TRAINING` steps."""
    solved: bool
    """Whether most motions of the trial succeeded, or a script did; False if there was no trial."""
    success: float
    """Share of episodes won after the whole training."""
    in_view: bool
    """Whether `TRAINING` was chosen with this scene in view."""

    @property
    def sent_back(self) -> bool:
        """Whether the scene is sent back to its designers."""
        return not (self.won or self.solved)


def short_trainings(rows: Sequence[Row]) -> list[ShortTraining]:
    """Return the short trainings, read from trainings of the suite and of designs of `benchmarks.teams`."""
    tried = kept(rows, "trial")
    by_scene = {row.scene_sha256: row for row in tried.values()}
    found = []
    for name, row in taken_over().items():
        first = next((point.steps for point in row.curve if point.success > 0), None)
        won, solved = _within(first), name in tried and _solved(tried[name])
        found.append(ShortTraining(won, solved, row.curve[-1].success, in_view=True))
    for each in ended_trainings():
        trial = by_scene.get(each.scene_sha256)
        solved = trial is not None and _solved(trial)
        found.append(ShortTraining(_within(each.first_won), solved, each.success_share, each.in_view))
    return found


def _within(first_won: int | None) -> bool:
    return first_won is not None and first_won <= TRAINING


def _solved(row: Row) -> bool:
    searches = len(row.details["searches"])
    won = row.details["succeeded"]
    return 2 * sum(won[:searches]) > searches or any(won[searches:])


def training_page(trainings: Sequence[ShortTraining]) -> str:
    """Return the page's section on short trainings as Markdown."""
    halves = [[one for one in trainings if one.in_view == in_view] for in_view in (True, False)]
    lines = [
        f"## With `--task-training {TRAINING}`",
        "",
        f"Read off the curves of {len(trainings)} trainings of {STEPS:,} steps: a scene goes back where no episode "
        f"without noise was won in {TRAINING:,} steps, and neither most motions of the present trial nor a script won, "
        "where there was a trial.",
        "",
        "| | in view when the steps were chosen | trained afterwards |",
        "|---|---|---|",
    ]
    for title, wins in (("fail when trained (wanted: 80 % or more)", False), ("succeed (wanted: 10 % or less)", True)):
        of = [[one for one in half if (one.success >= SUCCESSFUL_SHARE) == wins] for half in halves]
        cells = [_rate([one.sent_back for one in some]) for some in of]
        lines.append(f"| sent back of those that {title} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


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
