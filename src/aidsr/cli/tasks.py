"""`aidsr tasks`."""

from __future__ import annotations

__all__ = ["tasks"]


def tasks() -> int:
    """List the benchmark tasks.

    Each comes with an objective, an environment, variations and a measure of success.

        aidsr tasks

        aidsr design --task button_pushing
    """
    from rich.console import Console
    from rich.table import Table

    from aidsr.tasks import load_task, task_names

    table = Table(box=None, pad_edge=False, padding=(0, 3, 1, 0), header_style="dim")
    for title in ("task", "levels", "objective"):
        table.add_column(title, overflow="fold", vertical="top")
    for name in task_names():
        task = load_task(name)
        table.add_row(f"[bold]{name}[/]", "standard, hard" if task.hard else "standard", task.objective)
    Console().print(table)
    return 0
