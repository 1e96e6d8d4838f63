"""The command line. Each command has its own file and imports its dependencies only when it is called."""

from __future__ import annotations

import os
import signal
import sys
from typing import TYPE_CHECKING, get_args

from cyclopts import App, ArgumentCollection, CoercionError, CycloptsError, CycloptsPanel, UnusedCliTokensError

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

if TYPE_CHECKING:
    from rich.panel import Panel


def _format_error(error: CycloptsError) -> Panel:
    """Return the panel that shows a mistake in a command line."""
    from aidsr.apps.cli.terminal import printable

    if isinstance(error, UnusedCliTokensError):
        words = " ".join(error.unused_tokens or ())
        return CycloptsPanel(printable(f"Unexpected words: {words}; put an objective in quotes"))
    return CycloptsPanel(printable(str(error)))


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
    error_formatter=_format_error,
    config=_refuse_fractions,
)

for command in (
    design.design,
    resume.resume,
    show.show,
    tasks.tasks,
    new.new,
    check.check,
    evolve.evolve,
    validate.validate,
    fix.fix,
    rules.rules,
    view.view,
    probe.probe,
    train.train,
    evaluate.evaluate,
    export.export,
    web.web,
    mcp.mcp,
    benchmark.benchmark,
    benchmark.report,
    benchmark.compare,
    benchmark.submit,
    benchmark.leaderboard,
    doctor.doctor,
):
    app.command(command)
app.command(import_robot.import_robot, name="import")
app.command(memory.memory)


def main(arguments: list[str] | None = None) -> None:
    """Run a command line and exit.

    Exit codes: 2 for a mistake in the command or in a given file, and for a full or unwritable disk; 1 for any other
    expected error; 130 if interrupted; else the code of the command.
    """
    # A scheduler or the web app ends a command with SIGTERM: handled like Control-C, so that finished work is kept.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        code = app(arguments)
        sys.stdout.flush()
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
