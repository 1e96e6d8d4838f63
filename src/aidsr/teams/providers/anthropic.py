"""Provider of Anthropic's models."""

from __future__ import annotations

from aidsr.teams.providers.provider import Endpoint, Provider
from aidsr.teams.providers.remote import RemoteModel
from aidsr.teams.providers.wire import http_client


def _connect(endpoint: Endpoint) -> RemoteModel:
    from pydantic_ai.models.anthropic import AnthropicModel
    from pydantic_ai.providers.anthropic import AnthropicProvider

    provider = AnthropicProvider(base_url=endpoint.base_url, api_key=endpoint.key_value, http_client=http_client())
    return RemoteModel(endpoint, AnthropicModel(endpoint.argument, provider=provider))


ANTHROPIC = Provider(
    prefix="anthropic",
    title="Anthropic, Messages API",
    argument="MODEL",
    example="claude-sonnet-5-5",
    connect=_connect,
    key_variables=("ANTHROPIC_API_KEY",),
    needs_key=True,
    base_url="https://api.anthropic.com",
    base_url_variable="ANTHROPIC_BASE_URL",
    price_id="anthropic",
)
