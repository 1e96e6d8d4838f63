"""`aidsr memory`."""

from __future__ import annotations

from pathlib import Path

from cyclopts import App

from aidsr.apps.cli.flag import Flag

memory = App(name="memory", help="Collect measurements of runs, and show which lessons a designer gets.")


@memory.command
def add(file: Path, /, *runs: Path) -> int:
    """Add the measurements of runs with --task-feedback, or of the measuring team, to a memory.

    Exit code 0: at least one run has measurements. 1: none has. 2: a mistake in the command.

        aidsr memory add lessons.jsonl runs/*

    Parameters
    ----------
    file
        File of the memory; it is created if it does not exist.
    runs
        Folders of runs.
    """
    from aidsr.apps.cli.terminal import write
    from aidsr.core.errors import UserError
    from aidsr.memory import Memory
    from aidsr.memory.collecting import lessons_of
    from aidsr.runs import Run

    if not runs:
        raise UserError("no run given; give the folders of runs, for example runs/*")
    found = {run: lessons_of(Run(run)) for run in runs}
    new = Memory(file).add(lesson for lessons in found.values() for lesson in lessons)
    empty = [str(run) for run, lessons in found.items() if not lessons]
    write(f"{file}: {new} new, {len(Memory(file).lessons())} in total\n")
    if empty:
        write(f"no measurements (no --task-feedback, no measuring team, or no stable scene) in: {', '.join(empty)}\n")
    return 0 if len(empty) < len(found) else 1


@memory.command
def show(file: Path, /, *, task: str | None = None, objective: str | None = None, without_task: Flag = False) -> int:
    """Print the lessons that a designer gets for a task or an objective; without one, print all lessons.

    Exit code 0: lessons were printed. 1: there are none. 2: a mistake in the command.

        aidsr memory show lessons.jsonl --task tunnel

    Parameters
    ----------
    file
        File of the memory.
    task
        Benchmark task; `aidsr tasks` lists the tasks.
    objective
        Objective in words, instead of a task.
    without_task
        Leave out the lessons of the task itself, so that only lessons of other tasks are printed; with --task.
    """
    from aidsr.apps.cli.terminal import write
    from aidsr.core.errors import UserError
    from aidsr.memory import Memory
    from aidsr.tasks import load_task

    if task and objective:
        raise UserError("both a task and an objective are given; give only one of them")
    if file.is_dir():
        raise UserError(f"{file} is a folder; give the file of a memory, which aidsr memory add makes")
    if not file.is_file():
        raise UserError(f"the memory {file} does not exist; make it with aidsr memory add {file} RUN")
    kept = Memory(file)
    if task or objective:
        brief = load_task(task).brief() if task else None
        left_out = (brief.task,) if brief and without_task else ()
        told = kept.tell(
            brief.objective if brief else objective or "", brief.base if brief else "any", without=left_out
        )
    else:
        told = tuple(f"Job: {lesson.job} {lesson.text()}" for lesson in kept.lessons())
    for text in told:
        write(f"- {text}\n")
    return 0 if told else 1
