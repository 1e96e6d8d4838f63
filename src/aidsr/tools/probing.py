"""Probe of a scene: progress of the best of many open-loop motions, without learning; see `aidsr.learn.openloop`."""

from __future__ import annotations

from collections.abc import Sequence

from aidsr.learn.openloop.report import ProbedVariation
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tools.measured import Figure, Measured
from aidsr.tools.scene import MeasuredScene

_LIMITS = Limits(wall_s=7200.0, cpu_s=3600.0)
_STEPS_PER_S, _LEAST_STEPS = 1_000_000 / 60, 500_000
"""Physics steps of a search per second of the task's time limit, and smallest number of steps. Our choice: with 150,000
steps for a task of 50 s, fewer than 40 motions were tried and the ranking of scenes was random; with 250,000 steps for
a task of 15 s, 41 motions were tried."""
_LONGEST_S = 15.0
"""Longest duration of a motion in the search. Our choice: after 15 s it is visible whether a crawler goes straight."""
_CANDIDATES = 320
_MOST_SEEDS = 8
MEAN_PROGRESS = "progress, mean of the seeds"
"""Name of the figure of a probe by which scenes are compared."""
VARIATIONS_SOLVED = "variations solved"
"""Name of the figure with the share of the variations that some motion solves, mean of the seeds."""


class Probed(Measured):
    """Result of a probe."""

    best: ProbedVariation
    """The best motion, with its variation and episode."""


@isolated(limits=_LIMITS)
def probe_motions(
    scene: MeasuredScene,
    *,
    seeds: Sequence[int] = (0, 1),
    variations: int = 1,
    max_steps: int = 0,
    seconds: float = 0.0,
) -> Probed:
    """Search for open-loop motions with several seeds, then play and record the best one for a full episode.

    The motions are ramps, sinusoids of one frequency, combinations of both, and gaits from rest with a frequency for
    each group; some groups can stay at rest. Each seed is a separate search; the spread over seeds shows the
    reliability of the result.

    Args:
        scene: The scene.
        seeds: Seeds of the searches.
        variations: Number of development variations, each searched separately.
        max_steps: Maximum physics steps of each search; 0 for a number that depends on the task's time limit
            and on the number of variations.
        seconds: Longest duration of a motion in the search [s], at most the task's time limit; 0 for 15 s.

    Raises:
        UserError: A number is out of range, or the scene does not belong to its task.
        MjcfError: The scene cannot be loaded.
        IsolationError: The probe exceeded a limit.
    """
    import numpy as np

    from aidsr.core.errors import UserError
    from aidsr.learn.openloop import probe_scene
    from aidsr.learn.openloop.motion_search import ALL_KINDS
    from aidsr.learn.openloop.probe_scene import STEPS_PER_S
    from aidsr.learn.openloop.script import script_of
    from aidsr.learn.openloop.script_policy import script_policy
    from aidsr.tools.playing import record

    if not 1 <= len(set(seeds)) == len(seeds) <= _MOST_SEEDS:
        raise UserError(f"seeds must be 1 to {_MOST_SEEDS} different numbers: {list(seeds)}")
    loaded = scene.load()
    time_s = loaded.task.time_limit_s
    max_steps = max_steps or max(_LEAST_STEPS, round(max(_STEPS_PER_S, STEPS_PER_S * variations) * time_s))
    reports = [
        probe_scene(
            loaded,
            candidates=_CANDIDATES,
            variations=variations,
            max_steps=max_steps,
            longest_s=seconds or _LONGEST_S,
            kinds=ALL_KINDS,
            seed=seed,
            threads=1,
        )
        for seed in seeds
    ]
    progress = np.array([report.progress for report in reports])
    best = reports[int(progress.argmax())].best
    script = script_of(best.motion)
    again = record(loaded, script_policy(loaded, script), variation=best.episode.variation)
    figures = (
        Figure(name=MEAN_PROGRESS, value=float(progress.mean())),
        Figure(name="least", value=float(progress.min())),
        Figure(name="most", value=float(progress.max())),
        Figure(name=VARIATIONS_SOLVED, value=float(np.mean([report.success_share for report in reports]))),
    )
    lines = [
        f"seed {report.seed}: progress {report.progress:.2f}, {report.reached}; {report.motions} motions a variation, "
        f"{report.played_steps:,} steps; ended because {report.why_ended}"
        for report in reports
    ]
    lines += [f"the best motion ({best.family}), as a script:", script, "played to its end:", again.text()]
    return Probed(figures=figures, lines=tuple(lines), best=best)
