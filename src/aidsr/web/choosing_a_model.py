"""Who designs: the built-in rules, a language model, or a person who carries prompts to a model of their own."""

from __future__ import annotations

import secrets
from functools import partial
from typing import Any

from nicegui import ui

from aidsr.errors import UserError
from aidsr.models import key_variables
from aidsr.models.addresses import PROVIDERS
from aidsr.models.manual import MANUAL
from aidsr.pipeline.starting import BUILTIN
from aidsr.web.parts import box, choice, text
from aidsr.web.site import Site

__all__ = ["choose_model", "model_name", "usual_cost"]

_KINDS = {
    "builtin": ("Built-in rules", "Fixed rules written by people. No key, nothing paid, half a minute."),
    "language": (
        "A language model",
        "Of a provider or of a server of your own. Only the one named here is ever paid for.",
    ),
}


def model_name(site: Site, form: dict[str, Any]) -> str:
    """Return the name that a run is given.

    Raises:
        UserError: A language model is wanted and none is named.
    """
    if form["kind"] == "builtin":
        return BUILTIN
    if form["kind"] == "manual":
        return f"{MANUAL}{site.own / 'prompts' / secrets.token_hex(4)}"
    name = str(form["model"] or "").strip()
    if not name:
        raise UserError(f'the name of a language model was expected, for example "openai:{PROVIDERS["openai"]}"')
    return name


def choose_model(site: Site, form: dict[str, Any]) -> None:
    """Show the choice, which keys are set (never the keys), and what such runs cost before."""

    @ui.refreshable
    def shown() -> None:
        def take(kind: str) -> None:
            form["kind"] = kind
            shown.refresh()

        with box("models", role="radiogroup", aria_label="who designs"):
            for kind, (title, says) in _KINDS.items():
                with choice(partial(take, kind), chosen=form["kind"] == kind), box("words only"):
                    text(title, tag="h3")
                    text(says, "small soft")
        if form["kind"] == "language":
            _language_model(site, form)

    with box("stack"):
        text("Who designs", tag="h2")
        shown()


def _language_model(site: Site, form: dict[str, Any]) -> None:
    with box("sheet stack"):
        examples = [f"{provider}:{model}" for provider, model in PROVIDERS.items()]
        field = ui.input("Model: PROVIDER:MODEL, or MODEL@URL", autocomplete=examples).props("outlined dense")
        cost = ui.label("").classes("small soft")

        def told() -> None:
            cost.text = usual_cost(site, str(form["model"] or "").strip())

        field.bind_value(form, "model").on_value_change(told)
        with box("scroll"), box("list plain", "table"), box(tag="tbody"):
            for provider, (variable, is_set) in key_variables().items():
                with box(tag="tr"):
                    text(provider, "mono", "td")
                    text(f"for example {provider}:{PROVIDERS[provider]}", "small soft mono hide-narrow", "td")
                    with box(tag="td"):
                        optional = provider == "ollama"
                        said = "key set" if is_set else "no key needed" if optional else "no key"
                        text(said, f"badge {'yes' if is_set or optional else ''}")
                    text(variable, "small soft mono", "td")
        text(
            "Keys are read from the environment in which aidsr web was started, and are never shown or written down.",
            "small soft",
        )
        told()


def usual_cost(site: Site, model: str) -> str:
    """Say what designs by a model cost in earlier runs here; nothing is guessed."""
    views = []
    for run in site.library.runs():
        try:
            view = site.view(run)
        except UserError:
            continue
        if view.status.record.config.model == model:
            views.append(view)
    costs = [one.status.usage for view in views for one in view.designs if one.status.state == "finished"]
    known = [usage.cost_usd for usage in costs if usage.cost_usd is not None]
    if not model or not known:
        return "No design by this model is finished here yet, so what one costs is not known." if model else ""
    per_design = sum(known) / len(known)
    return f"{len(known)} finished designs by this model cost ${per_design:.2f} each on average."
