"""Budget of a run: tokens and cost are reserved before a call and settled after it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

from aidsr.core.calls import CallRecord, Question, Usage
from aidsr.core.config import Budget
from aidsr.core.errors import AidsrError, BudgetError, Limit, ModelError, UserError
from aidsr.core.model import Model, calls_tools
from aidsr.runs import Run
from aidsr.teams.providers.tokens import estimate_input_tokens

Price = Callable[[int, int], float | None]
"""Returns the highest cost of the given numbers of input and output tokens [USD], None if it is unknown."""


def check_prices(budget: Budget, model: str, price: Price) -> None:
    """Refuse a cost limit for a model without a known price.

    Raises:
        UserError: The budget cannot be enforced.
    """
    if budget.limits_cost and price(1, 1) is None:
        raise UserError(f'the price of "{model}" is unknown, so a cost limit cannot be enforced; limit tokens instead')


def priced(usage: Usage, price: Price) -> Usage:
    """Return the usage of a call, with the highest list price if the provider gave no cost."""
    if usage.cost_usd is not None:
        return usage
    return usage.model_copy(update={"cost_usd": price(usage.input_tokens, usage.output_tokens)})


def spent_by(run: Run, price: Price) -> dict[int, Usage]:
    """Return the usage of every design of a run by its number; 0 stands for the Designer's calls for all concepts."""
    calls = {0: run.calls}
    for design in run.designs:
        calls[design.number] = tuple(call for iteration in design.iterations for call in iteration.calls)
    return {number: sum((priced(call.usage, price) for call in made), Usage()) for number, made in calls.items()}


class Ledger:
    """What a run and its designs have spent, and what calls in flight may still cost.

    A call is made only if its upper bound fits into the remaining budget. The bound is the prompt's tokens plus the
    reply's maximum. If it would fit but for calls in flight, the call waits until they end, because most cost far less
    than their bounds. So budgets are not exceeded, and a small part of them may remain unspent. The exception is a call
    that is retried: one attempt is reserved, and each failed attempt that is billed counts as well.

    The Designer's calls for all concepts count towards the run, and in equal shares towards each design.
    """

    def __init__(self, run: Run, budget: Budget, concepts: int, price: Price) -> None:
        self._run = run
        self._budget = budget
        self._concepts = concepts
        self._price = price
        self._spent = spent_by(run, price)
        self._in_flight: list[tuple[int, Usage]] = []
        """Numbers of the designs with a call in flight, and the upper bound of each call."""
        self._interrupted = False
        self._changed = threading.Condition()
        """Guards all fields; notified when a call in flight has ended, or when all waiting calls have to stop."""

    def ask(self, model: Model, folder: Path, question: Question) -> CallRecord:
        """Ask the model as soon as the budget is known to allow it.

        Raises:
            BudgetError: The call could exceed the remaining budget.
            ModelError: The run was asked to stop before the call was made.
        """
        number = self._number(folder)
        with self._changed:
            self._refuse_if_interrupted()
            bound = self._bound(question)
            self._wait_for_room(number, bound)
            self._in_flight.append((number, bound))
        used = Usage()
        try:
            record = model.ask(question)
            used = priced(record.usage, self._price)
        except AidsrError as error:
            if error.failed_call:
                used = priced(error.failed_call.usage, self._price)
            raise
        finally:
            with self._changed:
                self._in_flight.remove((number, bound))
                self._spent[number] = self._spent.get(number, Usage()) + used
                self._changed.notify_all()
        return record

    def interrupt(self) -> None:
        """Make every call fail that was not made yet, now and from now on."""
        with self._changed:
            self._interrupted = True
            self._changed.notify_all()

    def _bound(self, question: Question) -> Usage:
        tokens = estimate_input_tokens(question)
        cost = self._price(tokens, question.max_output_tokens) if self._budget.limits_cost else 0.0
        return Usage(input_tokens=tokens, output_tokens=question.max_output_tokens, cost_usd=cost)

    def _wait_for_room(self, number: int, bound: Usage) -> None:
        """Return when the call fits beside those in flight; without any in flight, it fits or is refused."""
        while self._refusal(self._spent_at_most(), number, bound):
            if refusal := self._refusal(self._spent, number, bound):
                raise refusal
            self._refuse_if_interrupted()
            self._changed.wait()

    def _refuse_if_interrupted(self) -> None:
        if self._interrupted:
            raise ModelError("interrupted before the call was made")

    def _spent_at_most(self) -> dict[int, Usage]:
        """Return the usage if each call in flight costs as much as its upper bound."""
        spent = dict(self._spent)
        for number, bound in self._in_flight:
            spent[number] = spent.get(number, Usage()) + bound
        return spent

    def _refusal(self, spent: dict[int, Usage], number: int, bound: Usage) -> BudgetError | None:
        """Return the reason why the call may not be made with the given usage; None if it may."""
        budget = self._budget
        refused = _beyond(budget.tokens, budget.cost_usd, sum(spent.values(), Usage()), bound, "run")
        if number and not refused:
            shared = spent[0]
            own = spent.get(number, Usage()) + Usage(
                input_tokens=(shared.input_tokens + shared.output_tokens) // self._concepts,
                cost_usd=(shared.cost_usd or 0.0) / self._concepts,
            )
            refused = _beyond(budget.tokens_per_design, budget.cost_per_design_usd, own, bound, "design")
        return BudgetError(" ".join(refused.values()), *refused) if refused else None

    def _number(self, folder: Path) -> int:
        parts = folder.relative_to(self._run.path).parts
        return int(parts[1]) if parts[:1] == ("designs",) else 0


class Budgeted:
    """A model that is asked only within the budget of a run."""

    def __init__(self, model: Model, ledger: Ledger, folder: Path) -> None:
        self.name = model.name
        self._model = model
        self._ledger = ledger
        self._folder = folder

    @property
    def calls_tools(self) -> bool:
        """Whether the model supports tools."""
        return calls_tools(self._model)

    def ask(self, question: Question) -> CallRecord:
        """Ask the model, or raise BudgetError."""
        return self._ledger.ask(self._model, self._folder, question)


def _beyond(tokens: int | None, cost_usd: float | None, spent: Usage, bound: Usage, what: str) -> dict[Limit, str]:
    """Return the limits that the next call could exceed, each with a sentence that says so."""
    used, more = (each.input_tokens + each.output_tokens for each in (spent, bound))
    refused: dict[Limit, str] = {}
    if tokens is not None and used + more > tokens:
        refused["tokens"] = (
            f"The {what} may use {tokens:,} tokens; {used:,} are used, and the next call could use {more:,}."
        )
    paid, price = spent.cost_usd or 0.0, bound.cost_usd or 0.0
    if cost_usd is not None and paid + price > cost_usd:
        refused["cost_usd"] = (
            f"The {what} may cost ${cost_usd:.2f}; ${paid:.4f} is spent, and the next call could cost ${price:.4f}."
        )
    return refused
