"""No call that could exceed the budget: tokens and money are reserved before a call and settled after it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

from aidsr.calls import CallRecord, Question, Usage
from aidsr.errors import BudgetError, Limit, UserError
from aidsr.models import Model
from aidsr.models.manual import estimated_input_tokens
from aidsr.runs import Run
from aidsr.runs.record import Budget

__all__ = ["Budgeted", "Ledger", "Price", "check_prices", "priced", "spent_by"]

Price = Callable[[int, int], float | None]
"""Returns what so many tokens in and out cost [USD], None when that is not known."""


def check_prices(budget: Budget, model: str, price: Price) -> None:
    """Refuse a limit on money for a model whose price nobody knows.

    Raises:
        UserError: The budget cannot be kept.
    """
    if budget.limits_cost and price(1, 1) is None:
        raise UserError(
            f'the price of "{model}" is not known, so a limit on money cannot be kept; limit tokens instead '
            "(--max-tokens)"
        )


def priced(usage: Usage, price: Price) -> Usage:
    """Return what a call used, at list price where its provider did not say what it cost; that is never less."""
    if usage.cost_usd is not None:
        return usage
    return usage.model_copy(update={"cost_usd": price(usage.input_tokens, usage.output_tokens)})


def spent_by(run: Run, price: Price) -> dict[int, Usage]:
    """Return what every design of a run has used, by its number, 0 for the Designer's calls for all concepts."""
    calls = {0: run.calls}
    for design in run.designs:
        calls[design.number] = tuple(call for iteration in design.iterations for call in iteration.calls)
    return {number: sum((priced(call.usage, price) for call in made), Usage()) for number, made in calls.items()}


class Ledger:
    """What a run and its designs have spent, with what calls in flight may still cost.

    A call is made only if its upper bound fits into what is left: the prompt's tokens, and as many in reply as its cap
    allows. So budgets are kept, and a little of them may stay unspent. The Designer's calls for all concepts count
    for the run, and in even shares for each design.
    """

    def __init__(self, run: Run, budget: Budget, concepts: int, price: Price) -> None:
        self._run = run
        self._budget = budget
        self._concepts = concepts
        self._price = price
        self._lock = threading.Lock()
        self._spent = spent_by(run, price)
        """Calls in flight at their upper bounds."""

    def ask(self, model: Model, folder: Path, question: Question) -> CallRecord:
        """Ask if the budget allows it.

        Raises:
            BudgetError: The call could exceed what is left.
        """
        number = self._number(folder)
        bound = self._bound(question)
        with self._lock:
            self._check(number, bound)
            self._add(number, bound, 1)
        used = Usage()
        try:
            record = model.ask(question)
            used = priced(record.usage, self._price)
        finally:
            with self._lock:
                self._add(number, bound, -1)
                self._add(number, used, 1)
        return record

    def _bound(self, question: Question) -> Usage:
        tokens = estimated_input_tokens(question)
        cost = self._price(tokens, question.max_output_tokens) if self._budget.limits_cost else 0.0
        return Usage(input_tokens=tokens, output_tokens=question.max_output_tokens, cost_usd=cost)

    def _check(self, number: int, bound: Usage) -> None:
        budget = self._budget
        run = sum(self._spent.values(), Usage())
        _refuse_beyond(budget.tokens, budget.cost_usd, run, bound, "run")
        if number:
            shared = self._spent[0]
            own = self._spent.get(number, Usage()) + Usage(
                input_tokens=(shared.input_tokens + shared.output_tokens) // self._concepts,
                cost_usd=(shared.cost_usd or 0.0) / self._concepts,
            )
            _refuse_beyond(budget.tokens_per_design, budget.cost_per_design_usd, own, bound, "design")

    def _add(self, number: int, usage: Usage, sign: int) -> None:
        before = self._spent.get(number, Usage())
        self._spent[number] = Usage(
            input_tokens=max(0, before.input_tokens + sign * usage.input_tokens),
            output_tokens=max(0, before.output_tokens + sign * usage.output_tokens),
            cost_usd=max(0.0, (before.cost_usd or 0.0) + sign * (usage.cost_usd or 0.0)),
        )

    def _number(self, folder: Path) -> int:
        parts = folder.relative_to(self._run.path).parts
        return int(parts[1]) if parts[:1] == ("designs",) else 0


class Budgeted:
    """A model asked only within the budget of a run."""

    def __init__(self, model: Model, ledger: Ledger, folder: Path) -> None:
        self.name = model.name
        self._model = model
        self._ledger = ledger
        self._folder = folder

    def ask(self, question: Question) -> CallRecord:
        """Ask, or raise BudgetError."""
        return self._ledger.ask(self._model, self._folder, question)


def _refuse_beyond(tokens: int | None, cost_usd: float | None, spent: Usage, bound: Usage, what: str) -> None:
    used, more = (each.input_tokens + each.output_tokens for each in (spent, bound))
    refused: dict[Limit, str] = {}
    if tokens is not None and used + more > tokens:
        refused["tokens"] = (
            f"The {what} may use {tokens:,} tokens; {used:,} are used or set aside, and the next call could take "
            f"{more:,}."
        )
    paid, price = spent.cost_usd or 0.0, bound.cost_usd or 0.0
    if cost_usd is not None and paid + price > cost_usd:
        refused["cost_usd"] = (
            f"The {what} may cost ${cost_usd:.2f}; ${paid:.4f} are spent or set aside, and the next call could cost "
            f"${price:.4f}."
        )
    if refused:
        raise BudgetError(" ".join(refused.values()), *refused)
