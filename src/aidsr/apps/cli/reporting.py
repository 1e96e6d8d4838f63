"""Output about a run in the terminal: its introduction, its result, its status."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import urlsplit

from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from aidsr.core.config import BUILTIN
from aidsr.core.errors import UserError
from aidsr.core.formatting import format_cost, format_duration, format_tokens
from aidsr.runs import DesignStatus, Run, RunStatus, read_status
from aidsr.runs.files import JsonFile
from aidsr.runs.trainings import trainings_of, verdict_in_words
from aidsr.teams.providers import destination, is_offline, provider_of
from aidsr.teams.providers.manual import prompts_directory

_COLOR = {"approved": "green", "invalid": "red", "quit": "yellow", "stopped": "red", "waiting": "yellow"}


def print_introduction(console: Console, run: Run) -> None:
    """Print the objective, the model and its cost, and the folder of a run."""
    record = run.asked()
    provider = provider_of(record.config.model)
    console.print(f"[bold]{escape(record.objective)}[/]")
    if record.config.model == BUILTIN:
        console.print(
            f"Model: [cyan]builtin[/], seed {record.config.seed}. These are fixed rules, not a language model: "
            "no API key is used and there is no cost."
        )
    elif is_offline(record.config.model):
        console.print(
            f"Model: [cyan]{escape(record.config.model)}[/]. This is not a language model: no API key is used and "
            "there is no cost."
        )
    elif prompts_directory(record.config.model):
        console.print(
            f"Model: [cyan]{escape(record.config.model)}[/]. Each prompt is written there as a file and waits until "
            "you save the reply beside it. You can interrupt with Control-C and continue with `aidsr resume`."
        )
    elif provider is not None and provider.is_free:
        console.print(f"Model: [cyan]{escape(record.config.model)}[/]. Its calls are free.")
    elif _is_local(record.config.model):
        console.print(f"Model: [cyan]{escape(record.config.model)}[/]. Its server runs on this machine.")
    else:
        console.print(f"Model: [cyan]{escape(record.config.model)}[/]. Every call may cost money.")
    console.print(f"Folder: {escape(str(run.path))}\n", soft_wrap=True)


def _is_local(model: str) -> bool:
    """Return whether the prompts for a model stay on this machine."""
    address = destination(model).partition(" ")[0]
    return urlsplit(address).hostname in ("localhost", "127.0.0.1", "::1")


def print_status(console: Console, run: Run, status: RunStatus) -> None:
    """Print a table of the designs, the reasons for failures, the trainings, and the path of the summary page.

    Only the designs in `status` are printed, which may be fewer than those of the run.
    """
    _print_designs(console, status.designs)
    measured = run.asked().config.team == "measuring"
    for design in status.designs:
        _print_reason(console, design, also_approved=measured)
    for design in status.designs:
        for training in trainings_of(run.design(design.number)):
            console.print(f"design {design.number}, {escape(verdict_in_words(training))}", soft_wrap=True)
    if status.stopped:
        console.print(f"\nStopped: {escape(status.stopped.message)}", soft_wrap=True)
    if run.summary.exists():
        console.print(f"\nOpen [bold]{escape(str(run.summary))}[/]", soft_wrap=True)
    if status.state != "finished":
        when = "Resume" if status.state == "stopped" else "If no process is running it, resume"
        console.print(f"{when} with [bold]aidsr resume {escape(shlex.quote(str(run.path)))}[/]", soft_wrap=True)


def print_probes(console: Console, run: Run, status: RunStatus) -> None:
    """Print one line for each design of a status that was probed."""
    from aidsr.learn.openloop.report import ProbeReport

    for folder in (run.design(design.number) for design in status.designs):
        report = JsonFile(folder.probe, ProbeReport).read()
        if report is not None:
            console.print(
                f"design {folder.number}, probe: {report.won} of {len(report.variations)} variations solved, mean best "
                f"progress {report.progress:.2f}",
                soft_wrap=True,
            )


def print_runs(console: Console, runs: Sequence[Run]) -> None:
    """Print one line for each run: its name, its task or objective, and how many designs are approved."""
    table = Table(box=None, pad_edge=False, padding=(0, 3, 0, 0), header_style="dim")
    for title in ("run", "approved", "task or objective"):
        table.add_column(title)
    for run in runs:
        try:
            status = read_status(run)
            cells = f"{status.approved} of {len(status.designs)}", status.record.task or status.record.objective
        except UserError as error:
            cells = "–", str(error)
        table.add_row(escape(run.name), *map(escape, cells))
    print_unwrapped(console, table)


def _print_designs(console: Console, designs: Sequence[DesignStatus]) -> None:
    """Print a table with one row for each design, or two lines for each if the table is too wide for the terminal."""
    rows = [(design, _facts(design)) for design in designs]
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    table.add_column("design")
    table.add_column("concept")
    for title in rows[0][1] if rows else ():
        cells = [title, *(facts[title] for _, facts in rows)]
        table.add_column(title, min_width=max(Text.from_markup(cell).cell_len for cell in cells))
    for design, facts in rows:
        table.add_row(str(design.number), escape(design.concept), *facts.values())
    whole = console.options.update(max_width=10_000)
    if console.measure(table, options=whole).maximum <= console.width:
        console.print(table)
        return
    for design, facts in rows:
        console.print(f"design {design.number}: {escape(design.concept)}: {facts.pop('state')}")
        console.print(Padding("; ".join(f"[dim]{title}:[/] {value}" for title, value in facts.items()), (0, 0, 0, 2)))


def _facts(design: DesignStatus) -> dict[str, str]:
    """Return the state, counts and cost of a design, by column title, as rich markup."""
    state = design.outcome.outcome if design.outcome else design.state
    return {
        "state": f"[{_COLOR.get(state, 'cyan')}]{state}[/]",
        "iterations": str(design.iteration),
        "fixes": str(design.mechanical_repairs),
        "tokens": format_tokens(design.usage),
        "cost": format_cost(design.usage),
        "time": format_duration(design.latency_s),
    }


def print_result(console: Console, run: Run) -> int:
    """Print how the run ended; return 0 if at least one design is approved, else 1."""
    status = read_status(run)
    console.print()
    print_status(console, run, status)
    return 0 if status.approved else 1


def print_unwrapped(console: Console, table: Table) -> None:
    """Print a table with each row on one line, regardless of the width of the console, so that paths stay complete.

    Lines are not padded to the width of the table.
    """
    wide = console.options.update(width=10_000)
    table.width = console.measure(table, options=wide).maximum
    for segments in console.render_lines(table, wide, pad=False):
        line = Text.assemble(*((segment.text, segment.style or "") for segment in segments))
        line.rstrip()
        console.print(line, soft_wrap=True)


def print_files(console: Console, folder: Path) -> None:
    """Print the files in the folder of a run or of a design as a tree of relative paths."""
    from rich.tree import Tree

    root = Tree(f"[bold]{escape(str(folder))}[/]", guide_style="dim")
    branches = {folder: root}
    for path in sorted(folder.rglob("*")):
        if not path.name.startswith("."):
            branches[path] = branches[path.parent].add(escape(path.name))
    console.print()
    console.print(root)


def _print_reason(console: Console, design: DesignStatus, *, also_approved: bool) -> None:
    """Print why a design stopped or was not approved, and the traceback of a bug.

    With `also_approved`, also print the reason of an approved design.
    """
    if design.stopped and not design.outcome:
        console.print(f"\nDesign {design.number} stopped: {escape(design.stopped.message)}", soft_wrap=True)
        if design.stopped.traceback:
            console.print(escape(design.stopped.traceback), style="dim", soft_wrap=True)
    elif design.outcome and (also_approved or design.outcome.outcome != "approved"):
        console.print(
            f"\nDesign {design.number}, {design.outcome.outcome}: {escape(design.outcome.reason)}", soft_wrap=True
        )
