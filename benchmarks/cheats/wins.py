"""Show that cheating bodies win: each body at its own task, evaluated by the code that is installed.

    python -m benchmarks.cheats.wins --out benchmarks/cheats/before.jsonl

before.jsonl was made once, with the code from before such bodies were refused. A body that is in the file is not
played again unless it has changed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import subprocess
from pathlib import Path
from typing import Any

from benchmarks.cheats.bodies import CHEATS, Cheat
from benchmarks.cheats.parts import Player
from benchmarks.cheats.playing import place

from aidsr import validate
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.evaluation import LEAST_EPISODES, evaluate
from aidsr.tasks import BENCHMARK_VERSION, load_task

HERE = Path(__file__).parent
BEFORE = HERE / "before.jsonl"

Row = dict[str, Any]


def main() -> None:
    """Play the bodies that are not in the file yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=BEFORE)
    parser.add_argument("--bodies", nargs="+", default=[cheat.name for cheat in CHEATS])
    asked = parser.parse_args()
    known = {(row["body"], row["sha256"]) for row in read_rows(asked.out)}
    for cheat in CHEATS:
        if cheat.name in asked.bodies and (cheat.name, fingerprint(cheat)) not in known:
            with asked.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(win(cheat)) + "\n")


def read_rows(path: Path) -> list[Row]:
    """Return the rows of a file, none if there is no file."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []


def fingerprint(cheat: Cheat) -> str:
    """Return a short hash of the body's MJCF. It does not cover the rule, the offset and the edit of the scene."""
    return hashlib.sha256(cheat.mjcf.encode()).hexdigest()[:12]


def commit() -> str:
    """Return the commit of the running code."""
    import aidsr

    home = Path(aidsr.__file__).parent
    found = subprocess.run(
        ["git", "-C", str(home), "rev-parse", "--short", "HEAD"], check=True, capture_output=True, text=True
    )
    return found.stdout.strip()


def win(cheat: Cheat) -> Row:
    """Return the row of a body at its own task: episodes won, errors of the validator, failed checks."""
    task = load_task(cheat.task)
    mjcf = place(cheat, task)
    alone = validate(cheat.mjcf, mount="free" if task.base == "free" else "fixed", environment=task.environment)
    placed = validate(mjcf, needs_contact=task.needs_contact)
    scene = TaskScene.of(mjcf, task, grouping="off")
    evaluation, _ = evaluate(scene, Player(scene, cheat.rule), episodes=LEAST_EPISODES, threads=1)
    return {
        "body": cheat.name,
        "sha256": fingerprint(cheat),
        "task": cheat.task,
        "benchmark_version": BENCHMARK_VERSION,
        "commit": commit(),
        "errors": sorted({fault.code for fault in (*alone.errors, *placed.errors)}),
        "episodes": LEAST_EPISODES,
        "wins": sum(episode.ended == "succeeded" for episode in evaluation.episodes),
        "valid": evaluation.valid,
        "failed_checks": [check.name for check in evaluation.checks if not check.passed],
    }


if __name__ == "__main__":
    main()
