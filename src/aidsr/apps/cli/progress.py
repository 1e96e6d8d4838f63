"""Progress of a run: in a terminal, a panel that is updated in place; elsewhere, one line for each event."""

from __future__ import annotations

import contextlib
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.markup import escape
from rich.spinner import Spinner
from rich.table import Table
from rich.text import Text

from aidsr.apps.cli.mailbox import Mailbox
from aidsr.apps.cli.reporting import print_introduction, print_result
from aidsr.apps.cli.review_prompt import ReviewPrompt
from aidsr.apps.cli.terminal import make_console
from aidsr.core.errors import AidsrError
from aidsr.core.formatting import format_cost
from aidsr.loop.parts import Parts
from aidsr.loop.runner import run_designs
from aidsr.runs import Run, read_status
from aidsr.runs.event_text import DOING, sentence
from aidsr.runs.events import Event, StepDone, StepStarted, Stopped, Tried, read_events
from aidsr.runs.status import newest
from aidsr.teams.providers import is_offline


def follow_run(run: Run, parts: Parts, *, then: str = "") -> int:
    """Run the designs and print their progress; return 0 if a design is approved, 1 if none, 130 if interrupted.

    Args:
        run: The run.
        parts: Parts of its loop.
        then: Command for what was requested beyond the designs, which resuming does not do; empty if nothing was.
    """
    console = make_console()
    print_introduction(console, run)
    view: View = Panel(console, run) if console.is_terminal else Lines(console)
    prompt = ReviewPrompt(console, run, view.aside)
    try:
        with view, prompt, Mailbox(console, run.asked().config.model):

            def on_event(number: int, event: Event) -> None:
                view.on_event(number, event)
                prompt.on_event(number, event)

            run_designs(run, parts, on_event)
    except KeyboardInterrupt:
        console.print(f"\nInterrupted. {how_to_resume(run, then)}", soft_wrap=True)
        return 130
    except AidsrError:
        console.print(f"\n{how_to_resume(run, then)}", soft_wrap=True)
        raise
    return print_result(console, run)


def how_to_resume(run: Run, then: str = "") -> str:
    """Return what is kept of a run that was ended early, and how to resume it, as rich markup.

    Args:
        run: The run.
        then: Command to give after resuming; empty if there is none.
    """
    searched = run.concepts.read() is None and any(isinstance(event, Tried) for event in read_events(run.events))
    kept = "Finished work is kept" + ", but not the search over bodies, which starts again" * searched
    after = f", then [bold]{escape(then)}[/] for each approved design N" if then else ""
    return f"{kept}; resume with [bold]aidsr resume {escape(shlex.quote(str(run.path)))}[/]{after}"


class View(Protocol):
    """Display of the events of a run."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def on_event(self, number: int, event: Event) -> None:
        """Show an event of the design `number`, or of the run if `number` is 0."""
        ...

    def aside(self) -> contextlib.AbstractContextManager[None]:
        """Return a context in which the terminal is free for a question."""
        ...


_LONG = ("task_report", "measured_again")
"""Steps of a run that take minutes without printing anything: the searches, and trainings, of a trial."""


class Lines:
    """Display with one line for each event, for log files and pipes."""

    def __init__(self, console: Console) -> None:
        self._console = console

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        pass

    def on_event(self, number: int, event: Event) -> None:
        """Print the text of the event, if it has one, and the beginning of a step that takes minutes.

        Why the run itself stopped is not printed: that error is raised, and the command prints it.
        """
        text = "" if isinstance(event, Stopped) and not number else sentence(event)
        if isinstance(event, StepStarted) and event.step in _LONG:
            text = DOING[event.step]
        iteration = getattr(event, "iteration", None)
        if text:
            place = (f"design {number}  " if number else "") + (f"iteration {iteration}  " if iteration else "")
            self._console.print(escape(place + text), soft_wrap=True)

    def aside(self) -> contextlib.AbstractContextManager[None]:
        """Return a context that does nothing, because printed lines do not disturb a question."""
        return contextlib.nullcontext()


@dataclass
class _Line:
    """State of one design in the panel."""

    concept: str = ""
    iteration: int | None = None
    doing: str = ""
    found: str = ""
    cost: str = ""


class Panel:
    """Display with two lines for each design, updated in place."""

    def __init__(self, console: Console, run: Run) -> None:
        self._run = run
        self._paid = not is_offline(run.asked().config.model)
        self._lines: dict[int, _Line] = {}
        self._spinner = Spinner("dots", style="cyan")
        self._live = Live(self, console=console, refresh_per_second=8, transient=True)

    def __enter__(self) -> Self:
        self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def on_event(self, number: int, event: Event) -> None:
        """Update the state of the design."""
        line = self._lines.setdefault(number, _Line())
        if number and (not line.concept or (isinstance(event, StepDone) and event.step == "concept")):
            concept = newest(it.concept.read() for it in self._run.design(number).leading_to())
            line.concept = concept.name if concept else ""
        line.iteration = getattr(event, "iteration", None) or line.iteration
        line.doing = DOING[event.step] if isinstance(event, StepStarted) else ""
        line.found = sentence(event) or line.found
        if self._paid and number and isinstance(event, StepDone):
            line.cost = format_cost(read_status(self._run).design(number).usage)

    @contextlib.contextmanager
    def aside(self) -> Iterator[None]:
        """Hide the panel while a question is asked."""
        self._live.stop()
        try:
            yield
        finally:
            self._live.start()

    def __rich__(self) -> RenderableType:
        """Draw the panel."""
        designs = {number: line for number, line in sorted(self._lines.items()) if number}
        if not designs:
            story = Text(DOING["concepts"], style="cyan", no_wrap=True, overflow="ellipsis")
            if (run := self._lines.get(0)) and run.found:
                story.append(f"   {run.found}", "default")
            return self._with_mark(story, working=True)
        return Group(*(self._draw(number, line) for number, line in designs.items()))

    def _draw(self, number: int, line: _Line) -> RenderableType:
        title = Text.assemble((f"{number}  {line.concept}", "bold"), no_wrap=True, overflow="ellipsis")
        if line.iteration:
            title.append(f"   iteration {line.iteration}", "dim")
        title.append(f"   {line.cost}", "dim")
        story = Text(no_wrap=True, overflow="ellipsis")
        story.append(line.doing, "cyan").append("   " if line.doing and line.found else "").append(line.found)
        return self._with_mark(Group(title, story), working=bool(line.doing))

    def _with_mark(self, content: RenderableType, *, working: bool) -> RenderableType:
        grid = Table.grid(padding=(0, 1))
        grid.add_row(self._spinner if working else Text("·", style="dim"), content)
        return grid
