"""`aidsr check`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from aidsr.apps.cli.flag import Flag

if TYPE_CHECKING:
    from collections.abc import Iterable


def check(
    environment: Path,
    goal: Path | None = None,
    /,
    *,
    out: Path | None = None,
    seed: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    json: Flag = False,
) -> int:
    """Check your own environment and goal before you design for them.

    Draws the environment, prints what is judged, where a robot can be mounted and how far away the target is, and tests
    the goal with a built-in robot: without actions, with random actions and with open-loop motions. Exit code 0: the
    goal is a valid measure. 1: a robot succeeds without actions or with random actions, a target moves by itself, no
    robot could be placed for the test, a mount is misspelt, or the target is far out of reach. 2: a mistake in a file.

        aidsr check environment.xml goal.toml

        aidsr check environment.xml

    Parameters
    ----------
    environment
        MJCF of the environment, without the robot.
    goal
        TOML file of the goal. Without it, only the environment is described.
    out
        PNG file of the picture; the picture of the motion is written beside it. Default: check.png beside the goal, or
        beside the environment without a goal.
    seed
        Seed of the robot and of the random actions.
    json
        Print everything as JSON, without the pictures.
    """
    from rich.markup import escape

    from aidsr.apps.cli.output_file import require_output
    from aidsr.apps.cli.terminal import make_console, write_document
    from aidsr.core.errors import MjcfError, UserError
    from aidsr.mjcf.read import open_mjcf
    from aidsr.render.pictures import picture as draw
    from aidsr.runs.files import replace_file
    from aidsr.tasks import goal_task, read_goal
    from aidsr.teams.fitting.check import check_task
    from aidsr.teams.fitting.facts import environment_facts, goal_facts

    picture = out or (goal or environment).parent / "check.png"
    if out is not None:
        require_output(out, option="--out", suffix=".png")
    console = make_console(to_stderr=True, soft_wrap=True)
    try:
        if goal is None:
            mjcf = open_mjcf(environment)
            alone = environment_facts(mjcf)
            replace_file(picture, draw(mjcf))
            if json:
                write_document(alone.model_dump_json(indent=2) + "\n")
            else:
                _print(alone.lines, alone.faults)
                _print(["Next: write a goal; without one nothing can be tried, probed or trained (docs/goals.md)"])
                _print_pictures([picture])
            return 1 if alone.faults else 0
        with console.status("reading the files"):
            task = goal_task(read_goal(goal), open_mjcf(environment))
            facts = goal_facts(task)
        if not json:
            _print(facts.fact_lines)  # before the trials, which take minutes
        with console.status("trying the goal") as status:

            def listen(step: str) -> None:
                console.print(escape(step), style="dim")
                status.update(escape(step))

            found = check_task(task, seed=seed, listen=listen)
    except MjcfError as error:
        raise UserError(f"the environment {environment} cannot be loaded: {error}") from None
    strip = picture.with_name(f"{picture.stem}_motion.png")
    replace_file(picture, found.picture)
    drawn = [picture]
    if found.strip:
        replace_file(strip, found.strip)
        drawn.append(strip)
    else:
        strip.unlink(missing_ok=True)  # the picture of an earlier check would be outdated
    if json:
        write_document(found.model_dump_json(indent=2, exclude={"picture", "strip", "scene"}) + "\n")
    else:
        _print(found.trial_lines, found.problems)
        _print_pictures(drawn)
    return 1 if found.problems else 0


def _print(lines: Iterable[str], problems: Iterable[str] = ()) -> None:
    from rich.markup import escape

    from aidsr.apps.cli.terminal import make_console

    say = make_console(soft_wrap=True).print
    for line in lines:
        title, _, words = line.partition(": ")
        say(f"[bold]{escape(title)}[/]: {escape(words)}")
    for problem in problems:
        say(f"[red]{escape(problem)}[/]")


def _print_pictures(drawn: Iterable[Path]) -> None:
    from rich.markup import escape

    from aidsr.apps.cli.terminal import make_console

    say = make_console(soft_wrap=True).print
    say(f"Picture: {escape('; best motion: '.join(str(file) for file in drawn))}", style="dim")
