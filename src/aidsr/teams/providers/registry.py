"""Lookup of the provider of a model name, among the built-in providers and those of installed packages."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from pydantic import SecretStr

from aidsr.core.errors import UserError
from aidsr.core.model import Model
from aidsr.core.plugins import PluginGroup
from aidsr.core.suggestions import closest_name
from aidsr.teams.providers.anthropic import ANTHROPIC
from aidsr.teams.providers.google import GOOGLE
from aidsr.teams.providers.manual import MANUAL
from aidsr.teams.providers.offline import REFERENCE, RULES, SEARCH
from aidsr.teams.providers.ollama import OLLAMA
from aidsr.teams.providers.openai import OPENAI, OPENAI_CHAT
from aidsr.teams.providers.openai_compatible import OPENAI_COMPATIBLE
from aidsr.teams.providers.openrouter import OPENROUTER
from aidsr.teams.providers.prices import list_price_usd
from aidsr.teams.providers.provider import Endpoint, Provider
from aidsr.teams.providers.replay import REPLAY
from aidsr.teams.providers.retry import Clock, RetryPolicy

BUILT_IN = (
    RULES,
    OPENAI,
    OPENAI_CHAT,
    ANTHROPIC,
    GOOGLE,
    OPENROUTER,
    OLLAMA,
    OPENAI_COMPATIBLE,
    MANUAL,
    REPLAY,
    REFERENCE,
    SEARCH,
)
"""Built-in providers, in the order of docs/models.md and of the web app."""

PLUGINS = PluginGroup[Provider](
    group="aidsr.models",
    noun="provider",
    kind=Provider,
    name_attribute="prefix",
    builtin=lambda: {provider.prefix for provider in BUILT_IN},
)
"""Providers of other packages; the entry point's name is the provider's prefix."""


def providers() -> tuple[Provider, ...]:
    """Return the built-in providers, then those of installed packages.

    Raises:
        UserError: A package's provider cannot be loaded, or its prefix is taken.
    """
    return (*BUILT_IN, *(plugin.value for plugin in PLUGINS.load_all()))


def provider_of(name: str) -> Provider | None:
    """Return the provider of a model name; None if there is none.

    Raises:
        UserError: The package that adds the provider cannot be loaded.
    """
    if "@http" in name:
        return OPENAI_COMPATIBLE
    prefix = name.partition(":")[0]
    known = next((provider for provider in BUILT_IN if provider.prefix == prefix != ""), None)
    if known:
        return known
    return PLUGINS.load_named(prefix)


def parse_model_name(name: str) -> tuple[Provider, str]:
    """Return the provider of a model name, and the argument in the name as it is recorded.

    Raises:
        UserError: The provider is unknown, or its argument is missing or cannot be used.
    """
    provider = provider_of(name)
    if provider is None:
        raise _unknown(name)
    argument = name if provider is OPENAI_COMPATIBLE else name.partition(":")[2]
    if not provider.argument:
        if name != provider.prefix:
            raise UserError(f'"{name}" is not a model name; write "{provider.prefix}"')
        return provider, ""
    if not argument or argument != argument.strip():
        raise UserError(
            f'"{name}" lacks the {provider.argument.lower()}; write it without spaces, for example '
            f'"{provider.example_name}"'
        )
    return provider, provider.normalize(argument)


def connect(
    name: str,
    *,
    environ: Mapping[str, str] | None = None,
    retry: RetryPolicy | None = None,
    clock: Clock | None = None,
) -> Model:
    """Return the language model with this name, without sending anything.

    Args:
        name: "anthropic:MODEL", "MODEL@URL", "manual:DIRECTORY" and so on; docs/models.md lists all.
        environ: Environment variables with keys and base URLs; those of this process by default.
        retry: Retries and time limits; read from environment variables by default.
        clock: Time source for the retries.

    Raises:
        UserError: The name is unknown, it names a team that asks no language model, its key is not set, or a limit in
            the environment is not a number.
    """
    provider, argument = parse_model_name(name)
    if provider.connect is None:
        raise UserError(f'"{name}" asks no language model; use it as aidsr.design(model="{name}")')
    environ = os.environ if environ is None else environ
    key = provider.key(environ)
    if key is None and provider.needs_key:
        raise UserError(f'"{name}" has no key; set the environment variable {" or ".join(provider.key_variables)}')
    return provider.connect(
        Endpoint(
            provider=provider,
            name=provider.name_of(argument),
            argument=argument,
            base_url=provider.url(environ),
            key=key,
            secrets=_secrets(provider, environ),
            retry=retry or RetryPolicy.from_environment(),
            clock=clock or Clock(),
        )
    )


def is_offline(name: str) -> bool:
    """Whether a name stands for a team that asks no language model, so that it needs no key and costs nothing."""
    provider = provider_of(name)
    return provider is not None and provider.is_offline


def destination(name: str, environ: Mapping[str, str] | None = None) -> str:
    """Return in words where the prompts for a model are sent and with which key; empty if none are sent.

    Args:
        name: Name of the model, as for `connect`.
        environ: Environment variables; those of this process by default.

    Raises:
        UserError: The name is unknown.
    """
    provider, argument = parse_model_name(name)
    if provider.is_offline or (provider.is_free and not provider.base_url):
        return ""
    environ = os.environ if environ is None else environ
    where = argument.partition("@")[2] or provider.url(environ) or provider.name_of(argument)
    variable = next((each for each in provider.key_variables if environ.get(each, "").strip()), "")
    return f"{where} with the key in {variable}" if variable else where


def absolute_name(name: str) -> str:
    """Return a model name that is valid in every working directory: a path in it is made absolute."""
    provider = provider_of(name)
    path = name.partition(":")[2]
    if provider is None or not provider.takes_path or not path.strip():
        return name
    return provider.name_of(str(Path(path).absolute()))


def price_usd(
    name: str,
    input_tokens: int,
    output_tokens: int,
    environ: Mapping[str, str] | None = None,
    *,
    highest: bool = False,
) -> float | None:
    """Return the price of a call without any cached input [USD]; None if it is unknown.

    Args:
        name: Name of the model, as for `connect`.
        input_tokens: Number of tokens of the prompt.
        output_tokens: Number of tokens of the reply, reasoning included.
        environ: Environment variables; a service at another base URL has no list price.
        highest: Whether to include the surcharge for writing the prompt to the provider's cache, see `list_price_usd`.

    Raises:
        UserError: The name is unknown.
    """
    provider, argument = parse_model_name(name)
    if provider.is_free:
        return 0.0
    environ = os.environ if environ is None else environ
    if provider.price_id is None or provider.url(environ) != provider.base_url:
        return None
    return list_price_usd(provider.price_id, argument, input_tokens, output_tokens, highest=highest)


def _secrets(provider: Provider, environ: Mapping[str, str]) -> tuple[SecretStr, ...]:
    """Return every API key in the environment variables `environ`, longest first."""
    variables = {variable for each in (*BUILT_IN, provider) for variable in each.key_variables}
    keys = {environ.get(variable, "").strip() for variable in variables} - {""}
    return tuple(SecretStr(key) for key in sorted(keys, key=len, reverse=True))


def _unknown(name: str) -> UserError:
    prefix, colon, argument = name.partition(":")
    known = {provider.prefix: provider for provider in providers() if provider.prefix}
    near = closest_name(prefix, known)
    if near and colon:
        meant = known[near].name_of(argument)
        return UserError(f'unknown provider: "{prefix}"; did you mean "{meant}"?')
    forms = ", ".join(provider.form for provider in providers())
    hint = f'did you mean "{known[near].example_name}"? ' if near else ""
    return UserError(f'"{name}" is not a model name; {hint}write one of {forms}')
