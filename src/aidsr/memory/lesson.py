"""A lesson: the measured progress of one robot on one job, with a reference to the evidence."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from aidsr.core.artifacts import Artifact, Base, Evaluation
from aidsr.core.formatting import counted, excerpt

_JOB, _BODY, _FOUND, _HOW = 160, 320, 400, 160
"""Maximum characters of a lesson's text: on the job, on the robot, on the result of the trial, and on how its designer
measured it. Our choice: eight lessons take up to 3,000 tokens."""

Share = Annotated[float, Field(ge=0.0, le=1.0)]


class Lesson(Artifact):
    """One measured attempt at a job.

    Everything in it is measured or recorded, except the author's description of the robot. The measurements come from
    development variations only: held-out variations are reserved for scoring designs.
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
    """Number of actions of a policy: groups of actuators plus actuators that act alone."""
    changed: tuple[str, ...] = ()
    """Differences from the previous attempt; empty if there was none."""
    progress_before: Share | None = None
    """Progress of the previous attempt; None if there was none."""
    progress: Share
    """Mean over the searches of the trial, or over the variations and seeds of the designer's measurement."""
    least: Share
    """Smallest progress of the searches; for a designer's measurement, the mean."""
    most: Share
    """Largest progress of the searches; for a designer's measurement, the mean."""
    searches: Annotated[int, Field(ge=1)]
    """Number of searches of the trial; for a designer's measurement, of its episodes."""
    how: str = ""
    """How the designer measured the scene, and the result; "" for a trial."""
    solved: bool
    """Whether the decisive stage of the job was reached in most searches or by a script; for a designer's measurement,
    whether at least half of its episodes succeeded."""
    found: str
    """Result in words: the summary of the trial, or what else the designer reported of the scene."""
    policy_success: Share | None = None
    """Share of development episodes in which a policy succeeded after a short training; None if none was trained."""
    policy_valid: bool = True
    """Whether this policy passed the verdict's checks of plausibility; true if none was trained, and in older lessons,
    which do not record it."""
    model: str
    """Provider of the model that designed the robot, or the model's name if it names no provider; see `designer_of`."""
    evidence: str
    """Run and iteration, for example RUN/designs/1/02; for a designer's measurement followed by /work/SCENE."""
    scene_sha256: str
    """SHA-256 of the scene's MJCF text."""
    commit: str = ""
    """Commit of the source code that collected the lesson."""

    def _measured(self) -> str:
        """Return the progress, how it was measured, and for a trial whether the decisive stage was reached."""
        if self.how:
            return f"progress {self.progress:.2f} ({excerpt(_line(self.how), _HOW)})"
        searches = f"{self.least:.2f} to {self.most:.2f} in {counted(self.searches, 'search')}"
        return f"progress {self.progress:.2f} ({searches}), decisive stage {'' if self.solved else 'not '}reached"

    @property
    def design_and_iteration(self) -> tuple[int, int]:
        """Numbers of the design and of its iteration, from `evidence`."""
        _, _, design, iteration, *_ = self.evidence.split("/")
        return int(design), int(iteration)

    @property
    def job(self) -> str:
        """The objective, cut to the length that a lesson repeats."""
        return excerpt(_line(self.objective), _JOB)

    @property
    def worth(self) -> float:
        """Rank of lessons on one job, 0 to 2: progress plus the success share of a valid policy."""
        return self.progress + (self.valid_success or 0.0)

    @property
    def valid_success(self) -> float | None:
        """Success share of the policy as it counts: 0 for one that is not valid; None if none was trained."""
        return self.policy_success if self.policy_valid or self.policy_success is None else 0.0

    @property
    def reservation(self) -> str:
        """Clause to append to the success share of a policy that is not valid; "" for others."""
        return "" if self.policy_valid or not self.policy_success else ", but not in a valid way"

    @property
    def step(self) -> float:
        """Gain in progress since the previous attempt; 0 if there was none."""
        return 0.0 if self.progress_before is None else self.progress - self.progress_before

    def text(self) -> str:
        """Return the lesson as a paragraph: the robot, the measurements and the evidence."""
        parts = [
            f"{self.name} ({self.family}, {counted(self.actuators, 'actuator')} in {counted(self.groups, 'group')}): "
            f"{excerpt(_line(f'{self.morphology} {self.actuation}'), _BODY)}",
            f"Measured: {self._measured()}.",
        ]
        if self.policy_success is not None:
            won = f"A short training won {self.policy_success:.0%} of its development episodes"
            parts.append(f"{won}{self.reservation}.")
        if self.progress_before is not None:
            changed = excerpt("; ".join(self.changed), 200)
            parts.append(f"The attempt before came to {self.progress_before:.2f}; changed since: {changed}.")
        return " ".join([*parts, excerpt(_line(self.found), _FOUND), f"[{self.evidence}]"])


def policy_results(policy: Evaluation | None) -> dict[str, Any]:
    """Return the fields of a lesson that tell the result of a short training; none if no policy was trained."""
    return {"policy_success": policy.success_share, "policy_valid": policy.valid} if policy else {}


def designer_of(model: str) -> str:
    """Return the provider in a model name, or the model itself if the name has none: "openai:gpt-5" -> "openai".

    Paths and addresses in the name are left out, since lessons are passed on: "qwen3:8b@http://host/v1" -> "qwen3:8b".
    """
    served, at, _ = model.partition("@http")
    return served if at else model.partition(":")[0]


def _line(text: str) -> str:
    """Return a text on one line, so that it stays one item of a list."""
    return " ".join(text.split())
