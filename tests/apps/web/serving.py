"""`aidsr web` in a process forked from one that has imported it already: its imports take 2 s of processor time."""

import os
import signal
import sys
from collections.abc import Mapping, Sequence
from multiprocessing import get_context
from multiprocessing.context import ForkServerProcess
from pathlib import Path

_FORKS = get_context("forkserver")
_FORKS.set_forkserver_preload(["aidsr.apps.cli", "aidsr.apps.web.server"])
_TESTS = Path(__file__).parents[2]


def started(words: Sequence[str], environment: Mapping[str, str]) -> ForkServerProcess:
    """Start `aidsr WORDS` with these environment variables; it writes to the standard output and error of this process.

    The process it is forked from runs nothing but imports, so that nothing of an earlier one is left in it.
    """
    process = _FORKS.Process(target=_run, args=(list(words), dict(environment)))
    process.start()
    return process


def interrupt(process: ForkServerProcess) -> None:
    """End it as Control-C does, and wait for its end."""
    assert process.pid is not None
    if process.is_alive():
        os.kill(process.pid, signal.SIGINT)
    process.join()


def _run(words: Sequence[str], environment: Mapping[str, str]) -> None:
    from aidsr.apps.cli import main

    os.environ.clear()
    os.environ.update(environment)
    sys.argv = ["aidsr", *words]
    sys.path[:] = [each for each in sys.path if not Path(each).is_relative_to(_TESTS)]  # multiprocessing adds them
    main(list(words))
