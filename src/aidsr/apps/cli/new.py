"""`aidsr new`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

Like = Literal["reach", "grasp", "carry", "turn", "crawl"]


def new(name: Path, /, *, like: Like = "reach") -> int:
    """Write an environment, a goal and a check of them, to change into a job of your own.

        aidsr new tap --like turn

    Parameters
    ----------
    name
        Folder to make.
    like
        The kind of job that is nearest to yours.
    """
    import shlex

    from rich.markup import escape

    from aidsr.apps.cli.terminal import make_console
    from aidsr.core.errors import UserError
    from aidsr.examples import templates

    if name.exists():
        raise UserError(f"{name} exists already; name a new folder")
    if not name.parent.is_dir():
        raise UserError(f"cannot make {name}: there is no folder {name.parent}")
    example = templates()[like]
    name.mkdir()
    for file, text in (
        ("environment.xml", example.environment.replace(f'model="{example.name}"', f'model="{_plain(name.name)}"')),
        ("goal.toml", example.goal),
        ("check.py", _CHECK),
    ):
        (name / file).write_text(text, encoding="utf-8")
    print_ = make_console(soft_wrap=True).print
    print_(f"{example.title}: [bold]{escape(str(name))}[/] has environment.xml, goal.toml and check.py.")
    print_("Change them, and look at what you have after each change:", style="dim")
    environment, goal = (shlex.quote(str(name / file)) for file in ("environment.xml", "goal.toml"))
    print_(escape(f"  aidsr check {environment} {goal}"))
    print_("Then design for it:", style="dim")
    print_(escape(f"  aidsr design {shlex.quote(example.objective)} --environment {environment} --goal {goal}"))
    return 0


def _plain(name: str) -> str:
    """Return a name that needs no quoting in XML."""
    return "".join(letter if letter.isalnum() or letter in "_- " else "_" for letter in name)


_CHECK = '''"""What `aidsr check environment.xml goal.toml` does, step by step. Run it: python check.py"""

from pathlib import Path

from aidsr.teams.fitting.check import check_goal


def main() -> None:
    here = Path(__file__).parent

    # Reads both files, refuses a goal that cannot be met, and plays the built-in body that comes farthest of a few.
    found = check_goal(here / "environment.xml", here / "goal.toml", listen=print)

    # What a team of designers is told: what differs between episodes, what success is, what counts against it.
    for title, words in found.judging.items():
        print(f"{title}: {words}")

    # Where a robot may stand, and how far the place of work is from there.
    for mount in found.mounts:
        print(f"Mount: {mount}")

    # A goal is no measure if a body meets it that does nothing, or anything.
    if found.blind:
        print(f"Doing nothing wins {found.blind.idle} of {found.blind.episodes}, anything {found.blind.noise}.")

    # How far a body comes that was not designed for it: 1 would be done already, 0 may be out of everybody's reach.
    if found.probe:
        print(f"{found.reference} comes to progress {found.probe.progress:.2f}: {found.probe.reached}")

    # Look at both: is everything where you meant it to be?
    (here / "check.png").write_bytes(found.picture)
    if found.strip:
        (here / "check_motion.png").write_bytes(found.strip)

    for problem in found.problems:
        print(problem)


if __name__ == "__main__":  # the physics runs in child processes, which import this file
    main()
'''
