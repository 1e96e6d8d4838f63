"""How much success policies keep if the scene differs from its model, trained without and with such changes.

    python benchmarks/robustness/measure.py

One built-in design of each task (seed 0) is trained twice with every training seed, once with `randomize`. Each policy
plays the same held-out variations without and with every kind of perturbation. Policies are kept under build/robustness
and their results in results.jsonl beside this file, so a stopped run can be continued; results.md is made from
results.jsonl. Results of different versions of the benchmark, or of different protocols, cannot share a file: name
another one with --out.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import aidsr
from aidsr.core.artifacts import Artifact, Evaluation, PerturbedEpisodes
from aidsr.core.config import Protocol
from aidsr.core.provenance import commit
from aidsr.core.rates import Rate
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.rl.policy import one_torch_thread
from aidsr.learn.rl.recipe import PROTOCOLS
from aidsr.learn.rl.robustness import SUMMARIES, perturbed_episodes
from aidsr.learn.rl.trained import FinishedTraining
from aidsr.runs.files import replace_file
from aidsr.tasks import BENCHMARK_VERSION, is_current

HOME = Path(__file__).parent
TASKS = ("button_pushing", "simple_grasping", "flat_ground")
DESIGN_SEED = 0


class Row(Artifact):
    """Results of one policy."""

    task: str
    randomize: bool
    seed: int
    steps: int
    """Budget of control steps."""
    protocol: Protocol
    """Protocol of the training. Rows of commits 5de0002 and 6381331100bb were made before there were protocols, with
    today's recipe of `paper`."""
    trained_steps: int
    training_s: float
    won: int
    """Held-out episodes that succeeded without a perturbation."""
    episodes: int
    perturbed: tuple[PerturbedEpisodes, ...]
    benchmark_version: int
    mujoco: str
    commit: str


def main() -> None:
    """Make the missing measurements, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", nargs="+", default=TASKS)
    parser.add_argument("--steps", type=int, default=100_000, help="control steps of each training")
    parser.add_argument("--protocol", choices=tuple(PROTOCOLS), default="paper", help="%(default)s unless named")
    parser.add_argument("--seeds", type=int, default=1, help="trainings of each kind")
    parser.add_argument("--episodes", type=int, default=50, help="held-out variations")
    parser.add_argument("--threads", type=int, default=0, help="native threads; 0 takes all processors")
    parser.add_argument("--out", type=Path, default=HOME / "results", help="name of the .jsonl and the .md")
    parser.add_argument("--folder", type=Path, default=Path("build/robustness"), help="where policies are kept")
    args = parser.parse_args()
    raw = args.out.with_suffix(".jsonl")
    rows = read(raw)
    if not all(is_current(row.task, row.benchmark_version) for row in rows):
        sys.exit(f"{raw} is of another version of the benchmark than {BENCHMARK_VERSION}; name another file with --out")
    if any(row.protocol != args.protocol for row in rows):
        sys.exit(f"{raw} holds trainings with another protocol than {args.protocol}; name another file with --out")
    for seed in range(args.seeds):
        for task in args.tasks:
            for randomize in (False, True):
                case = (task, randomize, seed, args.steps, args.episodes)
                if case not in [(row.task, row.randomize, row.seed, row.steps, row.episodes) for row in rows]:
                    rows.append(measured(*case, args.protocol, args.threads, args.folder))
                    replace_file(raw, "".join(row.model_dump_json() + "\n" for row in rows).encode())
                    replace_file(args.out.with_suffix(".md"), page(rows).encode())


def read(raw: Path) -> list[Row]:
    """Return the rows of a file, none if there is no file."""
    lines = raw.read_text(encoding="utf-8").splitlines() if raw.exists() else []
    return [Row.model_validate_json(line) for line in lines]


def measured(
    task: str,
    randomize: bool,
    seed: int,
    steps: int,
    episodes: int,
    protocol: Protocol,
    threads: int,
    folder: Path,
) -> Row:
    """Train a policy, play the held-out variations without and with perturbations, and return the row."""
    home = folder / task
    made = sorted(home.glob("*/designs/1/final.xml"))
    design = made[0].parent if made else aidsr.design(task=task, concepts=1, seed=DESIGN_SEED, runs=home).design(1).path
    out = home / f"{protocol}-{steps}-{'randomized' if randomize else 'nominal'}"
    training = aidsr.train(
        design, steps=steps, seed=seed, out=out, protocol=protocol, randomize=randomize, threads=threads
    )
    trained = FinishedTraining.load(training.path)
    scene = trained.scene
    variations = [scene.task.variation("held_out", index) for index in range(episodes)]
    with one_torch_thread():
        nominal = rollout(Episodes(scene.model, scene.task, scene.actions, variations, threads=threads), trained.policy)
        evaluation = Evaluation(
            task=scene.task.name,
            level=scene.task.level,
            benchmark_version=BENCHMARK_VERSION,
            episodes=tuple(nominal.result(index, index) for index in range(episodes)),
            checks=(),
        )
        perturbed = perturbed_episodes(scene, trained.policy, evaluation, threads=threads)
    return Row(
        task=task,
        randomize=randomize,
        seed=seed,
        steps=steps,
        protocol=protocol,
        trained_steps=trained.result.steps,
        training_s=trained.result.wall_s,
        won=int(nominal.success.sum()),
        episodes=episodes,
        perturbed=perturbed,
        benchmark_version=BENCHMARK_VERSION,
        mujoco=version("mujoco"),
        commit=commit(),
    )


# --- the page ---


def page(rows: Sequence[Row]) -> str:
    """Return the page as Markdown, with a table for each task."""
    commits, protocols, steps, episodes = (
        ", ".join(map(str, sorted({getattr(row, name) for row in rows})))
        for name in ("commit", "protocol", "steps", "episodes")
    )
    parts = [
        "# Robustness of policies",
        f"Made by `python benchmarks/robustness/measure.py --protocol {protocols} --steps {steps} "
        f"--episodes {episodes} --seeds {max(row.seed for row in rows) + 1}` at commit {commits}, MuJoCo "
        f"{rows[0].mujoco}, version {rows[0].benchmark_version} of the benchmark. For each task the built-in team's "
        f"first design of seed {DESIGN_SEED}, trained without and with `randomize`; what has no column was not "
        "measured. Each cell: held-out episodes won, their Wilson interval at 95 %, and what that keeps of the "
        "episodes won in the model. [What differs](../../docs/learning.md#robustness).",
    ]
    for task in dict.fromkeys(row.task for row in rows):
        of_task = [row for row in rows if row.task == task]
        parts += [f"## {task}", _table(of_task), "\n".join(_trainings(of_task))]
    return "\n\n".join(parts) + "\n"


def _table(rows: Sequence[Row]) -> str:
    heads = [f"{'randomized' if row.randomize else 'nominal'}, seed {row.seed}" for row in rows]
    lines = [f"| scene | {' | '.join(heads)} |", "|---" * (len(rows) + 1) + "|"]
    lines.append(f"| as its model | {' | '.join(_cell(row.won, row.episodes) for row in rows)} |")
    for position, summary in enumerate(SUMMARIES.values()):
        found = [row.perturbed[position] for row in rows]
        cells = [_cell(len(one.succeeded), one.episodes, one.kept_share) for one in found]
        lines.append(f"| {summary} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _cell(won: int, of: int, kept: float | None = None) -> str:
    interval = Rate(won, of).interval
    share = f"{won} of {of} ({interval.low:.0%} to {interval.high:.0%})"
    return share if kept is None else f"{share}, keeps {kept:.0%}"


def _trainings(rows: Sequence[Row]) -> list[str]:
    return [
        f"- {'randomized' if row.randomize else 'nominal'}, seed {row.seed}: {row.trained_steps:,} of {row.steps:,} "
        f"control steps in {row.training_s:.0f} s"
        for row in rows
    ]


if __name__ == "__main__":
    main()
