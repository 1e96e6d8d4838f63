"""Choice of the team that plays the four roles of a run: rules, a baseline, or a language model.

Calls of a language model are recorded, capped in length and kept within a budget.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from aidsr.core.calls import CallRecord, Question
from aidsr.core.config import Budget, RunConfig
from aidsr.core.errors import UserError
from aidsr.core.extras import require_extra
from aidsr.core.model import Model, calls_tools
from aidsr.core.roles import Team
from aidsr.loop.budget import Budgeted, Ledger, Price, check_prices
from aidsr.loop.parts import TeamFor
from aidsr.loop.scene_pictures import motion_view, pictures_of
from aidsr.runs import RecordedModel, Run
from aidsr.runs.origin import require_ours
from aidsr.teams.providers import ManualModel, connect, destination, is_offline, price_usd, provider_of
from aidsr.teams.providers.replay import ReplayedModel


def check_model(config: RunConfig, budget: Budget, model: Model | None = None) -> None:
    """Refuse a model that cannot be used, before a run is created or resumed.

    Args:
        config: Settings of the run.
        budget: Budget of the run.
        model: Model object that designs, if `config.model` is only its name.

    Raises:
        UserError: The model's name is unknown or its key is not set, its directory is locked, or its price is unknown
            and cost is limited.
    """
    provider = provider_of(config.model) if model is None else None
    if provider and provider.extra:
        require_extra(provider.extra, f'model "{provider.prefix}"')
    if provider and provider.is_offline:
        if config.judge_pictures:
            raise UserError("the built-in rules cannot use pictures; name a language model")
        if config.method == "direct":
            raise UserError("the built-in rules cannot be prompted directly; name a language model")
        if config.team == "measuring":
            raise UserError("the built-in rules cannot call tools; name a language model for the measuring team")
        return
    if config.team == "measuring" and config.method != "full":
        raise UserError(f'the ablation "{config.method}" applies to the four roles; leave out the measuring team')
    client = model or connect(config.model)
    if isinstance(client, ManualModel):
        client.check_available()
    check_prices(budget, config.model, _unknown_price if model else price_of(config.model))


def check_effects(config: RunConfig, model: Model | None = None) -> None:
    """Refuse settings that would have no effect, when a person requests a run.

    Evolutions and studies set some settings for all of their runs, whatever model designs, and are not checked.

    Args:
        config: Settings of the run.
        model: Model object that designs, if `config.model` is only its name.

    Raises:
        UserError: A setting would have no effect.
    """
    changed = {name for name, field in RunConfig.model_fields.items() if getattr(config, name) != field.default}
    for name in ("tool_calls", "tool_minutes", "text_tools"):
        if name in changed and config.team != "measuring":
            raise UserError(f"{name} is for the measuring team; choose that team, or leave {name} out")
    if "task_rounds" in changed and not config.task_feedback:
        raise UserError("task_rounds requires task_feedback; switch task_feedback on, or leave task_rounds out")
    if config.memory and model is None and is_offline(config.model):
        raise UserError("the built-in rules do not use a memory; name a language model, or leave the memory out")


def model_name(model: Model) -> str:
    """Return the name of an object that will play the roles.

    Raises:
        UserError: The object has no name or no method `ask`, or its name is that of a built-in team.
    """
    name = getattr(model, "name", None)
    if not (isinstance(name, str) and name and callable(getattr(model, "ask", None))):
        raise UserError(
            f"{type(model).__name__} is not a model: it needs a name (str) and a method ask (see aidsr.Model)"
        )
    if is_offline(name):
        raise UserError(f'the name "{name}" is reserved for the built-in team; give the model another name')
    return name


def require_object(run: Run, model: Model | None) -> None:
    """Refuse to resume a run that was designed by a model object if no object is given.

    Raises:
        UserError: A model object is required and missing.
    """
    record = run.asked()
    if record.model_object and model is None:
        raise UserError(
            f'{run.path} was designed by a Python object named "{record.config.model}"; resume it in Python and pass '
            f"the object: aidsr.resume({str(run.path)!r}, model=…)"
        )


def team_of(run: Run, model: Model | None = None, *, trust: bool = False) -> tuple[TeamFor, Callable[[], None]]:
    """Return a factory of the run's teams, and a function that makes waiting and further calls fail.

    Args:
        run: The run.
        model: Model object that designs, if the run was started with one.
        trust: Whether the caller has just created the run, or its user has confirmed where its prompts are sent.

    Raises:
        ForeignFolderError: The run was not made on this machine, its prompts leave this process, and `trust` is false.
        UserError: The model lacks its key or is an object that is not given, or cost is limited and its price is
            unknown.
    """
    config = run.asked().config
    require_object(run, model)
    provider = provider_of(config.model) if model is None else None
    if provider and provider.team:
        team = provider.team(run, config)
        return lambda _folder: team, lambda: None
    from aidsr.teams import llm
    from aidsr.teams.measuring import ToolBudget, copy_measured, measuring_team

    if model is None:
        require_ours(run.record.path, [destination(config.model)], trust=trust)
    client, price = (model, _unknown_price) if model else (connect(config.model), price_of(config.model))
    check_prices(run.budget(), config.model, price)
    ledger = Ledger(run, run.budget(), config.concepts, price)
    if isinstance(client, ReplayedModel):
        client.leave_out_replies_in(run)
    manual = client if isinstance(client, ManualModel) else None
    mark_recorded: Callable[[CallRecord], None] = manual.mark_recorded if manual else lambda _record: None

    def team_for(folder: Path) -> Team:
        recorded = RecordedModel(Budgeted(client, ledger, folder), folder, mark_recorded)
        capped = _Capped(recorded, config.max_output_tokens)
        if config.team == "measuring":
            if isinstance(client, ReplayedModel):
                copy_measured(client.run, run, folder)
            return measuring_team(
                capped,
                folder,
                level=run.asked().level or "standard",
                goal=run.goal.path if run.goal.path.exists() else None,
                budget=ToolBudget(config.tool_calls, config.tool_minutes),
                pictures=config.judge_pictures,
                text_tools=config.text_tools,
                may_continue=run.larger_budget.exists(),
            )
        if config.method == "direct":
            return llm.direct_team(capped)
        pictures = partial(pictures_of, folder, motion_view(run)) if config.judge_pictures else llm.no_pictures
        return llm.team(capped, pictures=pictures)

    def interrupt() -> None:
        ledger.interrupt()
        if manual:
            manual.interrupt()

    return team_for, interrupt


def price_of(name: str) -> Price:
    """Return the price function of a model for budgets, from tokens to USD: no call costs more."""
    return partial(price_usd, name, highest=True)


def _unknown_price(_input_tokens: int, _output_tokens: int) -> float | None:
    """Return None: the price of a model object is unknown."""
    return None


class _Capped:
    """A model with a limit on output tokens."""

    def __init__(self, model: Model, max_output_tokens: int) -> None:
        self.name = model.name
        self._model = model
        self._max_output_tokens = max_output_tokens

    @property
    def calls_tools(self) -> bool:
        """Whether the model supports tools."""
        return calls_tools(self._model)

    def ask(self, question: Question) -> CallRecord:
        """Ask the model, with the limit in the question."""
        return self._model.ask(question.model_copy(update={"max_output_tokens": self._max_output_tokens}))
