"""Estimate of the remaining effort of a study: jobs, core hours, cost, tokens and disk space."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from statistics import fmean, median
from typing import get_args

from aidsr.core.artifacts import Artifact, PerturbationKind
from aidsr.core.config import Protocol, RunConfig
from aidsr.studies.jobs import is_finished, pending_in
from aidsr.studies.outcomes import DesignRow, read_outcomes
from aidsr.studies.study import Study
from aidsr.studies.tables import PAPER
from aidsr.teams.providers import is_offline
from aidsr.teams.providers.offline import SEARCH

_BUILTIN_S = 6.0
"""Duration of a design by the built-in team [s]. Source: docs/studies.md, mean over tasks."""
_SEARCHED_ROBOT_S = 5.0
"""CPU time of one robot of a search [s]: written, placed, validated, and probed within 90,000 steps.

Source: `aidsr.teams.baselines.search.probe_value` for the rules' concept of seed 0 on the first ten of `aidsr tasks`,
on one core of a Xeon at 2.5 GHz that others used too: 4.7 s on average, 1.0 to 11.4 s; rounded up."""
_STEPS_PER_S: dict[Protocol, float] = {"paper": 300.0, "best": 150.0}
"""Control steps per second of a single-threaded training, by protocol. Source: docs/studies.md, 300,000 steps by
"paper" in 1,000 s, mean over tasks; a step of "best" costs about twice as much, docs/learning.md."""
_JUDGING_S = 5 * 43.0
"""Duration of the 100 held-out episodes of a policy [s]. Source: docs/studies.md, 43 s for 20 episodes, and
docs/learning.md, duration of 100."""
_PERTURBED = len(get_args(PerturbationKind))
"""Number of repetitions of a successful policy's held-out episodes where the plan includes perturbed scenes."""
_PROBE_S = 20.0
"""Duration of a probe [s]. Source: docs/learning.md."""
_DESIGN_MB, _TRAINING_MB = 1.0, 3.0
"""Size of the files of a design and of a training. Source: sizes of such folders, videos included."""


class StudyEstimate(Artifact):
    """Remaining jobs of a study and their estimated effort, based on its finished designs where it has some."""

    jobs: dict[str, int]
    """Number of remaining jobs by stage, assuming that all future designs are approved and, where the plan includes
    perturbed scenes, that all policies are successful."""
    core_hours: float
    """CPU time, without the time spent waiting for language models."""
    cost_usd: float
    """Cost of language models; the published value for GPT-5 is used where nothing was measured."""
    tokens: int
    """Input and output tokens of language models; the published value is used where nothing was measured."""
    disk_mb: float
    measured: bool
    """Whether the estimate is based on finished designs of this study."""
    published_costs: bool
    """Whether the cost includes the published value."""


def estimate_study(study: Study) -> StudyEstimate:
    """Return the estimated effort for the rest of a study."""
    rows, jobs, plan = read_outcomes(study), Counter[str](), study.plan
    hours, dollars, tokens, coming, published = 0.0, 0.0, 0.0, 0, False
    trained = _seconds_by_task(rows)
    for cell in study.cells:
        arm, left = study.arm(cell.arm), Counter[str](job.stage for job in pending_in(study, cell))
        if not is_finished(study.run(cell)):
            concepts = arm.config.concepts
            left.update(verify=concepts, train=concepts * plan.seeds, probe=concepts * plan.probe)
            left["design"] = 1
            coming += concepts
            own = [row for row in rows if row.arm == cell.arm and row.outcome not in ("unfinished", "failed")]
            # an arm that continues another arm's designs makes no new ones, unless it has a person's feedback
            if not arm.after or arm.feedback:
                hours += concepts * _seconds(own, arm.config) / 3600
                dollars += concepts * _dollars(own, arm.config.model)
                tokens += concepts * _tokens(own, arm.config.model)
                published = published or _is_published(own, arm.config.model)
        each_s = trained.get(cell.task) or trained.get("") or plan.steps / _STEPS_PER_S[plan.protocol]
        judging_s = _JUDGING_S * (1 + _PERTURBED * plan.perturbed)
        hours += (left["train"] * (each_s + judging_s) + left["probe"] * _PROBE_S) / 3600
        jobs.update(left)
    return StudyEstimate(
        jobs={stage: jobs[stage] for stage in ("design", "verify", "train", "probe")},
        core_hours=hours,
        cost_usd=dollars,
        tokens=round(tokens),
        disk_mb=coming * _DESIGN_MB + jobs["train"] * _TRAINING_MB,
        measured=any(row.outcome not in ("unfinished", "failed") for row in rows),
        published_costs=published,
    )


def _seconds_by_task(rows: Sequence[DesignRow]) -> dict[str, float]:
    """Return the mean duration of a training by task, and over all tasks under the key "" [s]."""
    found: dict[str, list[float]] = {}
    for row in rows:
        if row.evaluations:
            each_s = row.training_s / len(row.evaluations)
            found.setdefault(row.task, []).append(each_s)
            found.setdefault("", []).append(each_s)
    return {task: fmean(seconds) for task, seconds in found.items()}


def _seconds(own: Sequence[DesignRow], config: RunConfig) -> float:
    """Return the CPU time of a design, without the time spent waiting for a language model [s]."""
    if own and is_offline(config.model):
        return median(row.latency_s for row in own)
    return _BUILTIN_S + config.search_robots * _SEARCHED_ROBOT_S * (config.model == SEARCH.prefix)


def _dollars(own: Sequence[DesignRow], model: str) -> float:
    if is_offline(model):
        return 0.0
    costs = _known_costs(own)
    return median(costs) if costs else PAPER.cost_usd


def _tokens(own: Sequence[DesignRow], model: str) -> float:
    if is_offline(model):
        return 0.0
    return median([row.usage.input_tokens + row.usage.output_tokens for row in own] or [PAPER.tokens])


def _is_published(own: Sequence[DesignRow], model: str) -> bool:
    return not is_offline(model) and not _known_costs(own)


def _known_costs(own: Sequence[DesignRow]) -> list[float]:
    return [row.usage.cost_usd for row in own if row.usage.cost_usd is not None]
