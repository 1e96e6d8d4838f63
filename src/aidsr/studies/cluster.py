"""Execution of jobs on a Ray cluster. Runs and results are sent as bytes, so no shared disk is needed."""

from __future__ import annotations

import io
import logging
import os
import tarfile
import tempfile
import time
from pathlib import Path
from typing import Any

from aidsr.core.errors import Limit, UserError
from aidsr.studies.jobs import Job, output_of_job
from aidsr.studies.pool import EndedJob
from aidsr.studies.study import STUDY_FILE, open_study


def run_packed_job(packed: bytes, job: dict[str, object]) -> tuple[bytes, str, tuple[Limit, ...]]:
    """Run a job on packed files of a study, on a worker of the cluster.

    Output written before a failure is returned too, so that a retry resumes from there. Only the job's own output is
    returned, since other jobs have continued in the meantime.

    Args:
        packed: Files of the study that the job needs, from `pack`.
        job: The job, as plain values.

    Returns:
        The packed output of the job, the error message ("" for success), and the limits of the study of which the
        job's share was too small.
    """
    from aidsr.core.errors import AidsrError, BudgetError
    from aidsr.studies.jobs import run_job

    found = Job.of(job)
    with tempfile.TemporaryDirectory() as folder:
        unpack(packed, Path(folder))
        error = ""
        exhausted_limits: tuple[Limit, ...] = ()
        try:
            run_job(Path(folder), found)
        except AidsrError as failed:
            error, exhausted_limits = str(failed), failed.limits if isinstance(failed, BudgetError) else ()
        return pack(Path(folder), output_of_job(open_study(Path(folder)), found)), error, exhausted_limits


def pack(study: Path, *paths: Path) -> bytes:
    """Return files and folders of a study as a compressed archive; paths that do not exist are left out."""
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w:gz", compresslevel=1) as archive:
        for path in paths:
            if path.exists():
                archive.add(path, str(path.relative_to(study)))
    return out.getvalue()


def unpack(packed: bytes, study: Path, instead_of: Path | None = None) -> None:
    """Write packed files in the order of their modification times; nothing outside the folder is touched.

    Each file is moved into place atomically, so if the driver is killed meanwhile, the folder is in a state that a
    killed job could also have left.

    Args:
        packed: Archive from `pack`.
        study: Folder of the study; files in it that are in the archive are replaced.
        instead_of: Folder of the study in which files that are not in the archive are deleted, since a job may rename
            and remove its own files; None deletes nothing.
    """
    study.mkdir(parents=True, exist_ok=True)
    with (
        tarfile.open(fileobj=io.BytesIO(packed), mode="r:gz") as archive,
        tempfile.TemporaryDirectory(dir=study, prefix=".arrived-") as arrived,
    ):
        archive.extractall(arrived, filter="data")
        files = (path for path in Path(arrived).rglob("*") if path.is_file())
        for path in sorted(files, key=lambda path: path.stat().st_mtime_ns):
            place = study / path.relative_to(arrived)
            place.parent.mkdir(parents=True, exist_ok=True)
            path.replace(place)
        packed_here = {study / name for name in archive.getnames()}
    if instead_of is not None:
        for path in sorted(instead_of.rglob("*"), reverse=True):
            if path not in packed_here:
                path.rmdir() if path.is_dir() else path.unlink()


class RayPool:
    """Pool on a Ray cluster, with as many jobs at a time as the cluster has CPUs.

    Args:
        study: Folder of the study, on the driver's disk.
        address: Address of the cluster; "auto" for the one this machine belongs to, "local" to start a new one here.

    Raises:
        UserError: No cluster answers at the address, or Ray does not start.
    """

    def __init__(self, study: Path, address: str) -> None:
        self._study = study
        self._began: dict[Any, tuple[Job, float]] = {}
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        # Ray's default niceness is 15; a job's limits are in wall time, and a low-priority job would exceed them
        os.environ.setdefault("RAY_worker_niceness", "0")
        import ray

        self._ray = ray
        try:
            # the dashboard would open a port without a password
            ray.init(
                address=None if address == "local" else address,
                include_dashboard=False if address == "local" else None,
                log_to_driver=False,
                logging_level=logging.WARNING,
            )
        except Exception as error:  # Ray itself raises plain Exception where a node does not start in time
            reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
            raise UserError(
                f"Ray does not start on this machine: {reason}"
                if address == "local"
                else f"no Ray cluster answers at {address}: {reason}; start one with: ray start --head"
            ) from None
        self._size = max(1, int(ray.cluster_resources().get("CPU", 1)))
        # the driver of the study retries jobs of lost workers, and counts the attempts
        self._perform = ray.remote(num_cpus=1, max_retries=0)(run_packed_job)

    @property
    def free(self) -> int:
        """Number of jobs that can be started now."""
        return self._size - len(self._began)

    def begin(self, job: Job) -> None:
        """Start a job."""
        study = open_study(self._study)
        continued = study.continued_cell(job.cell) if job.stage == "design" else None
        runs = [study.home(cell) for cell in (job.cell, continued) if cell]
        packed = pack(self._study, self._study / STUDY_FILE, *runs)
        self._began[self._perform.remote(packed, job.as_dict())] = (job, time.monotonic())

    def wait(self) -> EndedJob:
        """Wait for the next job that ends, unpack its output and return it."""
        (reference, *_), _ = self._ray.wait(list(self._began))
        job, began = self._began.pop(reference)
        exhausted_limits: tuple[Limit, ...] = ()
        try:
            packed, error, exhausted_limits = self._ray.get(reference)
            unpack(packed, self._study, instead_of=output_of_job(open_study(self._study), job))
        except self._ray.exceptions.RayError as lost:
            error = f"{type(lost).__name__}: {lost}"
        return EndedJob(job, error, time.monotonic() - began, exhausted_limits=exhausted_limits)

    def close(self) -> None:
        """Disconnect from the cluster; running jobs are dropped and can be started again."""
        self._ray.shutdown()
