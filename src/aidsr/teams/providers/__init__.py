"""Providers of models: one record for each kind of name that `--model` accepts.

    model = connect("anthropic:claude-sonnet-5-5")
    record = model.ask(question)

Each provider is a `Provider` record in its own file; `registry` lists them and finds the provider of a model name.
Client libraries are loaded when `connect` is called, never at import. docs/add_a_provider.md shows how a package adds a
provider.
"""

from aidsr.teams.providers.manual import ManualModel
from aidsr.teams.providers.provider import Endpoint, Provider
from aidsr.teams.providers.registry import (
    absolute_name,
    connect,
    destination,
    is_offline,
    parse_model_name,
    price_usd,
    provider_of,
    providers,
)
from aidsr.teams.providers.retry import Clock, RetryPolicy

__all__ = [
    "Clock",
    "Endpoint",
    "ManualModel",
    "Provider",
    "RetryPolicy",
    "absolute_name",
    "connect",
    "destination",
    "is_offline",
    "parse_model_name",
    "price_usd",
    "provider_of",
    "providers",
]
