"""How far a body gets without learning, by the best of many open-loop motions; see `aidsr.learn.openloop`."""

from __future__ import annotations

from collections.abc import Sequence

from aidsr.learn.openloop.report import ProbedVariation
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits
from aidsr.tools.measured import Figure, Measured
from aidsr.tools.scene import MeasuredScene

_LIMITS = Limits(wall_s=7200.0, cpu_s=3600.0)
_STEPS_PER_S, _LEAST_STEPS = 1_000_000 / 60, 500_000
"""Physics steps of a search for each second that an episode may last, and at least. Our choice: in 150,000 steps
fewer than 40 motions of a task of 50 s were tried, and scenes came out in any order; in 250,000 of one of 15 s 41."""
_LONGEST_S = 15.0
"""How long motions of the search are played. Our choice: a crawler shows after 15 s whether it goes straight."""
_CANDIDATES = 320
_MOST_SEEDS = 8
MEAN_PROGRESS = "progress, mean of the seeds"
"""The figure of a probe by which scenes are compared."""


class Probed(Measured):
    """What a probe found."""

    best: ProbedVariation
    """The motion that got farthest, and the variation in which it did."""


@isolated(limits=_LIMITS)
def probe_motions(
    scene: MeasuredScene,
    *,
    seeds: Sequence[int] = (0, 1),
    variations: int = 1,
    steps: int = 0,
    seconds: float = 0.0,
) -> Probed:
    """Search open-loop motions with several seeds, and play the best one again with figures.

    Ramps, sinusoids of one frequency, both, and gaits from rest with a frequency for each group; groups may stay at
    rest. Each seed is a search of its own: they show how much a result is worth.

    Args:
        scene: The scene.
        seeds: Of the searches.
        variations: Development variations, each searched for itself.
        steps: Physics steps of each search; by the length of the task's episodes unless given.
        seconds: How long a motion of the search is played at most; 15 s, or the task's time, unless given.

    Raises:
        UserError: A number is out of range, or the scene is not one of its task.
        MjcfError: The scene cannot be loaded.
        IsolationError: It took too long.
    """
    import numpy as np

    from aidsr.core.errors import UserError
    from aidsr.learn.openloop import probe_scene
    from aidsr.learn.openloop.motion_search import ALL_KINDS
    from aidsr.learn.openloop.script import parse_script, script_of
    from aidsr.tools.playing import record

    if not 1 <= len(set(seeds)) == len(seeds) <= _MOST_SEEDS:
        raise UserError(f"seeds must be 1 to {_MOST_SEEDS} different numbers: {list(seeds)}")
    loaded = scene.load()
    steps = steps or max(_LEAST_STEPS, round(_STEPS_PER_S * loaded.task.time_limit_s))
    reports = [
        probe_scene(
            loaded,
            candidates=_CANDIDATES,
            variations=variations,
            max_steps=steps,
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
    policy = parse_script(script).played_by(
        [group.name for group in loaded.actions.groups], loaded.actions.rest, loaded.task.control_dt_s
    )
    again = record(loaded, policy, variation=best.episode.variation)
    figures = (
        Figure(name=MEAN_PROGRESS, value=float(progress.mean())),
        Figure(name="least", value=float(progress.min())),
        Figure(name="most", value=float(progress.max())),
        Figure(name="variations solved", value=float(np.mean([report.success_share for report in reports]))),
    )
    lines = [
        f"seed {report.seed}: progress {report.progress:.2f}, {report.reached}; {report.motions} motions a variation, "
        f"{report.played_steps:,} steps; ended because {report.why_ended}"
        for report in reports
    ]
    lines += [f"the best motion ({best.family}), as a script:", script, "played to its end:", again.text()]
    return Probed(figures=figures, lines=tuple(lines), best=best)
