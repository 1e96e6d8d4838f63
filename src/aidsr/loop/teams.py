"""Who plays the four roles of a run: rules, or a model that is recorded, capped and kept within a budget."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from aidsr.core.calls import CallRecord, Question
from aidsr.core.errors import UserError
from aidsr.core.extras import require_extra
from aidsr.core.model import Model
from aidsr.core.roles import Team
from aidsr.loop.budget import Budgeted, Ledger, Price, check_prices
from aidsr.loop.judge_images import pictures_of
from aidsr.loop.parts import TeamFor
from aidsr.runs import RecordedModel, Run, RunConfig
from aidsr.runs.record import Budget
from aidsr.runs.replay import REPLAY, ReplayedModel
from aidsr.teams.providers import ManualModel, connect
from aidsr.teams.providers.manual import MANUAL
from aidsr.teams.providers.prices import list_price_usd

__all__ = ["BUILTIN", "REFERENCE", "SEARCH", "asks_nobody", "check_model", "from_anywhere", "price_of", "team_of"]

BUILTIN = "builtin"
"""Model name of the rules. They are no language model, need no key and cost nothing."""
REFERENCE = "reference"
"""Model name of the robots designed by hand, see `aidsr.teams.baselines`."""
SEARCH = "search"
"""Model name of a search over the numbers of the rules' robots, see `aidsr.teams.baselines`."""


def check_model(config: RunConfig, budget: Budget) -> None:
    """Refuse what could not be asked, before a run is made or goes on.

    Raises:
        UserError: The model's name is not understood or lacks its key, its directory is in use, or its price is not
            known and money is limited.
    """
    if asks_nobody(config.model):
        if config.model == SEARCH:
            require_extra("search", "the search")
        if config.judge_pictures:
            raise UserError("pictures are for a language model's Judge; name one with --model, the rules see none")
        if config.method == "direct":
            raise UserError(
                "direct prompting asks a language model; name one with --model, the rules cannot be prompted"
            )
    else:
        model = _connected(config.model)
        if isinstance(model, ManualModel):
            model.check_free()
        check_prices(budget, config.model, price_of(config.model))


def team_of(run: Run, config: RunConfig) -> tuple[TeamFor, Callable[[], None]]:
    """Return what makes the teams of a run, and what lets calls that wait for a person or for each other give up.

    Raises:
        UserError: The model lacks its key, or money is limited and its price is not known, or no longer.
    """
    if asks_nobody(config.model):
        team = _team_without_a_model(run, config)
        return lambda _folder: team, lambda: None
    from aidsr.teams import llm as agents

    model, price = _connected(config.model), price_of(config.model)
    check_prices(run.budget(), config.model, price)
    ledger = Ledger(run, run.budget(), config.concepts, price)
    by_hand = model if isinstance(model, ManualModel) else None
    kept: Callable[[CallRecord], None] = by_hand.kept if by_hand else lambda _record: None

    def team_for(folder: Path) -> Team:
        capped = _Capped(RecordedModel(Budgeted(model, ledger, folder), folder, kept), config.max_output_tokens)
        if config.method == "direct":
            return agents.direct_team(capped)
        return agents.team(capped, see=partial(pictures_of, folder) if config.judge_pictures else agents.blind)

    def interrupt() -> None:
        ledger.interrupt()
        if by_hand:
            by_hand.interrupt()

    return team_for, interrupt


def from_anywhere(model: str) -> str:
    """Return the name of a model as it holds in every directory: a folder in it, of replies or of a run, absolute."""
    for kind in (MANUAL, REPLAY):
        folder = model.removeprefix(kind)
        if model.startswith(kind) and folder.strip():
            return f"{kind}{Path(folder).absolute()}"
    return model


def asks_nobody(model: str) -> bool:
    """Whether a name stands for rules, robots designed by hand or a search: no language model, no key, no cost."""
    return model in (BUILTIN, REFERENCE, SEARCH)


def _team_without_a_model(run: Run, config: RunConfig) -> Team:
    if config.model == BUILTIN:
        from aidsr.teams import rules as builtin

        return builtin.team(config.seed)
    if config.model == REFERENCE:
        from aidsr.teams.baselines import reference

        return reference.team()
    return _searching_team(run, config)


def _searching_team(run: Run, config: RunConfig) -> Team:
    """Return the team that searches; what it measured before it was interrupted is in the run's folder."""
    from aidsr.teams.baselines.generations import Generation, read_search, write_search
    from aidsr.teams.baselines.search import team

    known = list(read_search(run))

    def note(generation: Generation) -> None:
        known.append(generation)
        write_search(run, known)

    level = run.asked().level or "standard"
    return team(config.seed, level, config.search_robots, known=tuple(known), listen=note)


def _connected(name: str) -> Model:
    return ReplayedModel(Path(name.removeprefix(REPLAY))) if name.startswith(REPLAY) else connect(name)


def price_of(name: str) -> Price:
    """Return what tells the price of a call to a model; a replayed one is free, a person's is not known."""
    if name.startswith(REPLAY):
        return lambda _input_tokens, _output_tokens: 0.0
    return partial(list_price_usd, name) if not name.startswith(MANUAL) else lambda _in, _out: None


class _Capped:
    """A model asked for at most so many tokens of output."""

    def __init__(self, model: Model, max_output_tokens: int) -> None:
        self.name = model.name
        self._model = model
        self._max_output_tokens = max_output_tokens

    def ask(self, question: Question) -> CallRecord:
        """Ask with the cap in the question."""
        return self._model.ask(question.model_copy(update={"max_output_tokens": self._max_output_tokens}))
