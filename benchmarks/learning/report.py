"""Write results.md and its curves from results.jsonl.

python -m benchmarks.learning.report
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean, median_high

from benchmarks.learning.compare import EPISODES, RESULTS, Row, rows_of
from benchmarks.learning.suite import Half

from aidsr.learn.rl.recipe import PROTOCOLS

_WON = 0.5
"""Share of episodes from which a scene counts as successful. Source: the paper's binary rate."""
_COLOURS = {"paper": "#9a5b13", "best": "#1f5fa8"}


def main() -> None:
    """Write both."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=Path, default=RESULTS)
    rows = rows_of(parser.parse_args().rows)
    page = RESULTS.with_suffix(".md")
    page.write_text(page_of(rows), encoding="utf-8")
    page.with_name("results-curves.svg").write_text(curves(rows), encoding="utf-8")


def reached_s(row: Row) -> float | None:
    """Return the processor seconds until half of the episodes were won for the first time; None for never."""
    return next((point.processor_s for point in row.curve if point.success >= _WON), None)


def page_of(rows: Sequence[Row]) -> str:
    """Return the page."""
    lines = [
        "# What the protocols reach on the suite",
        "",
        "Made by `python -m benchmarks.learning.compare` and `python -m benchmarks.learning.report`. Budget "
        + ", ".join(sorted({f"{row.steps:,}" for row in rows}))
        + f" control steps a training, one thread; success in {EPISODES} development episodes that training never "
        "samples, without noise. Processor seconds, evaluations left out. A point of the curve counts an episode "
        "without progress for 8 s as lost; the last one does not. † An earlier recipe of the protocol; `compare` makes "
        "these rows again.",
        "",
        "![success over processor seconds](results-curves.svg)",
    ]
    for half, title in (("decide", "Half to decide by"), ("aside", "Half set aside")):
        lines += ["", f"## {title}", "", *_half(rows, half)]
    return "\n".join(lines) + "\n"


def _half(rows: Sequence[Row], half: Half) -> list[str]:
    mine = {(row.scene, row.seed, row.protocol): row for row in rows if row.half == half}
    both = sorted({key[:2] for key in mine if (*key[:2], "paper") in mine and (*key[:2], "best") in mine})
    lines = [
        "| scene | by | task | paper: success (progress) | to 50 % | best: success (progress) | to 50 % |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, seed in both:
        paper, best = mine[name, seed, "paper"], mine[name, seed, "best"]
        cells = " | ".join(f"{_end(row)} | {_time(row)}" for row in (paper, best))
        lines.append(f"| {name} | {paper.author} | {paper.task} | {cells} |")
    for protocol in ("paper", "best"):
        own = [mine[name, seed, protocol] for name, seed in both]
        lines += ["", f"{protocol}: {_summary(own)}"]
    return lines


def _end(row: Row) -> str:
    last, earlier = row.curve[-1], " †" * (row.recipe != PROTOCOLS[row.protocol])
    return f"{last.success:.0%} ({last.progress:.2f}) after {last.processor_s:.0f} s{earlier}"


def _time(row: Row) -> str:
    found = reached_s(row)
    return "never" if found is None else f"{found:.0f} s"


def _summary(rows: Sequence[Row]) -> str:
    if not rows:
        return "no trainings."
    won = [row for row in rows if row.curve[-1].success >= _WON]
    never = max(row.curve[-1].processor_s for row in rows) + 1.0
    times = [reached_s(row) or never for row in rows]
    middle = median_high(times)
    told = f"{middle:.0f} s" if middle < never else "never"
    categories = sorted({row.category for row in rows})
    shares = [
        f"{category} {sum(row.category == category for row in won)} of {sum(row.category == category for row in rows)}"
        for category in categories
    ]
    return (
        f"{len(won)} of {len(rows)} scenes end at 50 % or more ({', '.join(shares)}); mean success "
        f"{fmean(row.curve[-1].success for row in rows):.0%}; median of the processor time to 50 %: {told}."
    )


def curves(rows: Sequence[Row]) -> str:
    """Return success over processor seconds as a picture, one small panel a scene."""
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
