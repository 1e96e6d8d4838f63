"""What a whole study may use of language models. Jobs side by side set aside what each may spend, so none goes over."""

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
    """Return what a study may use, all its runs together; without a limit unless one was given."""
    return JsonFile(study.path / _FILE, Budget).read() or Budget()


def set_budget(study: Study, budget: Budget) -> None:
    """Let a limit hold from now on, instead of an earlier one; it is no part of the frozen plan."""
    replace_file(study.path / _FILE, budget.model_dump_json(indent=2).encode() + b"\n")


def check_budget(study: Study, budget: Budget) -> None:
    """Refuse a limit that could not be kept.

    Raises:
        UserError: Money is limited and the price of a model is not known, or an arm's runs have limits of their own.
    """
    for arm in study.plan.arms:
        if not is_offline(arm.config.model):
            check_prices(budget, arm.config.model, price_of(arm.config.model))
        if budget != Budget() and arm.config.budget != Budget():
            raise UserError(f'the study and the arm "{arm.name}" both have a limit; remove one of the two')


@dataclass
class _Account:
    """One limit, in dollars or in tokens."""

    limit: float
    published: float
    """What a design takes, before a run of its arm was measured."""
    amount: Callable[[Usage, Arm], float]
    used: dict[Cell, float] = field(default_factory=dict)
    """By all calls of a run, those of the run that it continues included."""
    before: dict[Cell, float] = field(default_factory=dict)
    """The part of that which the run that it continues has paid."""
    aside: dict[Cell, float] = field(default_factory=dict)
    """What running jobs may use in addition."""
    too_little: dict[str, float] = field(default_factory=dict)
    """With what an arm could not make a call."""

    @property
    def paid(self) -> float:
        return sum(self.used.values()) - sum(self.before.values())

    @property
    def left(self) -> float:
        return self.limit - self.paid - sum(self.aside.values())

    def share(self, cell: Cell, concepts: int, free: int) -> float:
        """Return what a run may use now: an even part of what is left, but as much as a run takes; 0 for too little."""
        too_little = self.too_little.get(cell.arm, 0.0)
        if self.left <= too_little:
            return 0.0
        seen = [used - self.before.get(other, 0.0) for other, used in self.used.items() if other.arm == cell.arm]
        about = max(seen, default=0.0) or concepts * self.published
        return min(self.left, max(about, self.left / free, 2 * too_little))


class StudyBudget:
    """What is left of a study's limit.

    A run that asks a language model is started with a share of what is left, and its calls keep to that as those of any
    run keep to its budget. What it did not use goes back when its job ends; where its share was too small, it resumes
    with a new one. So the limit is never passed, and a little of it may stay unspent.

    Args:
        study: Its runs so far count.
        budget: The limit; only dollars and tokens of the whole are looked at.
    """

    def __init__(self, study: Study, budget: Budget) -> None:
        self._study = study
        self._accounts: dict[Limit, _Account] = {}
        self.refusing: set[Limit] = set()
        """Limits of which too little was left for a job; the runner clears it before it starts jobs."""
        if budget.cost_usd is not None:
            self._accounts["cost_usd"] = _Account(budget.cost_usd, PAPER.cost_usd, _dollars)
        if budget.tokens is not None:
            self._accounts["tokens"] = _Account(budget.tokens, PAPER.tokens, _tokens)
        for cell in study.cells if self._accounts else ():
            self._update_usage(cell)

    @property
    def paid_usd(self) -> float:
        """What all runs have cost [USD]; only kept where money is limited."""
        return self._accounts["cost_usd"].paid

    @property
    def tokens(self) -> int:
        """What all runs have used, in and out; only kept where tokens are limited."""
        return int(self._accounts["tokens"].paid)

    def begin(self, job: Job, free: int) -> Job | None:
        """Return a job with what it may use, None while too little is left for it.

        Args:
            job: To be started.
            free: How many jobs could be started now.
        """
        arm = self._study.arm(job.cell.arm)
        # an arm that continues another arm's designs calls no model, unless it has a person's feedback
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

    def end(self, job: Job, *, short: Collection[Limit]) -> None:
        """Take back what a job did not use.

        Args:
            job: It ended, in whatever way.
            short: Of which limits its share was too small for its next call.
        """
        before = {name: each.used.get(job.cell, 0.0) for name, each in self._accounts.items()}
        self._update_usage(job.cell)
        for name, each in self._accounts.items():
            share = each.aside.pop(job.cell, 0.0)
            if name in short and each.used[job.cell] <= before[name]:
                each.too_little[job.cell.arm] = max(share, each.too_little.get(job.cell.arm, 0.0))

    def _update_usage(self, cell: Cell) -> None:
        """Read what a run has used; one that has not started takes over what the run before it has."""
        earlier = self._study.before(cell)
        for each in self._accounts.values():
            each.before[cell] = self._used(earlier, each) if earlier else 0.0
            run = self._study.run(cell)
            each.used[cell] = self._used(cell, each) if run else each.before[cell]

    def _used(self, cell: Cell, account: _Account) -> float:
        run, arm = self._study.run(cell), self._study.arm(cell.arm)
        used = sum(spent_by(run, price_of(arm.config.model)).values(), Usage()) if run else Usage()
        return account.amount(used, arm)


def _dollars(usage: Usage, arm: Arm) -> float:
    """Return what calls cost [USD]."""
    if usage.cost_usd is None:
        raise UserError(f'the price of "{arm.config.model}" is unknown; limit tokens instead (--max-tokens)')
    return usage.cost_usd


def _tokens(usage: Usage, _arm: Arm) -> float:
    return usage.input_tokens + usage.output_tokens
