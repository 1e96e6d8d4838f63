"""Choice of the designer: built-in rules, a language model, or a person who copies prompts to a model of their own."""

from __future__ import annotations

import os
import secrets
from functools import partial
from typing import Any

from nicegui import run as background
from nicegui import ui
from pydantic import ValidationError

from aidsr.apps.web.form_values import limit, limit_field
from aidsr.apps.web.site import Site
from aidsr.apps.web.widgets import box, choice, text
from aidsr.core.config import BUILTIN, Budget, RunConfig
from aidsr.core.errors import UserError
from aidsr.core.formatting import format_cost, format_tokens_in_thousands
from aidsr.loop.estimate import estimate
from aidsr.teams.providers import is_offline, providers
from aidsr.teams.providers.manual import MANUAL
from aidsr.teams.providers.offline import RULES
from aidsr.teams.providers.openai import OPENAI

_STEPS = {"cost_usd": 0.1, "cost_per_design_usd": 0.1}
"""Steps of the number fields for limits in US dollars; those for limits in tokens have steps of 1,000."""

_KINDS = {
    "builtin": (RULES.title, RULES.doc),
    "language": (
        "A language model",
        "From a provider or from your own server. Only the model that you name here can cause costs.",
    ),
    "manual": (MANUAL.title, MANUAL.doc),
}


def model_name(site: Site, form: dict[str, Any]) -> str:
    """Return the name of the model that the form selects.

    Raises:
        UserError: A language model is selected but not named.
    """
    if form["kind"] == "builtin":
        return BUILTIN
    if form["kind"] == "manual":
        return MANUAL.name_of(str(site.own / "prompts" / secrets.token_hex(4)))
    name = str(form["model"] or "").strip()
    if not name:
        raise UserError(f'the name of the language model is missing; enter one, for example "{OPENAI.example_name}"')
    return name


def choose_model(site: Site, form: dict[str, Any]) -> None:
    """Show the choice of the designer, which API keys are set (never the keys), and the estimated cost of the run."""

    @ui.refreshable
    def shown() -> None:
        def take(kind: str) -> None:
            form["kind"] = kind
            shown.refresh()

        with box("models", role="radiogroup", aria_label="designer"):
            for kind, (title, says) in _KINDS.items():
                with choice(partial(take, kind), chosen=form["kind"] == kind), box("words only"):
                    text(title, tag="h3")
                    text(says, "small soft")
        if form["kind"] == "language":
            _language_model(site, form)

    with box("stack"):
        text("Designer", tag="h2")
        shown()


def _language_model(site: Site, form: dict[str, Any]) -> None:
    with box("sheet stack"):
        offered = [provider for provider in providers() if provider.connect and not provider.takes_path]
        examples = [provider.example_name for provider in offered]
        field = ui.input("Model (PROVIDER:MODEL or MODEL@URL)", autocomplete=examples).props("outlined dense")
        cost = ui.label("").classes("small soft")

        async def show_cost() -> None:
            name, concepts = str(form["model"] or "").strip(), int(form["concepts"] or 1)
            cost.text = await background.io_bound(estimated_cost, site, name, concepts) or ""

        field.props["debounce"] = 400
        field.bind_value(form, "model").on_value_change(show_cost)
        limit_fields(form)
        with (
            box("scroll", tabindex="0", role="region", aria_label="providers and their keys"),
            box("list plain", "table"),
            box(tag="tbody"),
        ):
            for provider in offered:
                with box(tag="tr"):
                    text(provider.form, "mono", "td")
                    text(f"for example {provider.example_name}", "small soft mono hide-narrow", "td")
                    with box(tag="td"):
                        is_set = any(os.environ.get(variable, "").strip() for variable in provider.key_variables)
                        status = "key set" if is_set else "no key" if provider.needs_key else "no key needed"
                        text(status, f"badge {'' if status == 'no key' else 'yes'}")
                    text(" or ".join(provider.key_variables), "small soft mono", "td")
        text(
            "API keys are read from the environment variables of the aidsr web process. They are never shown or saved.",
            "small soft",
        )
        ui.timer(0.05, show_cost, once=True)


def limit_fields(form: dict[str, Any]) -> None:
    """Show a number field for each limit of a budget; an empty field means no limit."""
    with box("form"):
        for name, each in Budget.model_fields.items():
            step = _STEPS.get(name, 1000)
            limit_field(each.title or name, step=step, whole=name not in _STEPS).bind_value(form, name)


def budget_from(form: dict[str, Any]) -> Budget:
    """Return the limits in a form; an empty field means no limit.

    Raises:
        UserError: A limit is not above zero, or a limit in tokens is a fraction.
    """
    return Budget.model_validate(
        {
            name: limit(each.title or name, form.get(name), whole=name not in _STEPS)
            for name, each in Budget.model_fields.items()
        }
    )


def estimated_cost(site: Site, model: str, concepts: int) -> str:
    """Return the estimated cost of a run and its basis, in words; empty while the name of the model is not valid."""
    if is_offline(model):
        return "No language model: no calls, no cost."
    try:
        found = estimate(RunConfig(model=model, concepts=concepts), site.library.path)
    except (UserError, ValidationError):
        return ""
    used = found.usage
    tokens = format_tokens_in_thousands(used)
    return (
        f"About {used.calls} calls, {tokens} tokens, cost {format_cost(used)}: {found.basis}. "
        "Actual figures may differ by a factor of several."
    )
