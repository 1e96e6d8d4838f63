"""The estimated cost of a run: from earlier runs of the same model, else a rule of thumb."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from aidsr.core.calls import Usage
from aidsr.core.config import RunConfig
from aidsr.core.errors import UserError
from aidsr.loop.teams import price_of
from aidsr.runs import Run, read_status
from aidsr.teams.providers import is_offline

_TYPICAL = Usage(calls=6, input_tokens=36_000, output_tokens=18_000)
"""One design: two robots, a placement or two, a verdict, a share of the concepts; 6,000 tokens in and 3,000 out a call.
Our guess, for prompts as docs/models.md has them and short reasoning; models that reason at length take more."""
_MEASURING = Usage(calls=8, input_tokens=73_000, output_tokens=10_000)
"""One design of the measuring team, every prompt counted. Source: the mean of `benchmarks.teams.prompt_size`."""


@dataclass(frozen=True)
class Estimate:
    """The estimated usage of all designs of a run."""

    usage: Usage
    basis: str
    """Where the figures come from, as a clause."""


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
    cost = price_of(config.model)(whole.input_tokens, whole.output_tokens)
    basis = f"a rule of thumb, {typical.calls} calls per design, and list prices"
    return Estimate(whole.model_copy(update={"cost_usd": cost}), basis)


def _earlier(config: RunConfig, runs: Path) -> list[Usage]:
    """Return the usage of finished designs by a model in the same team; runs that cannot be read are skipped."""
    found = []
    for record in sorted(runs.glob("*/run.json")):
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
