"""Limits on the use of language models in a whole study.

Each running job reserves a share of the limit, so that parallel jobs together never exceed it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace

from aidsr.core.calls import Usage
from aidsr.core.config import Budget
from aidsr.core.errors import Limit, UserError
from aidsr.loop.budget import check_prices, spent_by
from aidsr.loop.teams import price_of
from aidsr.runs.files import JsonFile, replace_file
from aidsr.studies.jobs import Job
from aidsr.studies.study import Arm, Cell, Study
from aidsr.studies.tables import PAPER
from aidsr.teams.providers import is_offline

_FILE = "budget.json"


def read_budget(study: Study) -> Budget:
    """Return the limit for all runs of a study together; an empty one where none was set."""
    return JsonFile(study.path / _FILE, Budget).read() or Budget()


def set_budget(study: Study, budget: Budget) -> None:
    """Write a limit that replaces an earlier one; it is not part of the frozen plan."""
    replace_file(study.path / _FILE, budget.model_dump_json(indent=2).encode() + b"\n")


def check_budget(study: Study, budget: Budget) -> None:
    """Refuse a limit that could not be enforced.

    Raises:
        UserError: The limit is one for each design, the cost is limited and the price of a model is unknown, or an arm
            has a limit of its own.
    """
    if budget != budget.model_copy(update={"tokens_per_design": None, "cost_per_design_usd": None}):
        raise UserError("the limits of a study are for all its runs together; give tokens or cost_usd, none per design")
    for arm in study.plan.arms:
        if not is_offline(arm.config.model):
            check_prices(budget, arm.config.model, price_of(arm.config.model))
        if budget != Budget() and arm.config.budget != Budget():
            raise UserError(f'the study and the arm "{arm.name}" both have a limit; remove one of the two')


@dataclass
class _Account:
    """Account of one limit, in USD or in tokens."""

    limit: float
    published: float
    """Assumed usage of a design while no run of its arm has been measured."""
    amount: Callable[[Usage, Arm], float]
    """Conversion of the usage of calls to the unit of this limit."""
    used: dict[Cell, float] = field(default_factory=dict)
    """Usage of all calls of a run, including those of the run that it continues."""
    inherited_usage: dict[Cell, float] = field(default_factory=dict)
    """Usage of the run that a run continues, which is included in `used`."""
    aside: dict[Cell, float] = field(default_factory=dict)
    """Share reserved for the running job of a run, in addition to `used`."""
    too_little: dict[str, float] = field(default_factory=dict)
    """Largest share, by arm, that was too small for a single call."""

    @property
    def paid(self) -> float:
        return sum(self.used.values()) - sum(self.inherited_usage.values())

    @property
    def left(self) -> float:
        return self.limit - self.paid - sum(self.aside.values())

    def share(self, cell: Cell, concepts: int, free: int) -> float:
        """Return the share of the limit that a run may use now, 0 if too little is left.

        It is an equal part of what is left for the jobs that can start now, but at least the expected usage of a run
        and twice a share that was too small, and at most what is left.

        Args:
            cell: The run.
            concepts: Number of concepts of the run.
            free: Number of jobs that can be started now.
        """
        too_little = self.too_little.get(cell.arm, 0.0)
        if self.left <= too_little:
            return 0.0
        seen = [
            used - self.inherited_usage.get(other, 0.0) for other, used in self.used.items() if other.arm == cell.arm
        ]
        about = max(seen, default=0.0) or concepts * self.published
        return min(self.left, max(about, self.left / free, 2 * too_little))


class StudyBudget:
    """Accounting of a study's limit.

    A run that calls a language model is started with a share of what is left, which is enforced like the budget of any
    run. The unused part is returned when its job ends; if the share was too small, the run resumes with a new one.
    Therefore the limit is never exceeded, and a small part of it can remain unspent.

    Args:
        study: The study; the usage of its runs so far counts.
        budget: The limit; only its total cost and total tokens are used.
    """

    def __init__(self, study: Study, budget: Budget) -> None:
        self._study = study
        self._accounts: dict[Limit, _Account] = {}
        self.refusing: set[Limit] = set()
        """Limits of which too little was left for a job; the runner clears the set before it starts jobs."""
        if budget.cost_usd is not None:
            self._accounts["cost_usd"] = _Account(budget.cost_usd, PAPER.cost_usd, _dollars)
        if budget.tokens is not None:
            self._accounts["tokens"] = _Account(budget.tokens, PAPER.tokens, _tokens)
        for cell in study.cells if self._accounts else ():
            self._update_usage(cell)

    @property
    def paid_usd(self) -> float:
        """Cost of all runs [USD]; only available if the cost is limited."""
        return self._accounts["cost_usd"].paid

    @property
    def tokens(self) -> int:
        """Input and output tokens of all runs; only available if tokens are limited."""
        return int(self._accounts["tokens"].paid)

    def begin(self, job: Job, free: int) -> Job | None:
        """Reserve a share of the limit and return the job with it, or None while too little is left.

        Args:
            job: Job to start.
            free: Number of jobs that can be started now.
        """
        arm = self._study.arm(job.cell.arm)
        # an arm that continues another arm's designs calls no model, except with a person's feedback
        if job.stage != "design" or is_offline(arm.config.model) or (arm.after and not arm.feedback):
            return job
        shares = {name: each.share(job.cell, arm.config.concepts, free) for name, each in self._accounts.items()}
        if not all(shares.values()):
            self.refusing.update(name for name, share in shares.items() if not share)
            return None
        self._update_usage(job.cell)
        for name, share in shares.items():
            self._accounts[name].aside[job.cell] = share
        most: dict[Limit, float] = {name: self._accounts[name].used[job.cell] + share for name, share in shares.items()}
        tokens = most.get("tokens")
        return replace(job, most_usd=most.get("cost_usd"), most_tokens=None if tokens is None else int(tokens))

    def end(self, job: Job, *, exhausted_limits: Collection[Limit]) -> None:
        """Return the unused part of an ended job's share to the limit.

        Args:
            job: Job that has ended, successfully or not.
            exhausted_limits: Limits of which its share was too small for its next call.
        """
        used_before = {name: each.used.get(job.cell, 0.0) for name, each in self._accounts.items()}
        self._update_usage(job.cell)
        for name, each in self._accounts.items():
            share = each.aside.pop(job.cell, 0.0)
            if name in exhausted_limits and each.used[job.cell] <= used_before[name]:
                each.too_little[job.cell.arm] = max(share, each.too_little.get(job.cell.arm, 0.0))

    def _update_usage(self, cell: Cell) -> None:
        """Read the usage of a run; a run that has not started has the usage of the run that it continues."""
        continued = self._study.continued_cell(cell)
        for each in self._accounts.values():
            each.inherited_usage[cell] = self._used(continued, each) if continued else 0.0
            run = self._study.run(cell)
            each.used[cell] = self._used(cell, each) if run else each.inherited_usage[cell]

    def _used(self, cell: Cell, account: _Account) -> float:
        run, arm = self._study.run(cell), self._study.arm(cell.arm)
        used = sum(spent_by(run, price_of(arm.config.model)).values(), Usage()) if run else Usage()
        return account.amount(used, arm)


def _dollars(usage: Usage, arm: Arm) -> float:
    """Return the cost of calls [USD].

    Raises:
        UserError: The price of the model is unknown.
    """
    if usage.cost_usd is None:
        raise UserError(f'the price of "{arm.config.model}" is unknown; limit tokens instead (--max-tokens)')
    return usage.cost_usd


def _tokens(usage: Usage, _arm: Arm) -> float:
    return usage.input_tokens + usage.output_tokens
