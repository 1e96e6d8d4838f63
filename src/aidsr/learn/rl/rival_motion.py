"""A motion that a policy has to beat: what a probe finds in seconds may serve a body that learning misses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop import Motion, ProbeReport, probe_scene
from aidsr.learn.openloop.motion import Motions, OpenLoopPolicy
from aidsr.learn.openloop.script import script_of

SEARCHED = 4
"""Variations that are searched. Our choice: of four motions that win one variation each, one more often wins others too
than of the usual two, which come a little farther in their own."""
CHOSEN_IN, TOLD_BY = 8, 20
"""Variations in which the motions that won are compared, and others that tell the share of the best of them."""
LEAST_WON = 0.5
"""Share that it has to win of both: as much as makes a design successful."""


@dataclass(frozen=True)
class RivalMotion:
    """What a search came to.

    Attributes:
        report: Of the probe.
        script: The motion as a script; "" where none wins often enough.
        share: Of variations that had no part in choosing it; 0 without a motion.
        steps: Control steps that search and comparison took.
    """

    report: ProbeReport
    script: str
    share: float
    steps: int


def find_rival(scene: TaskScene, *, seed: int, threads: int) -> RivalMotion:
    """Search a motion that wins, with the budget of `aidsr probe`, and play it in variations it was not searched in.

    Args:
        scene: To search in; its actions are not held.
        seed: Of the search.
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
    """Plays motions in development variations, and counts for how long."""

    def __init__(self, scene: TaskScene, threads: int) -> None:
        self._scene, self._threads = scene, threads
        self.simulated_s = 0.0

    def share(self, motion: Motion, numbers: Sequence[int]) -> float:
        """Return the share of these variations that a motion wins."""
        task = self._scene.task
        variations = [task.variation("development", number) for number in numbers]
        episodes = Episodes(self._scene.model, task, self._scene.actions, variations, threads=self._threads)
        course = rollout(episodes, OpenLoopPolicy(Motions.of([motion] * len(numbers)), task.control_dt_s))
        self.simulated_s += float(course.time_s.sum())
        return float(course.success.mean())
