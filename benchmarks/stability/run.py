"""How many designs of the built-in team end as stable scenes.

Runs the whole design loop for each task and seed, then validates each final scene once more, on its own. A design
counts as stable if it was approved and its final scene passes. Rates are shares of all attempted designs.

    python benchmarks/stability/run.py --seeds 5 --tasks button_pushing simple_grasping flat_ground drawer_opening
"""

from __future__ import annotations

import argparse
import platform
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import aidsr
from aidsr.core.rates import Rate
from aidsr.runs import DesignFolder

HERE = Path(__file__).parent
FOUR = ("button_pushing", "simple_grasping", "flat_ground", "drawer_opening")


@dataclass(frozen=True)
class Attempt:
    """One design and its outcome."""

    task: str
    seed: int
    family: str
    outcome: str
    stable: bool
    iterations: int
    faults: tuple[str, ...]
    """Codes of all errors that the validator reported during the design."""


def main() -> None:
    """Run the loop for each task and seed and write results.md."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--tasks", nargs="+", default=FOUR)
    parser.add_argument("--output", type=Path, default=HERE / "results.md")
    options = parser.parse_args()
    begin = time.monotonic()
    attempts = [attempt for task in options.tasks for attempt in attempts_at(task, range(1, options.seeds + 1))]
    command = f"python benchmarks/stability/run.py --seeds {options.seeds} --tasks {' '.join(options.tasks)}"
    text = account(attempts, command, time.monotonic() - begin)
    options.output.write_text(text, encoding="utf-8")
    print(text)  # noqa: T201


def attempts_at(task: str, seeds: Sequence[int]) -> list[Attempt]:
    """Return all designs of a task, with one run per seed."""
    with tempfile.TemporaryDirectory() as folder:
        runs = [(seed, aidsr.design(task=task, seed=seed, runs=folder)) for seed in seeds]
        return [attempt(task, seed, design) for seed, run in runs for design in run.designs]


def attempt(task: str, seed: int, design: DesignFolder) -> Attempt:
    """Return the outcome of one design; its final scene is validated again."""
    outcome = design.outcome.read()
    concept = design.iteration(1).concept.read()
    reports = [r for it in design.iterations for r in (it.robot_report.read(), it.scene_report.read()) if r is not None]
    scene = design.final_scene.read()
    return Attempt(
        task=task,
        seed=seed,
        family=concept.family if concept else "none",
        outcome=outcome.outcome if outcome else "unfinished",
        stable=scene is not None and aidsr.validate(scene.decode()).stable,
        iterations=len(design.iterations),
        faults=tuple(fault.code for report in reports for fault in report.errors),
    )


def account(attempts: Sequence[Attempt], command: str, seconds: float) -> str:
    """Return the results as Markdown."""
    lines = [
        "# Stability of the built-in team's designs",
        "",
        f"Command: `{command}`",
        "",
        f"{datetime.now(UTC):%Y-%m-%d}, AID-SR {version('aidsr')}, MuJoCo {version('mujoco')}, Python "
        f"{platform.python_version()}, {seconds:.0f} s.",
        "",
        "| task | designs | approved | stable when validated anew | 95 % interval | mean iterations | families |",
        "|---|---|---|---|---|---|---|",
    ]
    for task in dict.fromkeys(attempt.task for attempt in attempts):
        lines.append(_row(task, [attempt for attempt in attempts if attempt.task == task]))
    lines.append(_row("**all**", attempts))
    met = Counter(code for attempt in attempts for code in attempt.faults)
    found = ", ".join(f"{code} {count}" for code, count in met.most_common()) or "none"
    lost = [f"{a.task} seed {a.seed}: {a.family}, {a.outcome}" for a in attempts if not a.stable]
    return "\n".join(
        [*lines, "", f"Errors met on the way: {found}.", "", f"Not stable: {'; '.join(lost) or 'none'}.", ""]
    )


def _row(name: str, attempts: Sequence[Attempt]) -> str:
    n, stable = len(attempts), sum(attempt.stable for attempt in attempts)
    approved = sum(attempt.outcome == "approved" for attempt in attempts)
    interval = Rate(stable, n).interval
    range_ = f"{interval.low:.0%} to {interval.high:.0%}"
    families = ", ".join(f"{f} {c}" for f, c in Counter(attempt.family for attempt in attempts).most_common())
    iterations = sum(attempt.iterations for attempt in attempts) / n
    share = f"{stable} ({100 * stable / n:.0f} %)"
    return f"| {name} | {n} | {approved} | {share} | {range_} | {iterations:.2f} | {families} |"


if __name__ == "__main__":
    main()
