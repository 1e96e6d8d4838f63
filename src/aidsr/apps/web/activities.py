"""The running activities of all runs, and those that wait for a person."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import Literal

from aidsr.apps.web.addresses import design_address, job_address, run_address, study_address
from aidsr.apps.web.site import Job, RunView, Site
from aidsr.apps.web.time_left import left_s, usual_s
from aidsr.core.errors import UserError
from aidsr.core.formatting import iso_time
from aidsr.runs.event_text import DOING
from aidsr.runs.trainings import read_curve, trainings_of

_KEPT_S = 1.5
"""Maximum age of a reading, which every open page requests. Our choice."""


@dataclass(frozen=True)
class Activity:
    """Work that is running or waits for a person."""

    kind: Literal["decision", "reply", "designs", "training", "export", "probe", "study"]
    title: str
    address: str
    doing: str
    since: str = ""
    """Time of its start or of its last event, ISO 8601."""
    share: float | None = None
    """Completed share, 0 to 1; None where it is unknown."""
    left_s: float | None = None
    """Estimated remaining time [s], from its present speed or the duration of earlier designs; None where unknown."""
    process: str = ""
    """Name of the process to stop; empty where the web app cannot stop it."""
    is_stopping: bool = False
    """Whether that process was asked to end."""

    @property
    def waits(self) -> bool:
        """Whether it waits for a person."""
        return self.kind in ("decision", "reply")


class Activities:
    """Reader of the running and waiting activities, shared by all open pages."""

    def __init__(self, site: Site) -> None:
        self._site = site
        self._lock = threading.Lock()
        self._known: tuple[Activity, ...] = ()
        self._read_s = -float("inf")

    def latest(self) -> tuple[Activity, ...]:
        """Return the last result of `current` without reading; empty before its first call."""
        return self._known

    def current(self) -> tuple[Activity, ...]:
        """Return the activities that wait for a person, then the running ones, each with the newest run first."""
        with self._lock:
            if time.monotonic() - self._read_s > _KEPT_S:
                views = tuple(self._views())
                usual, now = usual_s(views), datetime.now(UTC)
                found = [activity for view in views for activity in self._of(view, left_s(view, usual, now))]
                found += self._studies()
                found = [replace(each, is_stopping=self._is_stopping(each.process)) for each in found]
                self._known = tuple(sorted(found, key=lambda activity: not activity.waits))
                self._read_s = time.monotonic()
            return self._known

    def _is_stopping(self, process: str) -> bool:
        return bool(process) and self._site.processes.is_stopping(process)

    def _views(self) -> Iterator[RunView]:
        for run in self._site.library.runs():
            with contextlib.suppress(UserError):  # the home page shows the error
                yield self._site.view(run)

    def _of(self, view: RunView, left_s: float | None) -> Iterator[Activity]:
        """Yield the activities of a run; `left_s` is its estimated remaining time [s]."""
        name = view.name
        home = run_address(name)
        for design in view.designs:
            if design.status.state == "waiting":
                title = f"{view.title}, design {design.status.number}: {design.status.concept}"
                address = design_address(name, design.status.number)
                yield Activity("decision", title, address, "waits for your decision", design.since)
        if view.prompts:
            count = "a prompt waits" if view.prompts == 1 else f"{view.prompts} prompts wait"
            yield Activity("reply", view.title, home, f"{count} for a reply", view.since, process=name)
        elif view.shown == "running":
            since = view.status.record.started
            yield Activity("designs", view.title, home, _doing(view), since, _share(view), left_s, name)
        for job in view.jobs:
            yield self._job(name, view, job)

    def _studies(self) -> Iterator[Activity]:
        for view in self._site.studies.views():
            if view.at_work:
                process = self._site.studies.process(view.key)
                since = iso_time(self._site.processes.started_s(process))
                doing = f"{view.runs_done} of {view.runs} runs finished, {view.jobs_left} jobs remaining"
                left_s = 3600 * view.core_hours_left / self._site.studies.jobs(view.key)
                share = view.runs_done / view.runs if view.runs else None  # an unreadable study has no runs
                address = study_address(view.key)
                yield Activity("study", f"study {view.name}", address, doing, since, share, left_s or None, process)

    def _job(self, name: str, view: RunView, job: Job) -> Activity:
        title = f"{view.title}, design {job.number}: {view.design(job.number).status.concept}"
        design = self._site.run(name).design(job.number)
        trainings = trainings_of(design) if job.kind == "training" else ()
        at_work = [one for one in trainings if one.at_work]
        if job.process:
            began_s = self._site.processes.started_s(job.process)
        else:
            began_s = at_work[-1].config.path.stat().st_mtime if at_work else time.time()
        since, address = iso_time(began_s), job_address(name, job.number, job.kind)
        if job.kind == "export":
            return Activity("export", title, address, "creating parts", since, process=job.process)
        told = self._site.processes.progress(job.process) if job.process else None
        share, left_s = (told.share, told.left_s) if told else (None, None)
        if job.kind == "probe":
            doing = told.doing if told else "trying motions"
            return Activity("probe", title, address, doing, since, share, left_s, job.process)
        learning = [one for one in at_work or trainings if one.stage == "learning"]
        curve = read_curve(learning[-1]) if learning else ()
        steps = int((learning[-1].config.read() or {}).get("steps", 0)) if learning else 0
        if not curve or not steps:
            again = bool(at_work) and at_work[-1].stage == "judged"
            judging = "rendering videos, or repeating the evaluation" if again else "evaluating the policy"
            if learning:
                return Activity("training", title, address, "starting to learn", since, process=job.process)
            doing = f"{judging}: {told.doing}" if told else judging
            return Activity("training", title, address, doing, since, share, left_s, job.process)
        done, speed = min(curve[-1].steps, steps), curve[-1].steps_per_s
        doing = f"{done:,} of {steps:,} steps" + ", testing the policy" * (done >= steps)
        left_s = (steps - done) / speed if speed > 0 and done < steps else None
        return Activity("training", title, address, doing, since, done / steps, left_s, job.process)


def _share(view: RunView) -> float | None:
    """Return the share of finished designs, 0 to 1; None before there are any designs."""
    return (
        sum(design.status.outcome is not None for design in view.designs) / len(view.designs) if view.designs else None
    )


def _doing(view: RunView) -> str:
    if not view.designs:
        return DOING["concepts"]
    finished = sum(design.status.outcome is not None for design in view.designs)
    steps = sorted({DOING[design.status.doing] for design in view.designs if design.status.doing})
    return f"{finished} of {len(view.designs)} designs finished" + (f"; {', '.join(steps)}" if steps else "")
