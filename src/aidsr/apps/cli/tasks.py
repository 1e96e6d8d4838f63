"""`aidsr tasks`."""

from __future__ import annotations

from aidsr.apps.cli.flag import Flag


def tasks(*, page: Flag = False) -> int:
    """List the benchmark tasks.

    Each task has an objective, an environment, variations and a measure of success.

        aidsr tasks

        aidsr design --task button_pushing

    Parameters
    ----------
    page
        Print the complete reference of the benchmark tasks as Markdown.
    """
    from rich.table import Table

    from aidsr.apps.cli.reporting import print_unwrapped
    from aidsr.apps.cli.terminal import make_console, write_document
    from aidsr.tasks import TASKS, load_task, task_names
    from aidsr.tasks.reference import task_reference

    if page:
        write_document(task_reference(TASKS.values()))
        return 0
    table = Table(box=None, pad_edge=False, padding=(0, 3, 1, 0), header_style="dim")
    for title in ("task", "levels", "objective"):
        table.add_column(title, overflow="fold", no_wrap=title == "task", vertical="top")
    for name in task_names():
        task = load_task(name)
        table.add_row(f"[bold]{name}[/]", "standard, hard" if task.hard else "standard", task.objective)
    console = make_console()
    if console.is_terminal:
        console.print(table)
    else:
        print_unwrapped(console, table)
    return 0
