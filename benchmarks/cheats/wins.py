"""Show that cheating bodies win: each body at its own task, evaluated by the code that is installed.

    python -m benchmarks.cheats.wins --out benchmarks/cheats/before.jsonl

before.jsonl was made with the code from before such bodies were refused: most of it with one commit, and the bodies
that were found later with a later one, each by this program with that commit's `src` on the path. A body that is in
the file is not played again unless it has changed.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from benchmarks.cheats.bodies import CHEATS, Cheat
from benchmarks.cheats.parts import Player
from benchmarks.cheats.playing import place

from aidsr import validate
from aidsr.core.config import LEAST_EPISODES
from aidsr.core.provenance import commit
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.rl.evaluation import evaluate
from aidsr.mjcf.read import parse_document
from aidsr.tasks import BENCHMARK_VERSION, load_task

HERE = Path(__file__).parent
BEFORE = HERE / "before.jsonl"
FOUND_LATER = "d877502872ed"
"""Commit with which the bodies were played that were found later, from before the rules that refuse them."""

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


@cache
def fingerprint(cheat: Cheat) -> str:
    """Return a short hash of all that a verdict depends on: MJCF, part, offset, rule and edit of the scene."""
    parts = (cheat.mjcf, cheat.part, repr(cheat.offset_m), _commands(cheat), _edits(cheat), *["held"] * cheat.held)
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:12]


def _commands(cheat: Cheat) -> str:
    """Return the commands of the body's rule, as text, at 300 times of two episodes with random features."""
    rule, width = cheat.rule(), sum(feature.size for feature in load_task(cheat.task).features)
    seen = np.random.default_rng(0).uniform(-1.0, 1.0, (300, 2, width))
    return "\n".join(
        f"{name} {np.round(value, 6) + 0.0}"  # no negative zeros
        for step, features in enumerate(seen)
        for name, value in sorted(rule(step * 0.1, features).items())
    )


def _edits(cheat: Cheat) -> str:
    """Return the elements of the scene that the body's edit makes or changes, as text."""
    if cheat.edit is None:
        return ""
    scenes = (place(one, load_task(cheat.task)) for one in (replace(cheat, edit=None), cheat))
    plain, edited = (
        {f"{each.tag} {sorted(each.attrib.items())}" for each in parse_document(mjcf).root.iter()} for mjcf in scenes
    )
    return "\n".join(sorted(plain ^ edited))


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
