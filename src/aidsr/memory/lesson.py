"""A lesson: one body on one job, how far it came when it was measured, and where the evidence is."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from aidsr.core.artifacts import Artifact, Base
from aidsr.core.formatting import excerpt

_JOB, _BODY, _FOUND, _HOW = 160, 320, 400, 160
"""Characters of the words on a job, a body and a trial it repeats; ours: eight lessons take up to 3,000 tokens."""

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Lesson(Artifact):
    """One measured attempt at a job. Nothing in it is an opinion but the author's words on the body.

    Only trials on development variations are in it, never held-out ones: those score a design.
    """

    objective: str
    task: str = ""
    """Name of the benchmark task, empty for an objective in words."""
    level: str = ""
    base: Base
    name: str
    family: str
    morphology: str
    actuation: str
    actuators: int
    groups: int
    """Actions of a policy: groups of actuators, and actuators that act alone."""
    changed: tuple[str, ...] = ()
    """What was different from the attempt before, where there was one."""
    progress_before: Share | None = None
    """Of that attempt."""
    progress: Share
    """Mean over the searches of the trial, or over the variations and seeds of the measurement."""
    least: Share
    most: Share
    """Least and greatest progress of its searches; of a measurement the mean, too."""
    searches: Annotated[int, Field(ge=1)]
    how: str = ""
    """How its designer measured it, with what came of it; "" for a trial."""
    solved: bool
    """Whether the trial got through the decisive stage of the job: in most searches, or by a script."""
    found: str
    """What was seen, in words of the trial."""
    policy_success: Share | None = None
    """Share of development episodes that a policy won after a short training, where one was trained."""
    model: str
    """Who designed."""
    evidence: str
    """Run and iteration, as RUN/designs/1/02."""
    scene_sha256: str
    commit: str = ""
    """Of the source that collected it."""

    def _measured(self) -> str:
        """Return how far it came, by which motions, and whether that was enough."""
        if self.how:
            return f"progress {self.progress:.2f} ({excerpt(_line(self.how), _HOW)})"
        searches = f"{self.least:.2f} to {self.most:.2f} in {_count(self.searches, 'search', 'searches')}"
        return f"progress {self.progress:.2f} ({searches}), decisive stage {'' if self.solved else 'not '}reached"

    @property
    def job(self) -> str:
        """The objective, as far as a lesson repeats it."""
        return excerpt(_line(self.objective), _JOB)

    @property
    def worth(self) -> float:
        """By which lessons on one job are put in order: progress, and the share that a policy won on top."""
        return self.progress + (self.policy_success or 0.0)

    @property
    def step(self) -> float:
        """By how much a change raised the progress; 0 without an attempt before."""
        return 0.0 if self.progress_before is None else self.progress - self.progress_before

    def text(self) -> str:
        """Return the lesson as a paragraph: what the body was, what was measured, and the evidence."""
        parts = [
            f"{self.name} ({self.family}, {_count(self.actuators, 'actuator')} in {_count(self.groups, 'group')}): "
            f"{excerpt(_line(f'{self.morphology} {self.actuation}'), _BODY)}",
            f"Measured: {self._measured()}.",
        ]
        if self.policy_success is not None:
            parts.append(f"A short training won {self.policy_success:.0%} of its development episodes.")
        if self.progress_before is not None:
            changed = excerpt("; ".join(self.changed), 200)
            parts.append(f"The attempt before came to {self.progress_before:.2f}; changed since: {changed}.")
        return " ".join([*parts, excerpt(_line(self.found), _FOUND), f"[{self.evidence}]"])


def _line(text: str) -> str:
    """Return a text without line breaks, so that it stays one item of a list."""
    return " ".join(text.split())


def _count(number: int, one: str, many: str = "") -> str:
    return f"{number} {one if number == 1 else many or one + 's'}"
