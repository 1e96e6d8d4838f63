"""Provider of OpenRouter's models: many makers with one API key. The server reports the cost of each call."""

from __future__ import annotations

from aidsr.core.errors import UserError
from aidsr.teams.providers.provider import Endpoint, Provider
from aidsr.teams.providers.remote import RemoteModel
from aidsr.teams.providers.wire import http_client


def _connect(endpoint: Endpoint) -> RemoteModel:
    from pydantic_ai.models.openrouter import OpenRouterModel, OpenRouterModelSettings
    from pydantic_ai.providers.openrouter import OpenRouterProvider

    provider = OpenRouterProvider(api_key=endpoint.key_value, http_client=http_client())
    provider.client.base_url = endpoint.base_url
    report_cost = OpenRouterModelSettings(openrouter_usage={"include": True})
    return RemoteModel(endpoint, OpenRouterModel(endpoint.argument, provider=provider, settings=report_cost))


def _normalize(model: str) -> str:
    if "/" not in model:
        raise UserError(f'"openrouter:{model}" lacks the maker; write for example "{OPENROUTER.example_name}"')
    return model


OPENROUTER = Provider(
    prefix="openrouter",
    title="OpenRouter",
    doc="Models of many makers behind one key.",
    argument="MAKER/MODEL",
    example="qwen/qwen3-coder",
    connect=_connect,
    normalize=_normalize,
    key_variables=("OPENROUTER_API_KEY",),
    needs_key=True,
    base_url="https://openrouter.ai/api/v1",
    base_url_variable="OPENROUTER_BASE_URL",
    price_id="openrouter",
)
