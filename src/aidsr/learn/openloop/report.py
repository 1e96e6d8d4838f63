"""Report of a probe: how far a robot got without learning, and with which motion."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Field, computed_field

from aidsr.core.artifacts import Artifact, EpisodeResult
from aidsr.learn.openloop.motion import Motion
from aidsr.learn.openloop.motion_search import MotionKind

EndedBy = Literal["solved", "candidates", "budget"]
"""Reason why a search ended: all variations were solved, all motions were tried, or the physics steps were used up."""


class ProbedVariation(Artifact):
    """Best motion found for one variation of the task, and the result of its whole episode."""

    episode: EpisodeResult
    family: MotionKind
    motion: Motion


class ProbeReport(Artifact):
    """How far a robot gets without learning.

    The file also contains the computed shares; they are recomputed when the file is read.
    """

    model_config = ConfigDict(extra="ignore")

    task: str
    level: str
    benchmark_version: int
    seed: int
    candidates: int
    """Maximum number of motions for each variation, in whole generations of 16; the search of a variation ends when a
    motion solves it."""
    max_steps: int = 0
    """Maximum number of physics steps of all episodes together; 0 in reports from before this limit existed."""
    ended_by: EndedBy = "candidates"
    searched_s: float
    """Maximum duration of a motion in the search [s of simulation]; the reported motions are played to the end."""
    motions: int = 0
    """Number of motions tried for each variation that was not solved earlier."""
    played_steps: int = 0
    """Physics steps of all episodes together."""
    simulated_s: float
    """Simulated time of all episodes together [s]."""
    wall_s: float
    variations: Annotated[tuple[ProbedVariation, ...], Field(min_length=1)]
    """Development variations, each with the best motion found for it."""
    same_motion_share: float
    """Share of these variations that the best single motion solves: near `success_share` where the variations hardly
    matter, far below it where a robot has to observe its surroundings."""
    reached: str
    """Stage that the best episode reached, in words."""
    hold_s: float = 0.0
    """How long the goal has to hold without a break [s]; 0 in older reports."""
    versions: dict[str, str] = Field(default_factory=dict)

    @property
    def won(self) -> int:
        """Number of variations that some motion solves."""
        return sum(one.episode.ended == "succeeded" for one in self.variations)

    @computed_field  # type: ignore[prop-decorator]
    @property
    def success_share(self) -> float:
        """Share of the variations that some motion solves."""
        return self.won / len(self.variations)

    @computed_field  # type: ignore[prop-decorator]
    @property
    def progress(self) -> float:
        """Mean over the variations of the best progress, 0 to 1."""
        return sum(one.episode.best_progress for one in self.variations) / len(self.variations)

    @property
    def why_ended(self) -> str:
        """Reason why the search ended, in words."""
        match self.ended_by:
            case "solved" if self.success_share < 1:
                return f"each variation was solved in the search; rounded as reported, motions solve {self.won}"
            case "solved":
                return "every variation is solved"
            case "candidates":
                return f"all {self.motions} motions for each variation were tried"
            case "budget":
                return f"its {self.max_steps:,} physics steps are used up; with more it may get farther"

    @property
    def best(self) -> ProbedVariation:
        """Variation with the best episode."""
        return max(self.variations, key=lambda one: (one.episode.ended == "succeeded", one.episode.best_progress))
