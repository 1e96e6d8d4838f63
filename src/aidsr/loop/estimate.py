"""Estimate of the cost of a run: from earlier runs of the same model, else from a rule of thumb."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from aidsr.core.calls import Usage
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.runs import RUN_FILE, Run, read_status
from aidsr.teams.providers import is_offline, price_usd

_TYPICAL = Usage(calls=6, input_tokens=36_000, output_tokens=18_000)
"""Usage of one design: two robots, a placement or two, a verdict, a share of the concepts; 6,000 input and 3,000 output
tokens for each call. A guess, for prompts as in docs/models.md and short reasoning; models with long reasoning use
more."""
_MEASURING = Usage(calls=8, input_tokens=73_000, output_tokens=10_000)
"""Usage of one design of the measuring team, including every prompt. Source: the mean of
`benchmarks.teams.prompt_size`."""


@dataclass(frozen=True)
class Estimate:
    """The estimated usage of all designs of a run."""

    usage: Usage
    basis: str
    """Source of the figures, as a clause."""


def estimate(config: RunConfig, runs: Path) -> Estimate:
    """Return the estimated cost of a run; the number of repairs is not known in advance.

    Args:
        config: Settings of the run.
        runs: Folder of earlier runs.
    """
    if is_offline(config.model):
        return Estimate(Usage(), "the rules call no language model")
    earlier = _earlier(config, runs)
    if earlier:
        total = sum(earlier, Usage())
        mean = _times(total, config.concepts / len(earlier))
        return Estimate(mean, f"the mean of {len(earlier)} earlier designs of this model in {runs}")
    typical = _MEASURING if config.team == "measuring" else _TYPICAL
    whole = _times(typical, config.concepts)
    cost = price_usd(config.model, whole.input_tokens, whole.output_tokens)
    basis = f"a rule of thumb, {typical.calls} calls per design, and list prices"
    return Estimate(whole.model_copy(update={"cost_usd": cost}), basis)


def _earlier(config: RunConfig, runs: Path) -> list[Usage]:
    """Return the usage of each finished design by the same model in the same team; unreadable runs are skipped."""
    found = []
    for record in sorted(runs.glob(f"*/{RUN_FILE}")):
        try:
            status = read_status(Run(record.parent))
        except UserError:
            continue
        known = status.record.config
        if (known.model, known.team) == (config.model, config.team):
            found += [design.usage for design in status.designs if design.outcome is not None and design.usage.calls]
    return found


def _times(usage: Usage, factor: float) -> Usage:
    return Usage(
        calls=round(usage.calls * factor),
        input_tokens=round(usage.input_tokens * factor),
        output_tokens=round(usage.output_tokens * factor),
        tokens_estimated=True,
        cost_usd=None if usage.cost_usd is None else usage.cost_usd * factor,
    )
