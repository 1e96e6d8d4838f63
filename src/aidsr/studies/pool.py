"""Where jobs are done: child processes of this machine, as many at a time as asked for."""

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
from aidsr.studies.run_job import SHORT

_POLL_S = 0.2
"""Interval between polls of the children [s]. Our choice: jobs last seconds to minutes."""
_LAST_WORDS = 2000
"""Characters of a failed job's error output that are kept."""


@dataclass(frozen=True)
class EndedJob:
    """A job that is over; `error` is empty when it was done."""

    job: Job
    error: str
    wall_s: float
    short: tuple[Limit, ...] = ()
    """Of which limits its share was too little; that is no failure."""


class Pool(Protocol):
    """Does jobs side by side."""

    @property
    def free(self) -> int:
        """How many more jobs can be started now."""
        ...

    def begin(self, job: Job) -> None:
        """Begin a job."""
        ...

    def wait(self) -> EndedJob:
        """Return the next job that ends; only called while one is at work."""
        ...

    def close(self) -> None:
        """End the running jobs; they can be started again later."""
        ...


@dataclass
class LocalPool:
    """Child processes, one job each, so that a crash or a kill takes down that job alone.

    Attributes:
        study: Folder of the study.
        size: How many at a time.
    """

    study: Path
    size: int
    _children: dict[int, tuple[Job, subprocess.Popen[bytes], float, IO[bytes]]] = field(default_factory=dict)

    @property
    def free(self) -> int:
        """How many more jobs can be started now."""
        return self.size - len(self._children)

    def begin(self, job: Job) -> None:
        """Begin a job."""
        command = [sys.executable, "-m", "aidsr.studies.run_job", str(self.study), json.dumps(job.as_dict())]
        # one thread each: side by side, single-threaded jobs do more in total (docs/studies.md)
        alone = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        # a pipe that is not read meanwhile would block a child that writes much
        output = tempfile.TemporaryFile()  # noqa: SIM115 - closed where the child ends
        child = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,  # closes with this process, however it ends, and so ends the job
            stdout=subprocess.DEVNULL,
            stderr=output,
            env=os.environ | alone,
            start_new_session=True,
        )
        self._children[child.pid] = (job, child, time.monotonic(), output)

    def wait(self) -> EndedJob:
        """Return the next job that ends."""
        while True:
            for pid, (job, child, began, output) in self._children.items():
                if child.poll() is not None:
                    del self._children[pid]
                    child.communicate()
                    with output:
                        output.seek(0)
                        last = output.read().decode(errors="replace").strip()[-_LAST_WORDS:]
                    error = "" if child.returncode == 0 else last or f"ended with code {child.returncode}"
                    return EndedJob(job, error, time.monotonic() - began, short=SHORT.get(child.returncode, ()))
            time.sleep(_POLL_S)

    def close(self) -> None:
        """End the children and whatever they started."""
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
