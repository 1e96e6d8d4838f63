"""Options that limit what a language model may use, and what a run will about cost."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter
from cyclopts.validators import Number

if TYPE_CHECKING:
    from aidsr.runs import Budget, RunConfig

__all__ = ["Limits", "StudyLimits", "print_estimate"]


@Parameter(name="*")
@dataclass(frozen=True)
class Limits:
    """What a language model may use; a call that could exceed it is not made."""

    max_cost: Annotated[
        float | None,
        Parameter(validator=Number(gt=0), help="Most the run may cost, in dollars; the model's price must be known."),
    ] = None
    max_tokens: Annotated[
        int | None, Parameter(validator=Number(gte=1), help="Most tokens, in and out, that the run may use.")
    ] = None
    max_cost_per_design: Annotated[
        float | None,
        Parameter(validator=Number(gt=0), help="Most one design may cost, its share of the Designer's call included."),
    ] = None
    max_tokens_per_design: Annotated[
        int | None, Parameter(validator=Number(gte=1), help="Most tokens that one design may use.")
    ] = None

    def budget(self) -> Budget:
        """Return the limits as a run records them."""
        from aidsr.runs import Budget

        return Budget(
            tokens=self.max_tokens,
            cost_usd=self.max_cost,
            tokens_per_design=self.max_tokens_per_design,
            cost_per_design_usd=self.max_cost_per_design,
        )


@Parameter(name="*")
@dataclass(frozen=True)
class StudyLimits:
    """What all runs of a study together may use."""

    max_cost: Annotated[
        float | None,
        Parameter(
            validator=Number(gt=0),
            help="Most the whole study may cost, in dollars, what was paid before included; holds until another is "
            "given. No call that could exceed it is made, and what needs no language model goes on.",
        ),
    ] = None
    max_tokens: Annotated[
        int | None,
        Parameter(validator=Number(gte=1), help="Most tokens, in and out, that the whole study may use."),
    ] = None

    def changed(self, kept: Budget) -> Budget:
        """Return the limits as a study records them: what is not given stays as it is kept."""
        given = {"tokens": self.max_tokens, "cost_usd": self.max_cost}
        return kept.model_copy(update={name: limit for name, limit in given.items() if limit is not None})


def print_estimate(config: RunConfig, runs: Path) -> None:
    """Say what the run will about cost."""
    from rich.console import Console

    from aidsr.loop.estimate import estimate
    from aidsr.runs.summary import cost_in_words

    found = estimate(config, runs)
    used = found.usage
    Console(highlight=False).print(
        f"Estimate: about {used.calls} calls, {used.input_tokens:,} tokens in, {used.output_tokens:,} out, cost "
        f"{cost_in_words(used)} ({found.basis}; the real figures may differ several times over).",
        soft_wrap=True,
        markup=False,
    )
