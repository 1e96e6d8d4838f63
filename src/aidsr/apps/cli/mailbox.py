"""Announcement, in the terminal, of new prompts that a person answers in files."""

from __future__ import annotations

import threading
from pathlib import Path
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.markup import escape

from aidsr.teams.providers.manual import pending_prompts, prompts_directory

_POLL_S = 0.3
"""Interval between two checks for new prompts [s]."""


class Mailbox:
    """Announces each waiting prompt once while a run is in progress; does nothing for models that need no person."""

    def __init__(self, console: Console, model: str) -> None:
        self._console = console
        self._directory = prompts_directory(model)
        self._announced: set[Path] = set()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="mailbox", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        while self._directory and not self._ended.wait(_POLL_S):
            self.look(self._directory)

    def look(self, directory: Path) -> None:
        """Print the prompts that are new since the last poll."""
        for waiting in pending_prompts(directory):
            if waiting.prompt not in self._announced:
                self._announced.add(waiting.prompt)
                self._console.print(
                    f"[yellow]waiting for a reply[/] of the {escape(waiting.role)}: read "
                    f"{escape(str(waiting.prompt))} and save the reply as [bold]{escape(waiting.reply.name)}[/] in the "
                    "same folder",
                    soft_wrap=True,
                )
