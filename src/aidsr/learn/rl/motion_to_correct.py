"""A motion for a policy to begin with: one that a probe finds, and that wins nearly everywhere without seeing."""

from __future__ import annotations

from dataclasses import dataclass

from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.rollout import rollout
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop import Motion, ProbeReport, probe_scene
from aidsr.learn.openloop.motion import Motions, OpenLoopPolicy
from aidsr.learn.openloop.script import script_of

LEAST_STEPS = 10_000
"""Control steps of a training before which nothing is searched. Our choice: the search takes up to 15,000 itself."""
SEARCHED = 4
"""Variations that are searched. Our choice: of four motions that win one variation each, one more often wins others too
than of the usual two, which come a little farther in their own."""
OTHERS = 8
"""Variations that the search did not see, in which a motion that won is played."""
LEAST_WON = 0.75
"""Share of these that it has to win. Our choice, well above the half that makes a design successful: a policy changes
the action of its motion by little, and what needs more than that is better learned from nothing."""


@dataclass(frozen=True)
class FoundMotion:
    """What a search came to.

    Attributes:
        report: Of the probe.
        script: The motion as a script; "" where none wins often enough.
        share: Of the other variations that the best motion wins; None where none won in the search.
        steps: Control steps that search and other variations took.
    """

    report: ProbeReport
    script: str
    share: float | None
    steps: int


def find_motion(scene: TaskScene, *, seed: int, threads: int) -> FoundMotion:
    """Search a motion that wins, with the budget of `aidsr probe`, and play it where the search did not look.

    Args:
        scene: To search in; its actions are not held.
        seed: Of the search.
        threads: Native threads; 0 takes all processors.
    """
    control_dt_s = scene.task.control_dt_s
    report = probe_scene(scene, variations=SEARCHED, seed=seed, threads=threads)
    taken = report.simulated_s
    best, best_share = "", None
    for motion in _winning(report):
        variations = [scene.task.variation("development", SEARCHED + index) for index in range(OTHERS)]
        episodes = Episodes(scene.model, scene.task, scene.actions, variations, threads=threads)
        course = rollout(episodes, OpenLoopPolicy(Motions.of([motion] * OTHERS), control_dt_s))
        taken += float(course.time_s.sum())
        share = float(course.success.mean())
        if best_share is None or share > best_share:
            best, best_share = script_of(motion), share
    enough = best_share is not None and best_share >= LEAST_WON
    return FoundMotion(report, best if enough else "", best_share, round(taken / control_dt_s))


def _winning(report: ProbeReport) -> list[Motion]:
    """Return the motions that won their variation, each once."""
    won = [one.motion for one in report.variations if one.episode.ended == "succeeded"]
    return [motion for index, motion in enumerate(won) if motion not in won[:index]]
