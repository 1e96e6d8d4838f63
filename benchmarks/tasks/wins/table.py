"""Measure how many held-out episodes the scripts win, and write the table, beside that of the trivial policies.

    python -m benchmarks.tasks.wins.table --tasks drawer_opening --levels standard --episodes 20

Each robot is validated, its script plays, and the verdict's three checks of the body play the episodes again. A row
replaces an earlier one of the same task and level; --try only prints it.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.tasks.wins.scripts import SCRIPTS

from aidsr.core.provenance import commit
from aidsr.learn.episodes.plausibility import FEWEST_SUCCESSES
from aidsr.learn.episodes.policy_checks import body_checks, rollout_with_stats
from aidsr.tasks import BENCHMARK_VERSION, load_task
from aidsr.validation import validate

HERE = Path(__file__).parents[1]
FACTS, PAGE = HERE / "wins.jsonl", HERE / "wins.md"
CHECKS = ("needs_cables", "needs_soft_body", "works_without_other_actuators")
HEAD = """# Can the tasks be won?

By cable-driven soft bodies with a script, in held-out episodes. Made by `python -m benchmarks.tasks.wins.table`;
robots and scripts stand in `benchmarks/tasks/wins`. *Progress* is the mean of each episode's best. *Sound* and *in
scope* are what `aidsr validate` says of the robot. The three checks are those of the verdict: successes vanish with
slack cables, vanish with a locked body, and stay without other
actuators (works alone);
empty where fewer than four episodes were won, too few to say.

| task | level | wins | progress | sound | in scope | needs cables | needs soft body | works alone | version | commit |
|---|---|---|---|---|---|---|---|---|---|---|
"""


def measured(name: str, level: str, episodes: int) -> dict[str, Any]:
    """Play the script of a task at a level, and return the row."""
    task = load_task(name, level)  # type: ignore[arg-type]
    script = SCRIPTS[task.name](task)
    report = validate(script.robot().mjcf)
    rolled = rollout_with_stats(script.scene, script, range(episodes), threads=1)
    checks = {check.name: check.passed for check in body_checks(script.scene, script, rolled, threads=1)}
    return {
        "task": task.name,
        "level": level,
        "episodes": episodes,
        "wins": int(rolled.outcomes.success.sum()),
        "progress": round(float(np.mean(rolled.outcomes.best_progress)), 3),
        "sound": report.sound,
        "in_scope": report.in_scope,
        "checks": checks,
        "version": BENCHMARK_VERSION,
        "commit": commit(),
    }


def page(rows: list[dict[str, Any]]) -> str:
    """Return the page as Markdown."""
    said = {True: "yes", False: "**no**"}
    lines = []
    for row in rows:
        passed = [said[row["checks"][name]] if row["wins"] >= FEWEST_SUCCESSES else "" for name in CHECKS]
        cells = [row["task"], row["level"], f"{row['wins']} of {row['episodes']}", f"{row['progress']:.2f}"]
        cells += [said[row["sound"]], said[row["in_scope"]], *passed, str(row["version"]), row["commit"][:9]]
        lines.append(f"| {' | '.join(cells)} |")
    return HEAD + "\n".join(lines) + "\n"


def main() -> None:
    """Measure the requested tasks and levels."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", nargs="*", default=sorted(name.rpartition("/")[2] for name in SCRIPTS))
    parser.add_argument("--levels", nargs="*", default=["standard", "hard"], choices=["standard", "hard"])
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--try", dest="only_try", action="store_true")
    asked = parser.parse_args()
    for task in asked.tasks:
        for level in asked.levels:
            row = measured(task, level, asked.episodes)
            sys.stdout.write(json.dumps(row) + "\n")
            sys.stdout.flush()
            if not asked.only_try:
                keep(row)


def keep(row: dict[str, Any]) -> None:
    """Write a row, which replaces an earlier one of the same task and level, and the page."""
    rows = [json.loads(line) for line in FACTS.read_text(encoding="utf-8").splitlines()] if FACTS.exists() else []
    rows = [one for one in rows if (one["task"], one["level"]) != (row["task"], row["level"])] + [row]
    order = list(SCRIPTS)
    rows.sort(key=lambda one: (one["level"] == "hard", order.index(one["task"])))
    FACTS.write_text("".join(json.dumps(one) + "\n" for one in rows), encoding="utf-8")
    PAGE.write_text(page(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
