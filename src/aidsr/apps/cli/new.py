"""`aidsr new`."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

Like = Literal["touch", "grasp", "carry", "turn", "crawl"]


def new(name: Path, /, *, like: Like = "touch") -> int:
    """Write a template for a job of your own: an environment, a goal and a script that checks them.

    Edit the three files, then run `aidsr check` and `aidsr design` on them. Existing files are never changed.

        aidsr new tap --like turn

    Parameters
    ----------
    name
        Folder to create.
    like
        Kind of job that is most similar to yours.
    """
    import shlex

    from rich.markup import escape

    from aidsr.apps.cli.terminal import make_console
    from aidsr.core.errors import UserError
    from aidsr.examples import templates

    if name.exists():
        raise UserError(f"{name} exists already; name a new folder")
    if not name.parent.is_dir():
        raise UserError(f"cannot create {name}: the folder {name.parent} does not exist")
    example = templates()[like]
    name.mkdir()
    for file, text in (
        ("environment.xml", example.environment.replace(f'model="{example.name}"', f'model="{_plain(name.name)}"')),
        ("goal.toml", example.goal),
        ("check.py", _CHECK),
    ):
        (name / file).write_text(text, encoding="utf-8")
    print_ = make_console(soft_wrap=True).print
    print_(f"{example.title}: [bold]{escape(str(name))}[/] contains environment.xml, goal.toml and check.py.")
    print_("Edit these files, and check them after each change:", style="dim")
    environment, goal = (shlex.quote(str(name / file)) for file in ("environment.xml", "goal.toml"))
    print_(escape(f"  aidsr check {environment} {goal}"))
    print_("Then design a robot:", style="dim")
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

    # Reads both files, rejects a goal that cannot be met, and tests the goal with the best of a few built-in robots.
    found = check_goal(here / "environment.xml", here / "goal.toml", listen=print)

    # What the design team gets: what varies between episodes, what success is, what is penalized.
    for title, words in found.judging.items():
        print(f"{title}: {words}")

    # Where a robot can be mounted, and how far the target is from there.
    for mount in found.mounts:
        print(f"Mount: {mount}")

    # A goal measures nothing if a robot meets it without actions or with random actions.
    if found.blind:
        print(f"Of {found.blind.episodes} episodes, {found.blind.idle} succeed without actions,", end=" ")
        print(f"{found.blind.noise} with random actions.")

    # Progress of a robot that was not designed for this job: 1 means done already, 0 may mean impossible.
    if found.probe:
        print(f"{found.reference} reaches progress {found.probe.progress:.2f}: {found.probe.reached}")

    # Look at both pictures: is everything where you expect it?
    (here / "check.png").write_bytes(found.picture)
    if found.strip:
        (here / "check_motion.png").write_bytes(found.strip)

    for problem in found.problems:
        print(problem)


if __name__ == "__main__":  # the physics runs in child processes, which import this file
    main()
'''
