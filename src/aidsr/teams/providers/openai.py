"""Providers of OpenAI's models: the Responses API, and Chat Completions under a separate prefix."""

from __future__ import annotations

from aidsr.teams.providers.provider import Endpoint, Provider
from aidsr.teams.providers.remote import RemoteModel
from aidsr.teams.providers.wire import http_client


def _connect_responses(endpoint: Endpoint) -> RemoteModel:
    from pydantic_ai.models.openai import OpenAIResponsesModel
    from pydantic_ai.providers.openai import OpenAIProvider

    provider = OpenAIProvider(base_url=endpoint.base_url, api_key=endpoint.key_value, http_client=http_client())
    return RemoteModel(endpoint, OpenAIResponsesModel(endpoint.argument, provider=provider))


def _connect_chat(endpoint: Endpoint) -> RemoteModel:
    from pydantic_ai.models.openai import OpenAIChatModel
    from pydantic_ai.providers.openai import OpenAIProvider

    provider = OpenAIProvider(base_url=endpoint.base_url, api_key=endpoint.key_value, http_client=http_client())
    return RemoteModel(endpoint, OpenAIChatModel(endpoint.argument, provider=provider))


OPENAI = Provider(
    prefix="openai",
    title="OpenAI, Responses API",
    argument="MODEL",
    example="gpt-6.1-sol",
    connect=_connect_responses,
    key_variables=("OPENAI_API_KEY",),
    needs_key=True,
    base_url="https://api.openai.com/v1",
    base_url_variable="OPENAI_BASE_URL",
    price_id="openai",
)

OPENAI_CHAT = Provider(
    prefix="openai-chat",
    title="OpenAI, Chat Completions",
    doc="For proxies that do not know the Responses API.",
    argument="MODEL",
    example="gpt-6.1-sol",
    connect=_connect_chat,
    key_variables=("OPENAI_API_KEY",),
    needs_key=True,
    base_url="https://api.openai.com/v1",
    base_url_variable="OPENAI_BASE_URL",
    price_id="openai",
)
