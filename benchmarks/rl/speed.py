"""How fast environments step and bodies learn, side by side.

    python benchmarks/rl/speed.py --runs 5

The arm and the crawler are the built-in team's, made on the spot with the first seed that proposes one. Compared are
the batched environment of this package, the plain Gymnasium environments of `plain.py` in Stable-Baselines3's
SubprocVecEnv with 8 processes, and the raw physics of the same scenes on the same threads, with no number looked at:
the limit. Then wall time until a share of the last 100 episodes succeed: our recipe on the batched environment against
Stable-Baselines3's default PPO on SubprocVecEnv, which gives up after a multiple of the time that ours took with the
same seed. The kinds take turns, so that a machine that gets slower meanwhile slows all of them.

What was measured is kept in results.jsonl beside this file and not measured again, so a stopped run goes on; results.md
and curves.png are made of it. Nothing else should run meanwhile. To measure all yourself, name another file (`--out`).
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from bodies import BODIES, Body, made
from learning import Way, ours, theirs
from matplotlib.figure import Figure
from stepping import PROCESSES, SIMULATIONS, speeds

from aidsr.artifacts import Artifact
from aidsr.rl.recipe import Recipe
from aidsr.runs.files import replace_file
from aidsr.tasks import BENCHMARK_VERSION

HOME = Path(__file__).parent
KINDS = {
    "physics": "raw physics, the limit",
    "batched": f"batched, {SIMULATIONS} simulations",
    "subproc": f"SubprocVecEnv({PROCESSES}), plain environment",
}
_OURS, _THEIRS = "our recipe, batched", f"PPO defaults, SubprocVecEnv({PROCESSES})"
_COLORS = {_OURS: "#2563a8", _THEIRS: "#b4601d"}


class Conditions(Artifact):
    """What may not change between the runs that are compared."""

    benchmark_version: int
    packages: dict[str, str]
    cores: int
    recipe: dict[str, Any]
    """With the fields it had then."""
    most_steps: int
    """Budget of our recipe."""
    patience: float
    """How many times our wall time the defaults may take."""


class Run(Artifact):
    """Everything that is measured of a body, once."""

    body: str
    seed: int
    conditions: Conditions
    load: float
    """Of the machine, the minute before."""
    speeds: dict[str, float]
    """Env-steps per second of each kind."""
    ours: Way
    theirs: Way


def main() -> None:
    """Measure what is missing, and write down."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5, help="of each body, each with its own seed; medians are told")
    parser.add_argument("--body", choices=[body.name for body in BODIES], help="measure this one alone")
    parser.add_argument("--most-steps", type=int, default=300_000, help="budget of our recipe")
    parser.add_argument("--patience", type=float, default=8.5, help="times our wall time that the defaults may take")
    parser.add_argument("--out", default="results", help="name of the table, without its ending")
    asked = parser.parse_args()
    conditions = conditions_now(asked.most_steps, asked.patience)
    raw = HOME / f"{asked.out}.jsonl"
    runs = kept(raw, conditions)
    with tempfile.TemporaryDirectory() as folder:
        bodies = [body for body in BODIES if asked.body in (None, body.name)]
        scenes = {body.name: made(body, Path(folder) / body.name) for body in bodies}
        for seed in range(asked.runs):
            for body in bodies:
                if any((run.body, run.seed) == (body.name, seed) for run in runs):
                    continue
                runs.append(_measured(body, scenes[body.name], seed, conditions))
                replace_file(raw, "".join(run.model_dump_json() + "\n" for run in runs).encode())
                _publish(runs, asked)
    _publish(runs, asked)


def conditions_now(most_steps: int, patience: float) -> Conditions:
    """Return the conditions of today's runs."""
    return Conditions(
        benchmark_version=BENCHMARK_VERSION,
        packages={name: version(name) for name in ("mujoco", "stable-baselines3", "torch")},
        cores=os.cpu_count() or 0,
        recipe=Recipe().model_dump(mode="json"),
        most_steps=most_steps,
        patience=patience,
    )


def kept(raw: Path, conditions: Conditions) -> list[Run]:
    """Return the runs in a file, none where there is no file; end where one was made under other conditions."""
    lines = raw.read_text(encoding="utf-8").splitlines() if raw.exists() else []
    runs = [Run.model_validate_json(line) for line in lines]
    for run in runs:
        if run.conditions != conditions:
            sys.exit(
                f"{raw} was measured under other conditions: {run.conditions}; expected were {conditions}. Name "
                "another file with --out"
            )
    return runs


def _measured(body: Body, scene: Path, seed: int, conditions: Conditions) -> Run:
    load = os.getloadavg()[0]
    found = speeds(body, scene)
    first = ours(body, scene, seed, conditions.most_steps)
    second = theirs(body, scene, seed, conditions.patience * first.wall_s)
    sys.stdout.write(f"{body.name}, seed {seed}: {_told(first)}; {_told(second)}\n")
    sys.stdout.flush()
    return Run(body=body.name, seed=seed, conditions=conditions, load=load, speeds=found, ours=first, theirs=second)


# --- the table ---


def _publish(runs: Sequence[Run], asked: argparse.Namespace) -> None:
    named = f" --out {asked.out}" if asked.out != "results" else ""
    command = (
        f"python benchmarks/rl/speed.py --runs {asked.runs} --most-steps {asked.most_steps} "
        f"--patience {asked.patience:g}{named}"
    )
    curves = "curves.png" if asked.out == "results" else f"{asked.out}-curves.png"
    lines = [
        f"# Speed of environments and of learning\n\nMade by `{command}`, on {os.cpu_count()} cores, MuJoCo "
        f"{version('mujoco')}, version {BENCHMARK_VERSION} of the benchmark. Each run has its own seed; ratios are "
        "taken within a run, and medians of them are told.\n",
        f"![success over wall time]({curves})\n",
    ]
    for body in BODIES:
        own = [run for run in runs if run.body == body.name]
        lines.append(f"## {body.name}: {body.task}\n\n{len(own)} of {asked.runs} runs are done{_load(own)}.\n")
        if own:
            lines += [*_stepping(own), *_learning(body, own)]
    (HOME / f"{asked.out}.md").write_text("\n".join(lines).rstrip() + "\n", encoding="utf-8")
    _draw(runs, HOME / curves)


def _load(runs: Sequence[Run]) -> str:
    return f"; load of the machine before: {', '.join(f'{run.load:.1f}' for run in runs)}" if runs else ""


def _stepping(runs: Sequence[Run]) -> list[str]:
    seen = {kind: [run.speeds[kind] for run in runs] for kind in KINDS}
    medians = {kind: statistics.median(values) for kind, values in seen.items()}
    rows = [
        f"| {KINDS[kind]} | {medians[kind]:,.0f} ({min(values):,.0f} to {max(values):,.0f}) "
        f"| {_ratio(runs, kind, 'physics'):.0%} |"
        for kind, values in seen.items()
    ]
    return [
        f"| env-steps per second | median of {len(runs)} (range) | of the limit |",
        "|---|---|---|",
        *rows,
        f"\nBatched against SubprocVecEnv: **{_ratio(runs, 'batched', 'subproc'):.1f} x**.\n",
    ]


def _ratio(runs: Sequence[Run], kind: str, by: str) -> float:
    return statistics.median(run.speeds[kind] / run.speeds[by] for run in runs)


def _learning(body: Body, runs: Sequence[Run]) -> list[str]:
    return [
        f"Until {body.success:.0%} of the last 100 episodes succeed:\n",
        f"| seed | {_OURS} | {_THEIRS} |",
        "|---|---|---|",
        *(f"| {run.seed} | {_told(run.ours)} | {_told(run.theirs)} |" for run in runs),
        f"\nWall time, theirs by ours, median: **{ratio_of(runs)}**.\n",
    ]


def ratio_of(runs: Sequence[Run]) -> str:
    """Return how much longer the defaults take in the median, in words; a lower bound where they were stopped."""
    ratio = statistics.median(run.theirs.wall_s / run.ours.wall_s if run.ours.there else 0.0 for run in runs)
    if not ratio:
        return "none: in most runs our recipe does not get there"
    return f"{'' if all(run.theirs.there for run in runs) else 'at least '}{ratio:.1f} x"


def _told(way: Way) -> str:
    end = "" if way.there else ", not there"
    return f"{way.wall_s:.0f} s, {way.steps:,} steps, {way.steps / way.wall_s:,.0f}/s{end}"


def _draw(runs: Sequence[Run], path: Path) -> None:
    """Draw success over wall time: a panel for each body, a line for each training."""
    bodies = [body for body in BODIES if any(run.body == body.name for run in runs)]
    if not bodies:
        return
    figure = Figure(figsize=(4.6 * max(2, len(bodies)), 3.5), layout="constrained")
    for axes, body in zip(figure.subplots(1, len(bodies), squeeze=False)[0], bodies, strict=True):
        axes.axhline(body.success, color="0.6", linestyle=":", label="asked for")
        for run in (run for run in runs if run.body == body.name):
            for name, way in ((_OURS, run.ours), (_THEIRS, run.theirs)):
                times, shares = zip((0.0, 0.0), *way.curve, strict=True)
                axes.plot(times, shares, color=_COLORS[name], linewidth=1.5, label=name)
        axes.set(title=f"{body.name}: {body.task}", xlabel="wall time [s]", ylim=(0, 1), xlim=(0, None))
        axes.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel("success of the last 100 episodes")
    drawn, names = figure.axes[0].get_legend_handles_labels()
    once = dict(zip(names, drawn, strict=True))
    figure.legend(once.values(), once.keys(), frameon=False, loc="outside lower center", ncols=3)
    figure.savefig(path, dpi=130)


if __name__ == "__main__":
    main()
