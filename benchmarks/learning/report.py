"""Write results.md and its curves from results.jsonl.

python -m benchmarks.learning.report
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from math import inf
from pathlib import Path
from statistics import fmean, median_high

from benchmarks.learning.compare import EPISODES, RESULTS, WAYS, Point, Row, Way, recipe_now
from benchmarks.learning.probes import PROBES, VARIATIONS, Probe, probes_of
from benchmarks.learning.suite import Half
from benchmarks.rows import read_rows

from aidsr.core.artifacts import SUCCESSFUL_SHARE

_MOSTLY = 3
"""A scene counts as winnable if some motion wins at least this number of the probe's four variations."""
_COLOURS = {"sb3": "#888888", "paper": "#9a5b13", "best": "#1f5fa8"}


def main() -> None:
    """Write the page and the picture of the curves."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=Path, default=RESULTS)
    rows = read_rows(parser.parse_args().rows, Row)
    page = RESULTS.with_suffix(".md")
    page.write_text(page_of(rows, probes_of(PROBES)), encoding="utf-8")
    page.with_name("results-curves.svg").write_text(curves(rows), encoding="utf-8")


def reached(row: Row) -> Point | None:
    """Return the first point of a curve at which half of the episodes are won; None for never."""
    return next((point for point in row.curve if point.success >= SUCCESSFUL_SHARE), None)


def page_of(rows: Sequence[Row], probes: Mapping[str, Probe]) -> str:
    """Return the page as Markdown.

    Args:
        rows: Trainings; of several rows of the same training the last counts.
        probes: Probe of each scene.
    """
    lines = [
        "# What the protocols reach on the suite",
        "",
        "Made by `python -m benchmarks.learning.compare`, `benchmarks.learning.probes` and "
        "`benchmarks.learning.report`. `sb3` is PPO with the defaults of Stable-Baselines3. Budget "
        + ", ".join(sorted({f"{row.steps:,}" for row in rows}))
        + f" control steps a training, one thread; success in {EPISODES} development episodes that training never "
        "samples, without noise. Processor seconds, evaluations left out; a busy machine adds to them, not to "
        "steps. A point of the curve counts an episode "
        "without progress for 8 s as lost; the last one does not. Steps of `best` leave out those of the search before "
        "it, seconds do not. † An earlier recipe of the protocol; `compare` makes "
        f"these rows again. Probe: of {VARIATIONS} variations, those that one open-loop motion wins, and those that "
        "some motion wins.",
        "",
        "![success over processor seconds](results-curves.svg)",
    ]
    for half, title in (("decide", "Half to decide by"), ("aside", "Half set aside")):
        lines += ["", f"## {title}", "", *_half(rows, probes, half)]
    return "\n".join(lines) + "\n"


def _half(rows: Sequence[Row], probes: Mapping[str, Probe], half: Half) -> list[str]:
    mine = {key: row for key, row in _newest(rows).items() if row.half == half}
    both = sorted({key[:2] for key in mine if (*key[:2], "paper") in mine and (*key[:2], "best") in mine})
    titles = " | ".join(f"{way}: success (progress) | to 50 %" for way in WAYS)
    lines = [
        f"| scene | by | task | probe: one motion, some motion | seed | {titles} |",
        "|---" * (5 + 2 * len(WAYS)) + "|",
    ]
    for name, seed in both:
        row, probe = mine[name, seed, "paper"], probes.get(name)
        probed = f"{probe.one_motion}, {probe.some_motion}" if probe else "-"
        trained = [mine.get((name, seed, way)) for way in WAYS]
        cells = " | ".join(f"{_end(each)} | {_time(each)}" if each else "- | -" for each in trained)
        lines.append(f"| {name} | {row.author} | {row.task} | {probed} | {seed} | {cells} |")
    for way in WAYS:
        own = [mine[name, seed, way] for name, seed in both if (name, seed, way) in mine]
        lines += ["", f"{way}: {_summary(own)}"]
    return [*lines, "", _winnable([mine[name, seed, "best"] for name, seed in both], probes)]


def _newest(rows: Sequence[Row]) -> dict[tuple[str, int, Way], Row]:
    """Return the newest training of each scene, seed and protocol."""
    return {(row.scene, row.seed, row.protocol): row for row in rows}


def _winnable(best: Sequence[Row], probes: Mapping[str, Probe]) -> str:
    """Return, for the scenes that the probe mostly wins, how many trainings of `best` win half of the episodes."""
    asked = [row for row in best if row.scene in probes and probes[row.scene].some_motion >= _MOSTLY]
    failed = [row for row in asked if row.curve[-1].success < SUCCESSFUL_SHARE]
    told = f"; not {', '.join(sorted({row.scene for row in failed}))}" if failed else ""
    return (
        f"Where some motion wins for {_MOSTLY} of {VARIATIONS} variations or more, {len(asked) - len(failed)} of "
        f"{len(asked)} trainings of `best` end at 50 % or more{told}."
    )


def _end(row: Row) -> str:
    last, earlier = row.curve[-1], " †" * (row.recipe != recipe_now(row.protocol))
    return f"{last.success:.0%} ({last.progress:.2f}) after {last.processor_s:.0f} s{earlier}"


def _time(row: Row) -> str:
    found = reached(row)
    return "never" if found is None else f"{found.processor_s:.0f} s, {found.steps:,} steps"


def _summary(rows: Sequence[Row]) -> str:
    if not rows:
        return "no trainings."
    won = [row for row in rows if row.curve[-1].success >= SUCCESSFUL_SHARE]
    found = [reached(row) for row in rows]
    seconds = median_high(point.processor_s if point else inf for point in found)
    steps = median_high(point.steps if point else inf for point in found)
    told = "never" if seconds == inf else f"{seconds:.0f} s, {steps:,.0f} steps"
    categories = sorted({row.category for row in rows})
    shares = [
        f"{category} {sum(row.category == category for row in won)} of {sum(row.category == category for row in rows)}"
        for category in categories
    ]
    return (
        f"{len(won)} of {len(rows)} scenes end at 50 % or more ({', '.join(shares)}); mean success "
        f"{fmean(row.curve[-1].success for row in rows):.0%}; median to 50 %: {told}."
    )


def curves(rows: Sequence[Row]) -> str:
    """Return success over processor seconds as an SVG picture with one small panel per scene.

    Args:
        rows: Trainings; of several rows of the same training the last counts.
    """
    rows = list(_newest(rows).values())
    scenes = sorted({(row.half != "decide", row.scene) for row in rows})
    width, height, across = 220, 120, 4
    down = -(-len(scenes) // across)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width * across} {height * down + 20}" '
        'font-family="sans-serif" font-size="11"><rect width="100%" height="100%" fill="white"/>'
    ]
    for index, (is_aside, scene) in enumerate(scenes):
        left, top = width * (index % across) + 30, height * (index // across) + 22
        own = [row for row in rows if row.scene == scene]
        longest = max(row.curve[-1].processor_s for row in own)
        parts.append(f'<text x="{left}" y="{top - 6}">{scene}{", aside" * is_aside}, {longest:.0f} s</text>')
        parts.append(f'<rect x="{left}" y="{top}" width="180" height="80" fill="none" stroke="#bbb"/>')
        parts.append(f'<line x1="{left}" x2="{left + 180}" y1="{top + 40}" y2="{top + 40}" stroke="#ddd"/>')
        for row in own:
            points = [(0.0, 0.0), *((point.processor_s, point.success) for point in row.curve)]
            path = " ".join(f"{left + 180 * s / longest:.1f},{top + 80 - 80 * won:.1f}" for s, won in points)
            colour = _COLOURS[row.protocol]
            parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"/>')
    legend = height * down + 12
    for index, (name, colour) in enumerate(_COLOURS.items()):
        parts.append(f'<text x="{30 + 80 * index}" y="{legend}" fill="{colour}">{name}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


if __name__ == "__main__":
    main()
