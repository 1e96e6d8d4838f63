"""`python -m aidsr.studies.run_job STUDY JOB`: one job in a process of its own."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
from pathlib import Path

from aidsr.core.errors import AidsrError, BudgetError, Limit
from aidsr.studies.jobs import Job, run_job

SHORT: dict[int, tuple[Limit, ...]] = {3: ("cost_usd",), 4: ("tokens",), 5: ("cost_usd", "tokens")}
"""Exit codes of a job whose share of these limits of the study was too small; with a larger share it can resume."""


def _end_with_the_driver() -> None:
    """End when the driver is gone: a killed driver starts this job again when it is resumed."""
    os.read(0, 1)  # nothing is ever written; not sys.stdin, whose lock a thread would still hold at the end
    os.killpg(0, signal.SIGKILL)


def _limits(error: AidsrError) -> tuple[Limit, ...]:
    return error.limits if isinstance(error, BudgetError) else ()


def main(arguments: list[str]) -> int:
    """Do a job; on failure its reason is the last line on standard error.

    Args:
        arguments: Folder of the study; the job as JSON. Standard input stays open as long as the result is wanted.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # the same clean end as an interrupt
    threading.Thread(target=_end_with_the_driver, daemon=True).start()
    folder, job = arguments
    try:
        run_job(Path(folder), Job.of(json.loads(job)))
    except AidsrError as error:
        sys.stderr.write(f"{error}\n")
        return next((code for code, limits in SHORT.items() if set(limits) == set(_limits(error))), 1)
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
