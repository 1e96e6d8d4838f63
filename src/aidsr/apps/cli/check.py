"""`aidsr check`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

if TYPE_CHECKING:
    from aidsr.teams.fitting.check import GoalCheck


def check(
    environment: Path,
    goal: Path,
    /,
    *,
    out: Path | None = None,
    seed: Annotated[int, Parameter(validator=Number(gte=0))] = 0,
    json: Annotated[bool, Parameter(negative="", show_default=False)] = False,
) -> int:
    """Look at an environment and a goal of your own before anything is designed.

    Draws it, says what is judged, where robots may stand and how far the work is, and tries it with a built-in body:
    doing nothing, doing anything, and with open-loop motions. Exit code 0 means that it measures something, 1 that a
    body wins by doing nothing or anything or that none could be placed to try it, 2 a mistake in a file.

        aidsr check environment.xml goal.toml

    Parameters
    ----------
    environment
        MJCF of everything but the robot.
    goal
        TOML file of the goal.
    out
        Picture to write, and beside it the motion; check.png beside the goal unless named.
    seed
        Of the body and the random actions.
    json
        Print everything as JSON, without the pictures.
    """
    from aidsr.apps.cli.terminal import make_console, write_document
    from aidsr.core.errors import MjcfError, UserError
    from aidsr.runs.files import replace_file
    from aidsr.teams.fitting.check import check_goal

    picture = out or goal.parent / "check.png"
    if picture.suffix.lower() != ".png":
        raise UserError(f"--out writes PNG; name a file that ends in .png, found {picture}")
    if not picture.parent.is_dir():
        raise UserError(f"cannot write {picture}: there is no folder {picture.parent}")
    with make_console(to_stderr=True).status("reading") as status:
        try:
            found = check_goal(environment, goal, seed=seed, listen=status.update)
        except MjcfError as error:
            raise UserError(f"the environment {environment} cannot be loaded: {error}") from None
    strip = picture.with_name(f"{picture.stem}_motion.png")
    replace_file(picture, found.picture)
    if found.strip:
        replace_file(strip, found.strip)
    if json:
        write_document(found.model_dump_json(indent=2, exclude={"picture", "strip", "scene"}) + "\n")
    else:
        _print(found, picture, strip)
    return 1 if found.problems else 0


def _print(found: GoalCheck, picture: Path, strip: Path) -> None:
    from rich.markup import escape

    from aidsr.apps.cli.terminal import make_console

    say = make_console(soft_wrap=True).print
    for title, words in found.judging.items():
        say(f"[bold]{escape(title)}[/]: {escape(words)}")
    for mount in found.mounts:
        say(f"[bold]Mount[/]: {escape(mount)}")
    if not found.mounts:
        say('[bold]Mount[/]: none; a robot stands at the origin, "world"')
    if found.blind:
        blind = found.blind
        say(
            f"[bold]Doing nothing[/] wins {blind.idle} of {blind.episodes} episodes, progress at most "
            f"{blind.idle_progress:.2f}; [bold]doing anything[/] wins {blind.noise}, at most {blind.noise_progress:.2f}"
        )
    if found.probe:
        say(
            f"[bold]A built-in body[/], {escape(found.reference)}, comes to progress {found.probe.progress:.2f} with "
            f"open-loop motions: {escape(found.probe.reached)}"
        )
    for problem in found.problems:
        say(f"[red]{escape(problem)}[/]")
    drawn = f"{picture}" + (f", its best motion in {strip}" if found.strip else "")
    say(f"Drawn in {escape(drawn)}", style="dim")
