"""Measure how fast environments step and how fast bodies learn.

    python benchmarks/rl/speed.py --runs 5

The arm and the crawler are designs of the built-in team, made with the first seed that proposes the family. First,
stepping speed is compared: the batched environment of this package; the plain Gymnasium environments of `plain.py` in
Stable-Baselines3's SubprocVecEnv with 8 processes; and the raw physics of the same scenes on the same threads without
any observation or reward, which is the upper limit. They take turns of about a second, so that a machine that becomes
slower slows all of them. Then learning is compared, by the wall time until a share of the last 100 episodes succeeds:
this package's recipe on the batched environment, and Stable-Baselines3's default PPO on SubprocVecEnv. The latter stops
after a multiple of the time that the former took with the same seed.

Measurements are kept in results.jsonl and results-stepping.jsonl beside this file and are not repeated, so a stopped
run can be continued; results.md and results-curves.png are made from them. Nothing else should run at the same time. To
measure everything yourself, name other files (`--out`).
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

from bodies import BODIES, Body, made
from learning import ours, theirs
from records import Run, Stepping, keep, kept, learning_conditions_now
from speed_page import draw, page, told
from stepping import PROCESSES, SIMULATIONS, speeds

HOME = Path(__file__).parent


def main() -> None:
    """Make the missing measurements, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5, help="trainings of each body, each with its own seed")
    parser.add_argument("--body", choices=[body.name for body in BODIES], help="measure this one alone")
    parser.add_argument("--stepping", action="store_true", help="measure how fast they step alone, train nothing")
    parser.add_argument("--most-steps", type=int, default=300_000, help="budget of our recipe")
    parser.add_argument("--patience", type=float, default=8.5, help="times our wall time that the defaults may take")
    parser.add_argument("--out", default="results", help="how the names of all files begin")
    asked = parser.parse_args()
    measured = _Measured(asked)
    with tempfile.TemporaryDirectory() as folder:
        scenes = {body: made(body, Path(folder) / body.name) for body in BODIES if asked.body in (None, body.name)}
        for body, scene in scenes.items():
            measured.step(body, scene)
        for seed in range(0 if asked.stepping else asked.runs):
            for body, scene in scenes.items():
                measured.learn(body, scene, seed)
    measured.publish()


class _Measured:
    """Measurements so far. Each new one is written to its file at once."""

    def __init__(self, asked: argparse.Namespace) -> None:
        self._asked = asked
        self._conditions = learning_conditions_now(asked.most_steps, asked.patience)
        self._raw, self._raw_stepping = HOME / f"{asked.out}.jsonl", HOME / f"{asked.out}-stepping.jsonl"
        self._runs = kept(self._raw, Run, self._conditions)
        self._steppings = kept(self._raw_stepping, Stepping, self._conditions.machine)

    def step(self, body: Body, scene: Path) -> None:
        """Measure how fast a body's simulations step, unless it was measured before."""
        if any(one.body == body.name for one in self._steppings):
            return
        load = os.getloadavg()[0]
        self._steppings.append(
            Stepping(
                body=body.name,
                conditions=self._conditions.machine,
                load=load,
                simulations=SIMULATIONS,
                processes=PROCESSES,
                rounds=speeds(body, scene),
            )
        )
        keep(self._raw_stepping, self._steppings)
        self.publish()

    def learn(self, body: Body, scene: Path, seed: int) -> None:
        """Measure how a body learns with a seed, unless it was measured before."""
        if any((run.body, run.seed) == (body.name, seed) for run in self._runs):
            return
        load = os.getloadavg()[0]
        first = ours(body, scene, seed, self._asked.most_steps)
        second = theirs(body, scene, seed, self._asked.patience * first.wall_s)
        sys.stdout.write(f"{body.name}, seed {seed}: {told(first)}; {told(second)}\n")
        sys.stdout.flush()
        run = Run(body=body.name, seed=seed, conditions=self._conditions, load=load, ours=first, theirs=second)
        self._runs.append(run)
        keep(self._raw, self._runs)
        self.publish()

    def publish(self) -> None:
        """Write the page and its picture."""
        asked = self._asked
        text = page(self._runs, self._steppings, asked.runs, self._conditions, asked.out)
        (HOME / f"{asked.out}.md").write_text(text, encoding="utf-8")
        draw(self._runs, HOME / f"{asked.out}-curves.png")


if __name__ == "__main__":
    main()
