"""`aidsr show`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from aidsr.apps.cli.flag import Flag

if TYPE_CHECKING:
    from aidsr.runs import Run


def show(
    run: Path | None = None,
    /,
    *,
    json: Flag = False,
    layout: Flag = False,
) -> int:
    """Show the status of a run, or of one of its designs, and the files it holds, or list the runs in a folder.

    Works while the run is in progress as well.

        aidsr show runs/2026-01-31_1002_button_pushing_7f3a

        aidsr show runs/2026-01-31_1002_button_pushing_7f3a/designs/1

        aidsr show runs/2026-01-31_1002_button_pushing_7f3a --json

        aidsr show runs

        aidsr show --layout

    Parameters
    ----------
    run
        Folder of the run or of a design, or a folder of runs.
    json
        Print the status as JSON.
    layout
        Print which files a run may contain, and what is in them.
    """
    from rich.markup import escape

    from aidsr.apps.cli.terminal import make_console, write, write_document
    from aidsr.core.errors import UserError
    from aidsr.runs import RUN_FILE, Library, layout_text, read_status

    if layout:
        write(layout_text() + "\n")
        return 0
    if run is None:
        raise UserError("no run given; give the folder of a run, for example a folder in runs/")
    if not json and not (run / RUN_FILE).exists() and (runs := Library(run).runs()):
        from aidsr.apps.cli.reporting import print_runs

        print_runs(make_console(), runs)
        return 0
    found, number = _run_and_design(run)
    status = read_status(found)
    if number is not None:
        status = status.model_copy(update={"designs": (status.design(number),)})
    if json:
        write_document(status.model_dump_json(indent=2) + "\n")
        return 0
    from aidsr.apps.cli.reporting import print_files, print_probes, print_status

    console = make_console()
    console.print(f"[bold]{escape(status.record.task or status.record.objective)}[/]", soft_wrap=True)
    print_status(console, found, status)
    print_probes(console, found, status)
    print_files(console, run)
    return 0


def _run_and_design(path: Path) -> tuple[Run, int | None]:
    """Return the run at a path, and the number of the design if the path is that of a design's folder."""
    from aidsr.core.numbered import is_number
    from aidsr.runs import DesignFolder, Run

    full = path.resolve()
    if full.parent.name == "designs" and is_number(full.name):
        return DesignFolder(path).run, int(full.name)
    return Run(path), None
