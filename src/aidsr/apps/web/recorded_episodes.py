"""Recorded episodes of trained policies and of probes, and the view that plays them."""

from __future__ import annotations

import hashlib
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from aidsr.apps.web.measure_form import goal_file
from aidsr.apps.web.site import Site
from aidsr.apps.web.view3d import Episode, SceneView
from aidsr.core.errors import UserError
from aidsr.runs import DesignFolder, Run
from aidsr.runs.files import JsonFile, replace_file
from aidsr.runs.trainings import Training, trainings_of
from aidsr.tasks import task_names

if TYPE_CHECKING:
    from aidsr.tasks import Level


@dataclass(frozen=True)
class Motion:
    """A recorded episode on disk."""

    name: str
    path: Path


@dataclass
class Stage:
    """The page's view that plays episodes; `view` is None until it is drawn, and replaced when it is redrawn."""

    view: SceneView | None = None

    def replay(self, name: str) -> None:
        """Play an episode that the view holds.

        Raises:
            UserError: The view does not hold an episode of that name yet.
        """
        if self.view is None or name not in self.view.episodes:
            raise UserError(f"“{name}” is not loaded in the 3-D view yet; wait a second, or reload the page")
        self.view.replay(name)

    def play(self, episode: Episode) -> None:
        """Play an episode; it is added to the view first.

        Raises:
            UserError: There is no view.
        """
        if self.view is None:
            raise UserError("there is no 3-D view to play the episode in; reload the page")
        self.view.play(episode)


def record(site: Site, training: Training, variation: int) -> Episode:
    """Return one held-out episode with cables, contacts and progress over time; may take seconds.

    The policy plays it again, because an evaluation stores the positions of two episodes only. The recording is kept in
    the web app's own folder.

    Raises:
        UserError: The training has no policy, or its files do not fit together.
        IsolationError: Recording takes too long.
    """
    from aidsr.learn.rl.recording import record_episode

    kept = kept_recording(site, training, variation)
    if not kept.exists():
        replace_file(kept, record_episode(training.path, variation))
    return Episode.read(kept, f"{variation} of training {training.number}")


def kept_recording(site: Site, training: Training, variation: int) -> Path:
    """Return the path at which the recording of an episode is kept; it differs for each policy.

    Raises:
        UserError: The training has no policy.
    """
    policy = training.policy
    if not policy.exists():
        raise UserError("the episodes of this training cannot be replayed: policy.zip not found")
    return _kept(site, policy, variation)


def record_probed(site: Site, run: Run, design: DesignFolder, index: int) -> Episode:
    """Return the best motion of a probe for one of its variations, recorded as by `record`; may take seconds.

    Args:
        site: The site.
        run: The run of the design.
        design: The design that was probed.
        index: Index of the variation in the report.

    Raises:
        UserError: The report belongs to another robot, cannot be read, or was made with another goal.
        IsolationError: Recording takes too long.
    """
    from aidsr.api import find_scene
    from aidsr.learn.episodes.scene import read_mjcf_text
    from aidsr.learn.openloop import ProbeReport
    from aidsr.learn.openloop.recorded_motion import record_motion

    file = JsonFile(design.probe, ProbeReport)
    report = file.read()
    if report is None or not 0 <= index < len(report.variations):
        raise UserError("this probe no longer exists; reload the page")
    probed, kept = report.variations[index], _kept(site, file.path, index)
    if not kept.exists():
        named = report.task if report.task in task_names() and report.task != run.asked().task else ""
        goal = goal_file(site, site.probe_name(run, design.number))
        added = bool(not named and not run.asked().task and not run.goal.path.exists() and goal.exists())
        level = cast("Level", report.level) if named else None
        found = find_scene(design, named, level=level, goal=goal if added else "")
        newer = added and goal.stat().st_mtime_ns > file.path.stat().st_mtime_ns
        if newer or (added and getattr(found.task, "name", found.task) != report.task):
            raise UserError("the goal was changed since this probe; probe again, then replay")
        scene = read_mjcf_text(found.scene)
        replace_file(kept, record_motion(scene, found.task, probed, level=found.level, groups=tuple(found.groups)))
    return Episode.read(kept, f"{probed.episode.variation} of the probe")


def _kept(site: Site, made_by: Path, index: int) -> Path:
    """Return the path of an episode recorded from the file `made_by`; it differs for each state of that file."""
    taken = f"{made_by.resolve()} {made_by.stat().st_mtime_ns} {index}"
    return site.own / "episodes" / f"{hashlib.sha256(taken.encode()).hexdigest()[:24]}.npz"


def variation_of(motion: Path) -> int | None:
    """Return the held-out variation of a recorded motion; None where the file does not contain it."""
    try:
        with np.load(motion, allow_pickle=False) as stored:
            return int(stored["variation"])
    except (OSError, KeyError, ValueError, zipfile.BadZipFile):
        return None


def replay_name(training: int, path: Path) -> str:
    """Return the name of a recorded episode in the list of episodes of all trainings."""
    return f"{path.stem} of training {training}"


def list_motions(design: DesignFolder) -> tuple[Motion, ...]:
    """Return the recorded motions of a design's evaluated policies, the newest training first."""
    judged = [one for one in reversed(trainings_of(design)) if one.evaluation.path.exists()]
    return tuple(Motion(replay_name(one.number, motion.path), motion.path) for one in judged for motion in one.motions)
