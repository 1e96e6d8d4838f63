"""Run all designs of a run: first the concepts, then each design in its own thread until it has an outcome."""

from __future__ import annotations

import queue
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field

from aidsr.core.artifacts import Brief, Concept
from aidsr.core.errors import AidsrError, ReplyError
from aidsr.core.storage_errors import StorageError
from aidsr.loop.loop import DesignLoop
from aidsr.loop.parts import Parts
from aidsr.loop.steps import HaltedError, Steps, reporting
from aidsr.runs import DesignFolder, EventLog, Run, write_summary
from aidsr.runs.answered_calls import set_calls_aside
from aidsr.runs.events import Event, Finished, Started, StepDone, Stopped, Waiting, without_secrets
from aidsr.teams.providers import is_offline

Listen = Callable[[int, Event], None]
"""Called with every event, in the thread that called `run_designs`: number of the design (0 for the run), event."""

_LAST_STEPS_S = 5.0
"""Time for which an interrupted run waits for its threads [s]; what they do later is lost, as after a kill. Our
choice."""


def run_designs(run: Run, parts: Parts, listen: Listen = lambda _design, _event: None) -> Run:
    """Do everything in a run that is not done yet; call it again for a run that was stopped or killed.

    If a design stops because a model cannot be reached, or because of a bug in AID-SR, this is recorded and the other
    designs continue.

    Raises:
        UserError: Another process works on the run, or one of its files is damaged.
        AidsrError: There are no concepts, because the Designer could not be asked.
    """
    try:
        return _Runner(run, parts, listen).run_all()
    finally:
        parts.interrupt()


@dataclass(frozen=True)
class _Runner:
    run: Run
    parts: Parts
    listen: Listen
    halted: threading.Event = field(default_factory=threading.Event)
    events: queue.SimpleQueue[tuple[int, Event | None]] = field(default_factory=queue.SimpleQueue)
    """Events of the designs, with their numbers; None as the event when a thread has ended."""

    def run_all(self) -> Run:
        with EventLog(self.run.events, lambda event: self.listen(0, event)) as log:
            log.write(Started())
            try:
                self._design_all(log)
            except BaseException:
                with suppress(AidsrError, OSError):  # what ended the run is told, not that its page was not written
                    self._write_summary()
                raise
        self._write_summary()
        return self.run

    def _design_all(self, log: EventLog) -> None:
        config = self.run.asked().config
        brief = self.run.brief()
        with _errors_logged(log, self.halted):
            concepts = self._concepts(brief, config.concepts, log)
        designs = self._designs(concepts)
        self._write_summary()
        with _errors_logged(log, self.halted):
            self._run_designs([DesignLoop(design, brief, config.iterations, self.parts) for design in designs])
        if all(design.outcome.read() for design in designs):
            log.write(Finished())

    def _write_summary(self) -> None:
        write_summary(self.run, offline=is_offline(self.run.asked().config.model))

    def _concepts(self, brief: Brief, count: int, log: EventLog) -> tuple[Concept, ...]:
        designer = reporting(self.parts.team_for(self.run.path).designer, log)
        try:
            return Steps(log, self.halted.is_set).run(
                "concepts",
                self.run.concepts,
                lambda: designer.propose(brief, count),
                lambda concepts: "; ".join(concept.name for concept in concepts),
            )
        except ReplyError as error:
            set_calls_aside(self.run.path)
            raise ReplyError(f"{error} Resume the run to ask the Designer again.") from error

    def _designs(self, concepts: tuple[Concept, ...]) -> tuple[DesignFolder, ...]:
        designs = tuple(self.run.design(number) for number in range(1, len(concepts) + 1))
        for design, concept in zip(designs, concepts, strict=True):
            design.iteration(1).concept.write(concept)
        return designs

    def _run_designs(self, loops: list[DesignLoop]) -> None:
        threads = [
            threading.Thread(target=self._run_design, args=(loop,), name=f"design {loop.design.number}", daemon=True)
            for loop in loops
            if loop.design.outcome.read() is None
        ]
        for thread in threads:
            thread.start()
        try:
            self._forward_events(threads)
        except KeyboardInterrupt:
            self.halted.set()
            self.parts.interrupt()
            end = time.monotonic() + _LAST_STEPS_S
            for thread in threads:
                thread.join(max(0.0, end - time.monotonic()))
            raise

    def _forward_events(self, threads: list[threading.Thread]) -> None:
        """Pass events to the listener until all threads have ended, and keep the summary page up to date."""
        running = len(threads)
        while running:
            number, event = self.events.get()
            if event is None:
                running -= 1
                continue
            self.listen(number, event)
            if isinstance(event, Waiting) or (
                isinstance(event, StepDone) and event.step in ("preview", "critique", "motion")
            ):
                self._write_summary()

    def _run_design(self, loop: DesignLoop) -> None:
        """Run one design in its thread; an error that ends it is logged, and the others continue."""
        number = loop.design.number
        try:
            with EventLog(loop.design.events, lambda event: self.events.put((number, event))) as log:
                log.write(Started())
                with suppress(Exception), _errors_logged(log, self.halted):
                    log.write(Finished(outcome=loop.run(log, self.halted.is_set)))
        finally:
            self.events.put((number, None))


@contextmanager
def _errors_logged(log: EventLog, halted: threading.Event) -> Iterator[None]:
    """Log why work ended before its outcome, and raise the error again."""
    try:
        yield
    except StorageError as error:
        with suppress(StorageError):  # the log may be on the same full disk
            log.write(Stopped(cause="error", message=str(error)))
        raise
    except (KeyboardInterrupt, HaltedError):
        log.write(Stopped(cause="interrupted", message="interrupted by the user"))
        raise
    except AidsrError as error:
        if halted.is_set():
            log.write(Stopped(cause="interrupted", message=without_secrets(str(error))))
            raise
        log.write(Stopped(cause="error", message=without_secrets(str(error))))
        raise
    except Exception as error:
        log.write(
            Stopped(
                cause="bug",
                message=without_secrets(f"{type(error).__name__}: {error}"),
                traceback=without_secrets(traceback.format_exc()),
            )
        )
        raise
