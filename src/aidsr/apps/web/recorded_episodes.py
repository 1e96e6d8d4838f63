"""Recorded episodes of trained policies, and the view they are played in."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from aidsr.apps.web.view3d import SceneView
from aidsr.core.errors import UserError
from aidsr.runs import DesignFolder
from aidsr.runs.trainings import trainings_of


@dataclass(frozen=True)
class Motion:
    """A recorded episode on disk."""

    name: str
    path: Path


@dataclass
class Stage:
    """The view of a page that plays episodes; there may be none yet, and it may be redrawn."""

    view: SceneView | None = None

    def replay(self, name: str) -> None:
        """Play an episode.

        Raises:
            UserError: The view does not hold it yet.
        """
        if self.view is None or name not in self.view.episodes:
            raise UserError(f"the view does not hold “{name}” yet; wait a second, or reload the page")
        self.view.replay(name)


def replay_name(training: int, path: Path) -> str:
    """Return what a recorded episode is called where a person chooses among those of all trainings."""
    return f"{path.stem} of training {training}"


def list_motions(design: DesignFolder) -> tuple[Motion, ...]:
    """Return what can be replayed of a design's judged policies, the newest training first."""
    judged = [one for one in reversed(trainings_of(design)) if one.evaluation.path.exists()]
    return tuple(Motion(replay_name(one.number, motion.path), motion.path) for one in judged for motion in one.motions)
