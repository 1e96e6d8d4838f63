"""Execution of jobs in child processes on this machine, up to a given number at a time."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Protocol

from aidsr.core.errors import Limit
from aidsr.studies.jobs import Job
from aidsr.studies.run_job import EXHAUSTED_LIMITS

_POLL_S = 0.2
"""Interval between polls of the children [s]. Our choice: jobs last seconds to minutes."""
_LAST_WORDS = 2000
"""Number of characters kept from the end of a failed job's error output."""


@dataclass(frozen=True)
class EndedJob:
    """A job that has ended; `error` is empty if it succeeded."""

    job: Job
    error: str
    wall_s: float
    exhausted_limits: tuple[Limit, ...] = ()
    """Limits of the study of which its share was too small; this does not count as a failure."""


class Pool(Protocol):
    """Executor that runs several jobs at a time."""

    @property
    def free(self) -> int:
        """Number of jobs that can be started now."""
        ...

    def begin(self, job: Job) -> None:
        """Start a job."""
        ...

    def wait(self) -> EndedJob:
        """Wait for the next job that ends and return it; only called while a job is running."""
        ...

    def close(self) -> None:
        """Stop the running jobs; they can be started again later."""
        ...


@dataclass
class LocalPool:
    """Pool of child processes with one job each, so that a crash or a kill affects only that job.

    Attributes:
        study: Folder of the study.
        size: Largest number of jobs at a time.
    """

    study: Path
    size: int
    _children: dict[int, tuple[Job, subprocess.Popen[bytes], float, IO[bytes]]] = field(default_factory=dict)

    @property
    def free(self) -> int:
        """Number of jobs that can be started now."""
        return self.size - len(self._children)

    def begin(self, job: Job) -> None:
        """Start a job."""
        command = [sys.executable, "-m", "aidsr.studies.run_job", str(self.study), json.dumps(job.as_dict())]
        # one thread for each job: parallel single-threaded jobs have the higher total throughput (docs/studies.md)
        alone = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        # a file, since a pipe that nobody reads would block a child with much output
        output = tempfile.TemporaryFile()  # noqa: SIM115 - closed where the child ends
        child = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,  # closes when this process ends for any reason, which ends the job too
            stdout=subprocess.DEVNULL,
            stderr=output,
            env=os.environ | alone,
            start_new_session=True,
        )
        self._children[child.pid] = (job, child, time.monotonic(), output)

    def wait(self) -> EndedJob:
        """Wait for the next job that ends and return it."""
        while True:
            for pid, (job, child, began, output) in self._children.items():
                if child.poll() is not None:
                    del self._children[pid]
                    child.communicate()
                    with output:
                        output.seek(0)
                        last = output.read().decode(errors="replace").strip()[-_LAST_WORDS:]
                    error = "" if child.returncode == 0 else last or f"ended with code {child.returncode}"
                    exhausted = EXHAUSTED_LIMITS.get(child.returncode, ())
                    return EndedJob(job, error, time.monotonic() - began, exhausted_limits=exhausted)
            time.sleep(_POLL_S)

    def close(self) -> None:
        """End the children and all processes that they started."""
        for _, child, _, _ in self._children.values():
            with contextlib.suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGTERM)
        for _, child, _, output in self._children.values():
            try:
                child.wait(timeout=10)
            except subprocess.TimeoutExpired:
                os.killpg(child.pid, signal.SIGKILL)
            child.communicate()
            output.close()
        self._children.clear()
