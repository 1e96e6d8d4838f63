"""Provider of Google's models."""

from __future__ import annotations

from aidsr.teams.providers.provider import Endpoint, Provider
from aidsr.teams.providers.remote import RemoteModel
from aidsr.teams.providers.wire import http_client


def _connect(endpoint: Endpoint) -> RemoteModel:
    from pydantic_ai.models.google import GoogleModel
    from pydantic_ai.providers.google import GoogleProvider

    provider = GoogleProvider(base_url=endpoint.base_url, api_key=endpoint.key_value, http_client=http_client())
    return RemoteModel(endpoint, GoogleModel(endpoint.argument, provider=provider))


GOOGLE = Provider(
    prefix="google",
    title="Google, Gemini API",
    argument="MODEL",
    example="gemini-3.8-flash",
    connect=_connect,
    key_variables=("GOOGLE_API_KEY", "GEMINI_API_KEY"),
    needs_key=True,
    base_url="https://generativelanguage.googleapis.com",
    base_url_variable="GOOGLE_BASE_URL",
    price_id="google",
)
