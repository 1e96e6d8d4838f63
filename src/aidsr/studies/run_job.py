"""Command `python -m aidsr.studies.run_job STUDY JOB`, which runs one job in its own process."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
from pathlib import Path

from aidsr.core.errors import AidsrError, BudgetError, Limit
from aidsr.studies.jobs import Job, run_job

EXHAUSTED_LIMITS: dict[int, tuple[Limit, ...]] = {3: ("cost_usd",), 4: ("tokens",), 5: ("cost_usd", "tokens")}
"""Exit codes of a job whose share of the named limits of the study was too small; with a larger share it can resume."""


def _end_with_the_driver() -> None:
    """Kill this process group when the driver has ended; a resumed driver starts the job again."""
    os.read(0, 1)  # blocks until the pipe closes; not sys.stdin, as this thread would hold its lock at exit
    os.killpg(0, signal.SIGKILL)


def _limits(error: AidsrError) -> tuple[Limit, ...]:
    return error.limits if isinstance(error, BudgetError) else ()


def main(arguments: list[str]) -> int:
    """Run a job and return the exit code; on failure the reason is the last line on standard error.

    When standard input is closed, the process kills itself.

    Args:
        arguments: Folder of the study, and the job as JSON.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGTERM ends the job as cleanly as SIGINT
    threading.Thread(target=_end_with_the_driver, daemon=True).start()
    folder, job = arguments
    try:
        run_job(Path(folder), Job.of(json.loads(job)))
    except AidsrError as error:
        sys.stderr.write(f"{error}\n")
        return next((code for code, limits in EXHAUSTED_LIMITS.items() if set(limits) == set(_limits(error))), 1)
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
