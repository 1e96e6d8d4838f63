"""`aidsr probe`."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter
from cyclopts.validators import Number

from aidsr.apps.cli.flag import Flag
from aidsr.core.ends import ends_in_words
from aidsr.core.formatting import format_time_left
from aidsr.core.progress_lines import probe_line

if TYPE_CHECKING:
    from rich.console import Console

    from aidsr.learn.openloop import ProbeReport
    from aidsr.learn.openloop.film import Film
    from aidsr.learn.openloop.probe_scene import ProbePoint


def probe(
    design: Path,
    /,
    *,
    task: str | None = None,
    level: Literal["standard", "hard"] | None = None,
    goal: Path | None = None,
    candidates: Annotated[int | None, Parameter(validator=Number(gte=16))] = None,
    variations: Annotated[int, Parameter(validator=Number(gte=1, lte=100))] = 2,
    max_steps: Annotated[int | None, Parameter(validator=Number(gte=1))] = None,
    seed: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    grouping: Literal["auto", "off"] = "auto",
    threads: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    out: Path | None = None,
    film: Flag = False,
    json: Flag = False,
) -> int:
    """Measure how far a robot gets on its task without learning.

    Plays many open-loop motions in parallel: ramps from one value to another, and sinusoids. The best of them show
    whether a failure is due to the robot or to the policy. Exit code 0: at least one motion succeeds. 1: none does. 2:
    a mistake in the command.

        aidsr probe runs/2026-01-31_1002_button_pushing_7f3a/designs/1

        aidsr probe scene.xml --task button_pushing --candidates 512

    Parameters
    ----------
    design
        Folder of an approved design, or MJCF of a scene: a robot placed in the environment of a task.
    task
        Benchmark task; not needed for a design, which records its task.
    level
        Level of the task; default: that of the design, for a scene "standard".
    goal
        TOML file that defines how success is measured in your own environment, instead of a task.
    candidates
        Motions to try for each variation, in whole generations of 16: of 100, only 96 are tried. Default: 128; with a
        goal, 256.
    variations
        Number of development variations of the task; each is searched separately.
    max_steps
        Maximum physics steps of all simulations together. Default: 5,000 for each variation and second of the task's
        time limit, at least 300,000; with a goal, at least 1,000,000.
    seed
        Seed of the search; the same seed tries the same motions.
    grouping
        "auto" groups actuators as in the design, or by symmetric limbs; "off" moves each actuator independently.
    threads
        Native threads for physics; 0 uses all processors. Results do not depend on it.
    out
        JSON file for the complete report; a PNG picture of the best motion is written beside it. Default: probe.json in
        the design's folder, no files for a single scene. Existing files are replaced.
    film
        Also write the best motion as MP4 beside the report; requires OpenGL.
    json
        Print the complete report as JSON.
    """
    from rich.markup import escape

    from aidsr import api
    from aidsr.apps.cli.output_file import require_output
    from aidsr.apps.cli.terminal import make_console, write_document
    from aidsr.core.errors import UserError, with_source
    from aidsr.runs import DesignFolder
    from aidsr.runs.files import replace_file

    if out is not None:
        require_output(out, option="--out", suffix=".json")
    kept = out if out is not None else DesignFolder(design).probe if design.is_dir() else None
    if film and kept is None and design.exists():
        raise UserError("--film writes beside the report, and a single scene has none; name one with --out")
    began, next_line = time.monotonic(), 0
    told = make_console(to_stderr=True)

    def listen(point: ProbePoint) -> None:
        nonlocal next_line
        left = format_time_left(point.candidates - point.motions, point.motions / (time.monotonic() - began))
        counts = (point.motions, point.candidates, point.solved, point.variations)
        line = probe_line(*counts, point.progress, left)
        status.update(line)
        if not told.is_terminal and point.motions >= next_line:
            next_line = point.motions + point.candidates // 10
            told.print(line, style="dim", soft_wrap=True)

    with told.status("trying motions") as status, with_source(design):
        report = api.probe(
            design,
            task or "",
            level=level,
            goal=goal or "",
            grouping=grouping,
            candidates=candidates,
            variations=variations,
            max_steps=max_steps,
            seed=seed,
            threads=threads,
            listen=listen,
        )
    if kept is not None:
        replace_file(kept, _as_json(report).encode())
    if json:
        write_document(_as_json(report))
    else:
        _print(make_console(), report, kept)
    if kept is not None:
        played = api.film(design, report, task or "", level=level, goal=goal or "")
        drawn = _draw(played, kept, film=film)
        if not json:
            make_console(soft_wrap=True).print(f"Best motion drawn in {escape(', '.join(drawn))}", style="dim")
    return 0 if report.success_share else 1


def _draw(played: Film, kept: Path, *, film: bool) -> list[str]:
    """Write the picture and, with `film`, the video of a motion beside its report, and return the paths."""
    from aidsr.runs.files import replace_file

    drawn = {".png": played.strip(), ".mp4": played.video() if film else None}
    files = [(kept.with_suffix(suffix), data) for suffix, data in drawn.items() if data is not None]
    for file, data in files:
        replace_file(file, data)
    return [str(file) for file, _ in files]


def _as_json(report: ProbeReport) -> str:
    return report.model_dump_json(indent=2) + "\n"


def _print(console: Console, report: ProbeReport, kept: Path | None) -> None:
    """Print the progress of the robot in each variation, and the best motions."""
    from rich.markup import escape
    from rich.table import Table

    solved = report.won
    all_of_them = len(report.variations)
    console.print(
        f"[bold]{escape(report.task)}[/]: [bold]{solved} of {all_of_them}[/] variations solved; "
        f"best single motion solves {round(report.same_motion_share * all_of_them)} of {all_of_them}; "
        f"mean best progress {report.progress:.2f}",
        soft_wrap=True,
    )
    table = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0), header_style="dim")
    for title in ("variation", "ended", "best progress", "final", "time", "best motion"):
        table.add_column(title, overflow="fold")
    for one in report.variations:
        episode = one.episode
        ended = f"[green]{episode.ended}[/]" if episode.ended == "succeeded" else episode.ended.replace("_", " ")
        row = (str(episode.variation), ended, f"{episode.best_progress:.2f}", f"{episode.progress:.2f}")
        table.add_row(*row, f"{episode.time_s:.1f} s", escape(one.motion.summary))
    console.print(table)
    for line in ends_in_words([one.episode for one in report.variations], report.hold_s):
        console.print(escape(line), soft_wrap=True)
    why = report.why_ended + " (--max-steps)" * (report.ended_by == "budget")
    console.print(f"{report.simulated_s:.0f} s of simulation in {report.wall_s:.0f} s; {why}", style="dim")
    if kept is not None:
        console.print(f"Report written to {escape(str(kept))}", soft_wrap=True)
