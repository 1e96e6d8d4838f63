"""That bodies which cheat would win: each at its own task, judged by the code as it stands.

    python -m benchmarks.cheats.wins --out benchmarks/cheats/before.jsonl

Made once with the code from before such bodies were refused; before.jsonl holds what it found. What is in the
file is not played again, unless the body has changed.
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
    """Play what is not in the file yet."""
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
    """Return the rows of a file, none where there is no file."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []


def fingerprint(cheat: Cheat) -> str:
    """Return what changes with the body."""
    return hashlib.sha256(cheat.mjcf.encode()).hexdigest()[:12]


def commit() -> str:
    """Return the commit of the code that is run."""
    import aidsr

    home = Path(aidsr.__file__).parent
    found = subprocess.run(
        ["git", "-C", str(home), "rev-parse", "--short", "HEAD"], check=True, capture_output=True, text=True
    )
    return found.stdout.strip()


def win(cheat: Cheat) -> Row:
    """Return how a body does at its own task, and what validator and evaluation find wrong with it."""
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
