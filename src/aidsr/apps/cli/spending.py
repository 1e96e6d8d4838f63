"""Options that limit the use of language models, and the estimated cost of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

from aidsr.apps.cli.options import Options, options_for
from aidsr.core.config import BUILTIN, Budget, RunConfig


def limit_name(field: str) -> str:
    """Return the name of the option for a field of `Budget`: --max-cost-per-design for "cost_per_design_usd"."""
    return f"--max-{field.removesuffix('_usd').replace('_', '-')}"


if TYPE_CHECKING:
    Limits = Options[Budget]
else:
    Limits = options_for(Budget, name=limit_name)


def merged_limits(kept: Budget, given: Mapping[str, float | int | None]) -> Budget:
    """Return limits with those given replaced; a limit given as None is kept."""
    return kept.model_copy(update={name: limit for name, limit in given.items() if limit is not None})


@Parameter(name="*")
@dataclass(frozen=True)
class StudyLimits:
    """Limits for all runs of a study together."""

    max_cost: Annotated[
        float | None,
        Parameter(
            validator=Number(gt=0),
            help="Maximum cost of the whole study in dollars, including what is already spent; it applies until "
            "another limit is given. Calls that could exceed it are not made; work without a language model continues.",
        ),
    ] = None
    max_tokens: Annotated[
        int | None,
        Parameter(validator=Number(gte=1), help="Maximum tokens of the whole study, input and output together."),
    ] = None

    def changed(self, kept: Budget) -> Budget:
        """Return the recorded limits of a study, with the given ones replaced."""
        return merged_limits(kept, {"tokens": self.max_tokens, "cost_usd": self.max_cost})


def print_estimate(config: RunConfig, runs: Path) -> None:
    """Print the estimated cost of a run."""
    from aidsr.apps.cli.terminal import make_console
    from aidsr.core.formatting import format_cost
    from aidsr.loop.estimate import estimate
    from aidsr.teams.providers import is_offline

    console = make_console()
    if is_offline(config.model):
        who = "the built-in rules call" if config.model == BUILTIN else f"{config.model} calls"
        console.print(f"No cost: {who} no language model.", soft_wrap=True, markup=False)
        return
    found = estimate(config, runs)
    used = found.usage
    console.print(
        f"Estimate: about {used.calls} calls, {used.input_tokens:,} tokens in, {used.output_tokens:,} out, cost "
        f"{format_cost(used)} ({found.basis}; actual values may differ by a factor of several).",
        soft_wrap=True,
        markup=False,
    )
