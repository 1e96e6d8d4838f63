"""Review of scenes by a person in the terminal. The answer is written to decision.json, as any editor could do."""

from __future__ import annotations

import contextlib
import queue
import select
import shlex
import sys
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.markup import escape

from aidsr.core.artifacts import Decision
from aidsr.runs import IterationFolder, Run
from aidsr.runs.events import Event, Waiting
from aidsr.runs.status import newest

_POLL_S = 0.3
"""Interval between two checks for an answer in decision.json [s]."""

Aside = Callable[[], contextlib.AbstractContextManager[None]]
"""Returns a context in which the terminal is free for a question."""
ReadLine = Callable[[float], str | None]
"""Waits up to the given time [s] for a typed line. Returns it, None if there was none, or "" at the end of input."""


def parse_answer(line: str) -> Decision | None:
    """Return the decision for a typed line: "a" (approve), "q" (quit) or "r WHAT TO CHANGE" (refine); else None."""
    word, _, text = line.strip().partition(" ")
    match word.lower():
        case "a" | "approve":
            return Decision(verdict="approve")
        case "q" | "quit":
            return Decision(verdict="quit", text=text.strip())
        case "r" | "refine" if text.strip():
            return Decision(verdict="refine", text=text.strip())
        case _:
            return None


def read_line(wait_s: float) -> str | None:
    """Return a line typed at the terminal within `wait_s` seconds; None if there was none, "" at the end of input."""
    ready, _, _ = select.select([sys.stdin], [], [], wait_s)
    return sys.stdin.readline() if ready else None


class ReviewPrompt:
    """Prints each scene that waits for review, one at a time; in an interactive terminal, also reads the answer."""

    def __init__(
        self, console: Console, run: Run, aside: Aside, read_line: ReadLine = read_line, *, typing: bool | None = None
    ) -> None:
        self._console = console
        self._run = run
        self._aside = aside
        self._read_line = read_line
        self._typing = sys.stdin.isatty() and sys.platform != "win32" if typing is None else typing
        self._waiting: queue.SimpleQueue[tuple[int, IterationFolder] | None] = queue.SimpleQueue()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._ask_all, name="review-prompt", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._waiting.put(None)
        self._thread.join()

    def on_event(self, number: int, event: Event) -> None:
        """Queue the scene for review if the event says that it waits for one."""
        if isinstance(event, Waiting):
            self._waiting.put((number, self._run.design(number).iteration(event.iteration)))

    def _ask_all(self) -> None:
        while (waiting := self._waiting.get()) is not None:
            with self._aside():
                self._ask(*waiting)

    def _ask(self, number: int, iteration: IterationFolder) -> None:
        concept = newest(it.concept.read() for it in self._run.design(number).leading_to(iteration.number))
        name = f", {concept.name}" if concept else ""
        self._print(f"\n[bold]Design {number}{escape(name)}[/]: stable, and passed by the Judge.")
        self._print(f"  pictures  {escape(str(iteration.path))}: preview.png, motion.png")
        self._print(f"  3-D       aidsr view {escape(shlex.quote(str(iteration.scene.xml.path)))}")
        if self._typing:
            self._print("  [bold]a[/]pprove, [bold]r[/]efine WHAT TO CHANGE, or [bold]q[/]uit? ", end="")
            self._take_typed(iteration)
        else:
            self._explain_file(iteration)

    def _take_typed(self, iteration: IterationFolder) -> None:
        while not (self._ended.is_set() or iteration.decision.path.exists()):
            line = self._read_line(_POLL_S)
            if line is None:
                continue
            if line == "":  # end of the input: the terminal was closed
                self._typing = False
                self._explain_file(iteration)
                return
            decision = parse_answer(line)
            if decision is None:
                self._print('  Type "a", "q", or "r" and what to change, for example "r make it longer": ', end="")
                continue
            iteration.decision.write(decision)

    def _explain_file(self, iteration: IterationFolder) -> None:
        self._print(f'  answer    write {{"verdict": "approve"}} to {escape(str(iteration.decision.path))}')
        self._print('            or {"verdict": "refine", "text": "…"}, or {"verdict": "quit"}')

    def _print(self, text: str, end: str = "\n") -> None:
        self._console.print(text, end=end, soft_wrap=True)
