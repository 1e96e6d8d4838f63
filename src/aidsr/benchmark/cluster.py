"""Jobs on a Ray cluster. A run travels to a worker as bytes and comes back as bytes: no disk is shared."""

from __future__ import annotations

import io
import logging
import os
import tarfile
import tempfile
import time
from pathlib import Path
from typing import Any

from aidsr.benchmark.jobs import Job
from aidsr.benchmark.pool import Ended
from aidsr.benchmark.study import Cell, open_study
from aidsr.errors import Limit, UserError

__all__ = ["RayPool", "pack", "perform_packed", "unpack"]


def perform_packed(packed: bytes, job: dict[str, object]) -> tuple[bytes, str, tuple[Limit, ...]]:
    """Do a job on what was sent; return the run's files afterwards, an error or nothing, and which limits refused.

    Runs on a worker. What was done before a failure comes back as well, so that a retry goes on from there.
    """
    from aidsr.benchmark.jobs import perform
    from aidsr.errors import AidsrError, BudgetError

    found = Job.of(job)
    with tempfile.TemporaryDirectory() as folder:
        unpack(packed, Path(folder))
        error = ""
        short: tuple[Limit, ...] = ()
        try:
            perform(Path(folder), found)
        except AidsrError as failed:
            error, short = str(failed), failed.limits if isinstance(failed, BudgetError) else ()
        return pack(Path(folder), found.cell), error, short


def pack(study: Path, *cells: Cell) -> bytes:
    """Return the plan and the files of some runs."""
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w:gz", compresslevel=1) as archive:
        archive.add(study / "study.toml", "study.toml")
        for cell in cells:
            home = study / "runs" / cell.name
            if home.exists():
                archive.add(home, f"runs/{cell.name}")
    return out.getvalue()


def unpack(packed: bytes, study: Path) -> None:
    """Write files that were packed; those that exist are replaced, nothing outside the folder is touched."""
    with tarfile.open(fileobj=io.BytesIO(packed), mode="r:gz") as archive:
        archive.extractall(study, filter="data")


class RayPool:
    """A Ray cluster: as many jobs at a time as it has processors.

    Args:
        study: Folder of the study, on the driver's disk.
        address: Of the cluster, "auto" for the one this machine belongs to, "local" for one of its own.

    Raises:
        UserError: There is no cluster at that address.
    """

    def __init__(self, study: Path, address: str) -> None:
        self._study = study
        self._began: dict[Any, tuple[Job, float]] = {}
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        # 15 unless said; a job's limits are in wall time, and one that only gets what others leave runs out of it
        os.environ.setdefault("RAY_worker_niceness", "0")
        import ray

        self._ray = ray
        try:
            # the dashboard would open a port that asks for no password
            ray.init(
                address=None if address == "local" else address,
                include_dashboard=False if address == "local" else None,
                log_to_driver=False,
                logging_level=logging.WARNING,
            )
        except Exception as error:  # Ray raises that itself where a node does not start in time
            said = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
            raise UserError(
                f"Ray does not start on this machine: {said}"
                if address == "local"
                else f"no Ray cluster answers at {address}: {said}; start one with: ray start --head"
            ) from None
        self._size = max(1, int(ray.cluster_resources().get("CPU", 1)))
        # lost workers are retried by the driver of the study, which also counts the attempts
        self._perform = ray.remote(num_cpus=1, max_retries=0)(perform_packed)

    @property
    def free(self) -> int:
        """How many more jobs can be begun now."""
        return self._size - len(self._began)

    def begin(self, job: Job) -> None:
        """Begin a job."""
        study = open_study(self._study)
        before = study.before(job.cell) if job.stage == "design" else None
        packed = pack(self._study, job.cell, *([before] if before else []))
        self._began[self._perform.remote(packed, job.as_dict())] = (job, time.monotonic())

    def wait(self) -> Ended:
        """Return the next job that ends, its files brought back."""
        (reference, *_), _ = self._ray.wait(list(self._began))
        job, began = self._began.pop(reference)
        short: tuple[Limit, ...] = ()
        try:
            packed, error, short = self._ray.get(reference)
            unpack(packed, self._study)
        except self._ray.exceptions.RayError as lost:
            error = f"{type(lost).__name__}: {lost}"
        return Ended(job, error, time.monotonic() - began, short=short)

    def close(self) -> None:
        """Leave the cluster; what is at work is dropped and can be done again."""
        self._ray.shutdown()
