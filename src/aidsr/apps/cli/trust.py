"""Confirmation by the user before a folder that was not made here is resumed."""

from __future__ import annotations

import sys
from typing import Protocol


class _Check(Protocol):
    def __call__(self, *, trust: bool) -> None: ...


def confirmed(require_ours: _Check, trust: bool) -> None:
    """Check the origin of a folder; in a terminal, ask the user whether to trust one that was not made here.

    Raises:
        ForeignFolderError: The folder is not trusted, or there is no terminal to ask in.
    """
    from rich.markup import escape
    from rich.prompt import Confirm

    from aidsr.apps.cli.terminal import make_console
    from aidsr.runs.origin import ForeignFolderError

    try:
        require_ours(trust=trust)
    except ForeignFolderError as error:
        if not (sys.stdin.isatty() and sys.stdout.isatty()):
            raise
        if not Confirm.ask(f"{escape(str(error))}.\nResume it?", console=make_console(), default=False):
            raise
        require_ours(trust=True)
