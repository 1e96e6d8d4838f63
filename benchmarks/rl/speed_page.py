"""Page and picture of the measured speeds."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from pathlib import Path

from bodies import BODIES, Body
from learning import Way
from matplotlib.figure import Figure
from records import LearningConditions, Run, Stepping
from stepping import PROCESSES

_OURS, _THEIRS = "our recipe, batched", f"PPO defaults, SubprocVecEnv({PROCESSES})"
_COLORS = {_OURS: "#2563a8", _THEIRS: "#b4601d"}


def page(
    runs: Sequence[Run], steppings: Sequence[Stepping], asked: int, conditions: LearningConditions, out: str
) -> str:
    """Return the measurements as Markdown.

    Args:
        runs: Trainings.
        steppings: Stepping speeds of the bodies.
        asked: Requested number of trainings of each body.
        conditions: Conditions of all trainings.
        out: Prefix of the names of all files.
    """
    command = f"python benchmarks/rl/speed.py --runs {asked} --most-steps {conditions.most_steps}"
    command += f" --patience {conditions.patience:g}{f' --out {out}' if out != 'results' else ''}"
    lines = [
        f"# Speed of environments and of learning\n\nMade by `{command}`, on {conditions.cores} cores, MuJoCo "
        f"{conditions.packages['mujoco']}, version {conditions.benchmark_version} of the benchmark. Ratios are taken "
        "within a round, where kinds follow each other within seconds, or within a training, which has its own seed; "
        "medians of them are told.\n",
        *([f"![success over wall time]({out}-curves.png)\n"] if runs else []),
    ]
    for body in BODIES:
        own = [run for run in runs if run.body == body.name]
        lines.append(f"## {body.name}: {body.task}\n")
        lines += [line for one in steppings if one.body == body.name for line in _stepping(one)]
        lines.append(f"{len(own)} of {asked} trainings are done{_load(own)}.\n")
        lines += _learning(body, own) if own else []
    return "\n".join(lines).rstrip() + "\n"


def _load(runs: Sequence[Run]) -> str:
    return f"; load of the machine before: {', '.join(f'{run.load:.1f}' for run in runs)}" if runs else ""


def _stepping(found: Stepping) -> list[str]:
    kinds = {
        "physics": "raw physics, the limit",
        "batched": f"batched, {found.simulations} simulations",
        "subproc": f"SubprocVecEnv({found.processes}), plain environment",
    }
    seen = {kind: [speeds[kind] for speeds in found.rounds] for kind in kinds}
    rows = [
        f"| {kinds[kind]} | {statistics.median(values):,.0f} ({min(values):,.0f} to {max(values):,.0f}) "
        f"| {_ratio(found, kind, 'physics'):.0%} |"
        for kind, values in seen.items()
    ]
    return [
        f"| env-steps per second | median of {len(found.rounds)} rounds (range) | of the limit |",
        "|---|---|---|",
        *rows,
        f"\nBatched against SubprocVecEnv: **{_ratio(found, 'batched', 'subproc'):.1f} x**; load of the machine "
        f"before: {found.load:.1f}.\n",
    ]


def _ratio(found: Stepping, kind: str, by: str) -> float:
    return statistics.median(speeds[kind] / speeds[by] for speeds in found.rounds)


def _learning(body: Body, runs: Sequence[Run]) -> list[str]:
    return [
        f"Until {body.success:.0%} of the last 100 episodes succeed:\n",
        f"| seed | {_OURS} | {_THEIRS} |",
        "|---|---|---|",
        *(f"| {run.seed} | {told(run.ours)} | {told(run.theirs)} |" for run in runs),
        f"\nWall time, theirs by ours, median: **{ratio_of(runs)}**.\n",
    ]


def ratio_of(runs: Sequence[Run]) -> str:
    """Return in words how many times longer the defaults take (median); a lower bound if some were stopped."""
    ratio = statistics.median(run.theirs.wall_s / run.ours.wall_s if run.ours.there else 0.0 for run in runs)
    if not ratio:
        return "none: in most runs our recipe does not get there"
    return f"{'' if all(run.theirs.there for run in runs) else 'at least '}{ratio:.1f} x"


def told(way: Way) -> str:
    """Return the result of a training in words, for a table cell."""
    end = "" if way.there else ", not there"
    return f"{way.wall_s:.0f} s, {way.steps:,} steps, {way.steps / way.wall_s:,.0f}/s{end}"


def draw(runs: Sequence[Run], path: Path) -> None:
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
