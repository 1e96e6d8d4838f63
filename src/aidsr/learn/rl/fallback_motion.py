"""Search for a motion that replaces a policy which succeeds less often: a probe may find one where learning fails."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from aidsr.core.artifacts import SUCCESSFUL_SHARE
from aidsr.learn.episodes.batch import Episodes
from aidsr.learn.episodes.overlap_meter import rollout_without_overlap
from aidsr.learn.episodes.rollout import Constant
from aidsr.learn.episodes.scene import TaskScene
from aidsr.learn.openloop import Motion, ProbeReport, probe_scene
from aidsr.learn.openloop.motion import Motions, OpenLoopPolicy
from aidsr.learn.openloop.script import script_of
from aidsr.learn.rl.recipe import Recipe
from aidsr.learn.rl.training_config import TrainingConfig
from aidsr.learn.rl.training_folder import CONFIG_FILE, PROBE_FILE, TrainingFolder

SEARCHED = 4
"""Number of variations that are searched. Our choice: compared with the usual two, four motions that each succeed in
one variation more often include one that also succeeds in others, although they get a little less far in their own."""
CHOSEN_IN, REPORTED_ON = 8, 20
"""Number of variations in which the successful motions are compared, and number of other variations in which the
success share of the best one is measured."""
_CLEARLY = 4
"""Number of episodes, of `REPORTED_ON`, by which a motion must exceed the learned policy to replace it. Our choice: a
fifth, twice the standard error of 20 episodes."""


@dataclass(frozen=True)
class FallbackMotion:
    """Result of the search for a motion.

    Attributes:
        report: Report of the probe.
        script: The motion as a script; "" where none succeeds often enough.
        share: Success share in variations that were not used to choose the motion; 0 without a motion.
        steps: Control steps used by search and comparison; the checks are not counted, as those of an evaluation.
        failed_checks: Names of the checks by which a motion that succeeds often enough is implausible, and not used.
    """

    report: ProbeReport
    script: str
    share: float
    steps: int
    failed_checks: tuple[str, ...] = ()


def is_clearly_better(motion_share: float, policy_share: float) -> bool:
    """Return whether a motion succeeds more often than a policy by more than chance, in `REPORTED_ON` episodes each."""
    # whole episodes: differences of shares such as 0.7 - 0.5 are inexact
    return round(REPORTED_ON * motion_share) - round(REPORTED_ON * policy_share) >= _CLEARLY


def find_fallback_motion(scene: TaskScene, *, seed: int, threads: int) -> FallbackMotion:
    """Search for a motion that succeeds, and test it in variations in which it was not searched.

    The search has the budget of `aidsr probe`. A motion that an evaluation would call implausible is not used.

    Args:
        scene: Scene to search in; its actions are not held.
        seed: Seed of the search.
        threads: Native threads; 0 takes all processors.
    """
    played = _Played(scene, threads)
    report = probe_scene(scene, variations=SEARCHED, seed=seed, threads=threads)
    succeeded = [one.motion for one in report.variations if one.episode.ended == "succeeded"]
    distinct = [motion for index, motion in enumerate(succeeded) if motion not in succeeded[:index]]
    shares = [played.share(motion, range(SEARCHED, SEARCHED + CHOSEN_IN)) for motion in distinct]
    script, share = "", 0.0
    failed: tuple[str, ...] = ()
    if shares and max(shares) >= SUCCESSFUL_SHARE:
        best = distinct[shares.index(max(shares))]
        others = range(SEARCHED + CHOSEN_IN, SEARCHED + CHOSEN_IN + REPORTED_ON)
        share = played.share(best, others)
        if share >= SUCCESSFUL_SHARE:
            failed = _failed_checks(scene, script_of(best), others, threads)
            script = "" if failed else script_of(best)
    steps = round((report.simulated_s + played.simulated_s) / scene.task.control_dt_s)
    return FallbackMotion(report, script, share if script else 0.0, steps, failed)


def record_fallback_motion(
    home: TrainingFolder, scene: TaskScene, config: TrainingConfig, threads: int
) -> TrainingConfig:
    """Search for a motion, and write and return the settings with it; probe.json marks this as done."""
    began = time.perf_counter()
    found = find_fallback_motion(scene, seed=config.seed, threads=threads)
    best = found.report.best
    home.log_event(
        "probed",
        steps=found.steps,
        ended=best.episode.ended,
        motion=best.motion.summary,
        success_share=found.share,
        failed_checks=list(found.failed_checks),
    )
    probe_s = round(time.perf_counter() - began, 2)
    config = config.model_copy(
        update={"motion": found.script, "motion_share": found.share, "probe_steps": found.steps, "probe_s": probe_s}
    )
    if found.share >= config.recipe.saturation:
        config = config.with_the_motion()
    home.write(CONFIG_FILE, config.model_dump_json(indent=2) + "\n")
    home.write(PROBE_FILE, found.report.model_dump_json(indent=2) + "\n")
    return config


def _failed_checks(scene: TaskScene, script: str, numbers: range, threads: int) -> tuple[str, ...]:
    """Return the names of an evaluation's checks by which a motion is implausible in some development variations."""
    from aidsr.learn.episodes.policy_checks import motion_checks, rollout_with_stats

    moving = Recipe(algorithm="sac").beginning_with(script).acting_in(scene)
    uncorrected = Constant(np.zeros(scene.actions.size))
    rolled = rollout_with_stats(moving, uncorrected, numbers, threads=threads, split="development")
    checks = motion_checks(moving, uncorrected, rolled, numbers, threads=threads)
    return tuple(check.name for check in checks if not check.passed)


class _Played:
    """Plays motions in development variations and sums up the simulated time."""

    def __init__(self, scene: TaskScene, threads: int) -> None:
        self._scene, self._threads = scene, threads
        self.simulated_s = 0.0

    def share(self, motion: Motion, numbers: Sequence[int]) -> float:
        """Return the share of the given variations in which a motion succeeds without deep overlap."""
        task = self._scene.task
        variations = [task.variation("development", number) for number in numbers]
        episodes = Episodes(self._scene.model, task, self._scene.actions, variations, threads=self._threads)
        policy = OpenLoopPolicy(Motions.of([motion] * len(numbers)), task.control_dt_s)
        course = rollout_without_overlap(episodes, policy)
        self.simulated_s += float(course.time_s.sum())
        return float(course.success.mean())
