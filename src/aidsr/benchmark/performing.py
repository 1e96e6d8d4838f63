"""`python -m aidsr.benchmark.performing STUDY JOB`: one job in a process of its own."""

from __future__ import annotations

import json
import signal
import sys
from pathlib import Path

from aidsr.benchmark.jobs import Job, perform
from aidsr.errors import AidsrError

__all__ = ["main"]


def main(arguments: list[str]) -> int:
    """Do a job; on failure its reason is the last thing said on standard error.

    Args:
        arguments: Folder of the study; the job as JSON.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # the same clean end as an interrupt
    folder, job = arguments
    try:
        perform(Path(folder), Job.of(json.loads(job)))
    except AidsrError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
