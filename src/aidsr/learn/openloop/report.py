"""The report of a probe: how far a body got without learning, and by which motion."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Field, computed_field

from aidsr.core.artifacts import Artifact, EpisodeResult
from aidsr.learn.openloop.motion import Motion
from aidsr.learn.openloop.motion_search import MotionKind

EndedBy = Literal["solved", "candidates", "budget"]
"""What ended a search: it solved all variations, all motions were tried, or its physics steps are used up."""


class ProbedVariation(Artifact):
    """The best motion found for one variation of the task, and how its whole episode went."""

    episode: EpisodeResult
    family: MotionKind
    motion: Motion


class ProbeReport(Artifact):
    """How far a body gets without learning.

    The shares stand in the file as well; they are recomputed when the file is read.
    """

    model_config = ConfigDict(extra="ignore")

    task: str
    level: str
    benchmark_version: int
    seed: int
    candidates: int
    """Motions allowed for each variation, tried in whole generations of 16; a variation that one of them solves is
    searched no further."""
    max_steps: int = 0
    """Physics steps allowed for all; 0 in reports from before there was this bound."""
    ended_by: EndedBy = "candidates"
    searched_s: float
    """How long motions of the search were played at most [s of simulation]; those reported are played to the end."""
    motions: int = 0
    """Tried for each variation, or until it was solved."""
    played_steps: int = 0
    """Physics steps of all episodes together."""
    simulated_s: float
    """Of all episodes together."""
    wall_s: float
    variations: Annotated[tuple[ProbedVariation, ...], Field(min_length=1)]
    """Development variations, each with the best motion found for it."""
    same_motion_share: float
    """Share of these variations that the best single one of the motions solves: near `success_share` where the
    variations hardly matter, far below it where a robot has to look."""
    reached: str
    """How far the best episode came, in words."""
    hold_s: float = 0.0
    """How long the goal has to hold without a break [s]; 0 in older reports."""
    versions: dict[str, str] = Field(default_factory=dict)

    @property
    def won(self) -> int:
        """How many of the variations some motion solves."""
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
        """What ended the search, in words."""
        match self.ended_by:
            case "solved" if self.success_share < 1:
                return f"each variation was solved in the search; rounded as reported, motions solve {self.won}"
            case "solved":
                return "every variation is solved"
            case "candidates":
                return f"all {self.motions} motions for each variation were tried"
            case "budget":
                return f"its {self.max_steps:,} physics steps are used up; a larger --max-steps may get farther"

    @property
    def best(self) -> ProbedVariation:
        """The variation that went best."""
        return max(self.variations, key=lambda one: (one.episode.ended == "succeeded", one.episode.best_progress))
