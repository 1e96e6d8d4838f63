"""`aidsr check`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from aidsr.apps.cli.flag import Flag

if TYPE_CHECKING:
    from aidsr.teams.fitting.check import GoalCheck


def check(
    environment: Path,
    goal: Path,
    /,
    *,
    out: Path | None = None,
    seed: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    json: Flag = False,
) -> int:
    """Check your own environment and goal before you design for them.

    Draws the environment, prints what is judged, where a robot can be mounted and how far away the target is, and tests
    the goal with a built-in robot: without actions, with random actions and with open-loop motions. Exit code 0: the
    goal is a valid measure. 1: a robot succeeds without actions or with random actions, a target moves by itself, or no
    robot could be placed for the test. 2: a mistake in a file.

        aidsr check environment.xml goal.toml

    Parameters
    ----------
    environment
        MJCF of the environment, without the robot.
    goal
        TOML file of the goal.
    out
        PNG file of the picture; the picture of the motion is written beside it. Default: check.png beside the goal.
    seed
        Seed of the robot and of the random actions.
    json
        Print everything as JSON, without the pictures.
    """
    from rich.markup import escape

    from aidsr.apps.cli.terminal import make_console, write_document
    from aidsr.core.errors import MjcfError, UserError
    from aidsr.runs.files import replace_file
    from aidsr.teams.fitting.check import check_goal

    picture = out or goal.parent / "check.png"
    if picture.suffix.lower() != ".png":
        raise UserError(f"--out {picture} is not a PNG file; give a file name that ends in .png")
    if not picture.parent.is_dir():
        raise UserError(f"cannot write {picture}: the folder {picture.parent} does not exist")
    console = make_console(to_stderr=True, soft_wrap=True)
    with console.status("reading the files") as status:

        def listen(step: str) -> None:
            console.print(escape(step), style="dim")
            status.update(escape(step))

        try:
            found = check_goal(environment, goal, seed=seed, listen=listen)
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
        _print(found, drawn)
    return 1 if found.problems else 0


def _print(found: GoalCheck, drawn: list[Path]) -> None:
    from rich.markup import escape

    from aidsr.apps.cli.terminal import make_console

    say = make_console(soft_wrap=True).print
    for line in found.lines[: len(found.lines) - len(found.problems)]:
        title, _, words = line.partition(": ")
        say(f"[bold]{escape(title)}[/]: {escape(words)}")
    for problem in found.problems:
        say(f"[red]{escape(problem)}[/]")
    say(f"Picture: {escape('; best motion: '.join(str(file) for file in drawn))}", style="dim")
