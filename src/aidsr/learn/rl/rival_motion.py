"""Search for a motion that a policy has to beat: a probe may find one in seconds where learning fails."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.overlap_meter import OverlapMeter
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop import Motion, ProbeReport, probe_scene
from aidsr.learn.openloop.motion import Motions, OpenLoopPolicy
from aidsr.learn.openloop.script import script_of

SEARCHED = 4
"""Number of variations that are searched. Our choice: compared with the usual two, four motions that each succeed in
one variation more often include one that also succeeds in others, although they get a little less far in their own."""
CHOSEN_IN, TOLD_BY = 8, 20
"""Number of variations in which the successful motions are compared, and number of other variations in which the
success share of the best one is measured."""
LEAST_WON = 0.5
"""Smallest success share in both sets of variations: the same that makes a design successful."""


@dataclass(frozen=True)
class RivalMotion:
    """Result of the search for a motion.

    Attributes:
        report: Report of the probe.
        script: The motion as a script; "" where none succeeds often enough.
        share: Success share in variations that were not used to choose the motion; 0 without a motion.
        steps: Control steps used by search and comparison.
    """

    report: ProbeReport
    script: str
    share: float
    steps: int


def find_rival(scene: TaskScene, *, seed: int, threads: int) -> RivalMotion:
    """Search for a motion that succeeds, and test it in variations in which it was not searched.

    The search has the budget of `aidsr probe`.

    Args:
        scene: Scene to search in; its actions are not held.
        seed: Seed of the search.
        threads: Native threads; 0 takes all processors.
    """
    played = _Played(scene, threads)
    report = probe_scene(scene, variations=SEARCHED, seed=seed, threads=threads)
    succeeded = [one.motion for one in report.variations if one.episode.ended == "succeeded"]
    won = [motion for index, motion in enumerate(succeeded) if motion not in succeeded[:index]]
    shares = [played.share(motion, range(SEARCHED, SEARCHED + CHOSEN_IN)) for motion in won]
    script, share = "", 0.0
    if shares and max(shares) >= LEAST_WON:
        best = won[shares.index(max(shares))]
        share = played.share(best, range(SEARCHED + CHOSEN_IN, SEARCHED + CHOSEN_IN + TOLD_BY))
        script = script_of(best) if share >= LEAST_WON else ""
    steps = round((report.simulated_s + played.simulated_s) / scene.task.control_dt_s)
    return RivalMotion(report, script, share if script else 0.0, steps)


class _Played:
    """Plays motions in development variations and sums up the simulated time."""

    def __init__(self, scene: TaskScene, threads: int) -> None:
        self._scene, self._threads = scene, threads
        self.simulated_s = 0.0

    def share(self, motion: Motion, numbers: Sequence[int]) -> float:
        """Return the share of the given variations in which a motion succeeds."""
        task = self._scene.task
        variations = [task.variation("development", number) for number in numbers]
        episodes = Episodes(self._scene.model, task, self._scene.actions, variations, threads=self._threads)
        overlaps = OverlapMeter(episodes)
        policy = OpenLoopPolicy(Motions.of([motion] * len(numbers)), task.control_dt_s)
        course = rollout(episodes, policy, overlaps.after)
        self.simulated_s += float(course.time_s.sum())
        return float((course.success & ~overlaps.is_deep).mean())
