"""What a study will take, before it is begun: jobs, hours, money and disk."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from statistics import median

from aidsr.artifacts import Artifact
from aidsr.benchmark.jobs import pending
from aidsr.benchmark.outcomes import DesignRow, read_outcomes
from aidsr.benchmark.study import Study
from aidsr.benchmark.tables import PAPER
from aidsr.pipeline.teams import SEARCH, asks_nobody

__all__ = ["Forecast", "forecast"]

_BUILTIN_S = 15.0
"""A design of the built-in team [s]. Source: `make demo`, 27 s for three side by side on two busy cores."""
_SEARCH_S = 300.0
"""A design that is searched for [s]. Our guess: 48 robots, each validated and probed for a few seconds."""
_STEPS_PER_S = 2500.0
"""Control steps of a single-threaded training. Source: docs/learning.md, end to end on one core."""
_PROBE_S = 20.0
"""Source: docs/probe.md."""
_DESIGN_MB, _TRAINING_MB = 1.0, 3.0
"""Files of a design and of a training. Source: sizes of such folders, films included."""


class Forecast(Artifact):
    """What is still to be done and what it may take. Where the study has finished designs, theirs are the measure."""

    jobs: dict[str, int]
    """Jobs that can be begun now, by stage; trainings of robots that are not designed yet are counted as if all were
    approved."""
    core_hours: float
    cost_usd: float
    """With language models; where nothing was measured, the published figure for GPT-5 is taken."""
    disk_mb: float
    measured: bool
    """Whether designs of this study were the measure."""


def forecast(study: Study) -> Forecast:
    """Return what a study will take from where it stands."""
    plan, now = study.plan, Counter(job.stage for job in pending(study))
    begun = {cell for cell in study.cells if study.run(cell) is not None}
    coming = sum(study.arm(cell.arm).config.concepts for cell in study.cells if cell not in begun)
    jobs = Counter(now)
    jobs["verify"] += coming
    jobs["train"] += coming * plan.seeds
    jobs["probe"] += coming * plan.probe
    rows = read_outcomes(study)
    hours, dollars = 0.0, 0.0
    for cell in study.cells:
        if cell in begun:
            continue
        config = study.arm(cell.arm).config
        own = [row for row in rows if row.arm == cell.arm and row.outcome not in ("unfinished", "failed")]
        if study.before(cell) and not study.arm(cell.arm).feedback:
            continue  # the designs are there
        hours += config.concepts * _seconds(own, config.model) / 3600
        dollars += config.concepts * _dollars(own, config.model)
    trained = [row for row in rows if row.training_s > 0]
    each_s = median(row.training_s for row in trained) if trained else plan.steps / _STEPS_PER_S
    hours += (jobs["train"] * each_s + jobs["probe"] * _PROBE_S) / 3600
    return Forecast(
        jobs=dict(jobs),
        core_hours=hours,
        cost_usd=dollars,
        disk_mb=coming * _DESIGN_MB + jobs["train"] * _TRAINING_MB,
        measured=bool(trained),
    )


def _seconds(own: Sequence[DesignRow], model: str) -> float:
    """Return how long a design takes the machine; waiting for a language model takes no core."""
    if own and asks_nobody(model):
        return median(row.latency_s for row in own)
    return _SEARCH_S if model == SEARCH else _BUILTIN_S


def _dollars(own: Sequence[DesignRow], model: str) -> float:
    if asks_nobody(model):
        return 0.0
    costs = [row.usage.cost_usd for row in own if row.usage.cost_usd is not None]
    return median(costs) if costs else PAPER.cost_usd
