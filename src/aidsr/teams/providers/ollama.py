"""Provider of Ollama's models, on this machine unless OLLAMA_BASE_URL names another one."""

from __future__ import annotations

from aidsr.teams.providers.openai_compatible import chat_completions_client
from aidsr.teams.providers.provider import Endpoint, Provider
from aidsr.teams.providers.remote import RemoteModel


def _connect(endpoint: Endpoint) -> RemoteModel:
    client = chat_completions_client("ollama", endpoint.argument, endpoint.base_url, endpoint.key_value)
    return RemoteModel(endpoint, client)


OLLAMA = Provider(
    prefix="ollama",
    title="Ollama",
    doc="Open models on this machine.",
    argument="MODEL",
    example="qwen3:32b",
    connect=_connect,
    key_variables=("OLLAMA_API_KEY",),
    base_url="http://localhost:11434/v1",
    base_url_variable="OLLAMA_BASE_URL",
)
