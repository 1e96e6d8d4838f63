"""The command line. Each command has its own file and imports its dependencies only when it is called."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from typing import get_args

from cyclopts import App, ArgumentCollection, CoercionError, CycloptsError, Group, UnusedCliTokensError

from aidsr import __version__
from aidsr.apps.cli import (
    benchmark,
    check,
    design,
    doctor,
    evaluate,
    evolve,
    export,
    fix,
    import_robot,
    mcp,
    memory,
    new,
    probe,
    resume,
    rules,
    show,
    tasks,
    train,
    validate,
    view,
    web,
)
from aidsr.core.errors import AidsrError, MjcfError, UserError
from aidsr.core.storage_errors import storage_problem


def _mistake(error: CycloptsError) -> str:
    """Return the sentence that tells a mistake in a command line."""
    if isinstance(error, UnusedCliTokensError):
        return f"Unexpected words: {' '.join(error.unused_tokens or ())}; put an objective in quotes"
    return " ".join(str(error).split())


def _refuse_fractions(_app: App, _commands: tuple[str, ...], arguments: ArgumentCollection) -> None:
    """Refuse a fraction as the value of an integer option, because cyclopts would round it silently.

    Raises:
        CoercionError: The value of an integer option has a decimal point.
    """
    for argument in arguments:
        if int in (argument.hint, *get_args(argument.hint)):
            for token in argument.tokens:
                if "." in token.value:
                    raise CoercionError(argument=argument, token=token, target_type=int)


app = App(
    name="aidsr",
    version=__version__,
    help="""Design tendon-driven continuum robots from a description in words.

    Describe what the robot should do, and where. A team of four roles designs it in MuJoCo, measured faults are
    repaired, and all results are stored in one folder. The team consists of built-in rules unless you name a language
    model.

    Start with `aidsr design --task button_pushing`.""",
    help_format="markdown",
    version_flags=["--version"],
    result_action="return_value",
    config=_refuse_fractions,
)

_GROUPS: dict[str, tuple[Callable[..., int] | App, ...]] = {
    "Design robots": (design.design, resume.resume, show.show, evolve.evolve, memory.memory),
    "Tasks and jobs of your own": (tasks.tasks, new.new, check.check),
    "Check robots": (validate.validate, fix.fix, import_robot.import_robot, rules.rules, view.view),
    "Control and build a robot": (probe.probe, train.train, evaluate.evaluate, export.export),
    "Studies of many runs": (
        benchmark.benchmark,
        benchmark.report,
        benchmark.compare,
        benchmark.submit,
        benchmark.leaderboard,
    ),
    "Other ways to use it": (web.web, mcp.mcp, doctor.doctor),
}
"""The commands in the order in which they are listed, by the title of their list."""
_NAMES = {import_robot.import_robot: "import"}
"""Names of commands that are not those of their functions."""

for _title, _commands in _GROUPS.items():
    _group = Group.create_ordered(_title)
    for _position, _command in enumerate(_commands):
        if isinstance(_command, App):
            _command.group, _command.sort_key = _group, _position
            app.command(_command)
        else:
            app.command(_command, name=_NAMES.get(_command), group=_group, sort_key=_position)
app["--help"].group = app["--version"].group = Group.create_ordered("Help")


def main(arguments: list[str] | None = None) -> None:
    """Run a command line and exit.

    Exit codes: 2 for a mistake in the command or in a given file, and for a full or unwritable disk; 1 for any other
    expected error; 130 if interrupted; else the code of the command.
    """
    # A scheduler or the web app ends a command with SIGTERM: handled like Control-C, so that finished work is kept.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        code = app(arguments, exit_on_error=False, print_error=False)
        sys.stdout.flush()
    except CycloptsError as error:
        _print_error(_mistake(error))
        code = 2
    except (UserError, MjcfError) as error:
        _print_error(error)
        code = 2
    except AidsrError as error:
        _print_error(error)
        code = 1
    except BrokenPipeError:  # the reader closed the pipe, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 128 + signal.SIGPIPE
    except OSError as error:
        problem = storage_problem(error)
        if problem is None:
            raise
        _print_error(problem)
        code = 2
    except KeyboardInterrupt:
        code = 130
    sys.exit(code)


def _print_error(error: AidsrError | str) -> None:
    from rich.markup import escape

    from aidsr.apps.cli.terminal import make_console

    make_console(to_stderr=True, soft_wrap=True).print(f"[bold red]aidsr:[/] {escape(str(error))}")
