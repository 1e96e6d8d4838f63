"""What a study will take, before it starts: jobs, hours, money and disk."""

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
"""A design of the built-in team [s]. Source: docs/studies.md, mean over tasks."""
_SEARCHED_ROBOT_S = 5.0
"""Processor time of a robot of a search [s]: written, placed, validated, probed within 90,000 steps.

Source: `aidsr.teams.baselines.search.worth_of` for the rules' concept of seed 0 on the first ten of `aidsr tasks`,
on one core of a Xeon at 2.5 GHz that others used too: 4.7 s on average, 1.0 to 11.4 s; rounded up."""
_STEPS_PER_S: dict[Protocol, float] = {"paper": 300.0, "best": 150.0}
"""Control steps of a single-threaded training. Source: docs/studies.md, 300,000 steps by "paper" in 1,000 s, mean over
tasks; a step of "best" costs about twice as much, docs/learning.md."""
_JUDGING_S = 5 * 43.0
"""The 100 held-out episodes of a policy. Source: 43 s for 20, docs/studies.md, and what 100 take, docs/learning.md."""
_PERTURBED = len(get_args(PerturbationKind))
"""How often the held-out episodes of a successful policy are played again where its plan asks for perturbed scenes."""
_PROBE_S = 20.0
"""Source: docs/learning.md."""
_DESIGN_MB, _TRAINING_MB = 1.0, 3.0
"""Files of a design and of a training. Source: sizes of such folders, films included."""


class StudyEstimate(Artifact):
    """What is still to be done and what it may take. Where the study has finished designs, theirs are the measure."""

    jobs: dict[str, int]
    """Jobs still to be done, by stage; designs that are still to be made are counted as if all were approved, and where
    successful policies are to be played in perturbed scenes, as if all were successful."""
    core_hours: float
    """Waiting for a language model takes no core and is not in it."""
    cost_usd: float
    """With language models; where nothing was measured, the published figure for GPT-5 is taken."""
    tokens: int
    """The same for tokens, in and out."""
    disk_mb: float
    measured: bool
    """Whether designs of this study were the measure."""
    published_costs: bool
    """Whether any of the cost is the published figure."""


def estimate_study(study: Study) -> StudyEstimate:
    """Return what the rest of a study will take."""
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
            # an arm that continues the designs of another arm makes none, unless it has a person's feedback
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
    """Return how long a training took, means by task, and over all under no name."""
    found: dict[str, list[float]] = {}
    for row in rows:
        if row.evaluations:
            each_s = row.training_s / len(row.evaluations)
            found.setdefault(row.task, []).append(each_s)
            found.setdefault("", []).append(each_s)
    return {task: fmean(seconds) for task, seconds in found.items()}


def _seconds(own: Sequence[DesignRow], config: RunConfig) -> float:
    """Return how long a design takes the machine; waiting for a language model takes no core."""
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
