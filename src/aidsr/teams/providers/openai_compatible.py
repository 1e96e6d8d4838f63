"""Provider for any server with OpenAI's Chat Completions API, named by its URL.

Examples are vLLM, llama.cpp, LM Studio, SGLang or a gateway.
"""

from __future__ import annotations

from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from aidsr.core.errors import UserError
from aidsr.teams.providers.provider import Endpoint, Provider
from aidsr.teams.providers.remote import RemoteModel
from aidsr.teams.providers.wire import http_client

if TYPE_CHECKING:
    from pydantic_ai.models import Model as Client


def chat_completions_client(service: str, model: str, url: str, key: str | None) -> Client:
    """Return a client for a Chat Completions server other than OpenAI's own.

    Most of these servers ignore `max_completion_tokens` and use `max_tokens`; strict chat templates reject a system
    message that is not the first message.
    """
    from pydantic_ai.models.openai import OpenAIChatModel
    from pydantic_ai.profiles.openai import OpenAIModelProfile
    from pydantic_ai.providers.openai_compatible import OpenAICompatibleProvider

    profile = OpenAIModelProfile(openai_chat_supports_max_completion_tokens=False, supports_inline_system_prompts=False)
    provider = OpenAICompatibleProvider(service, base_url=url, api_key=key, profile=profile, http_client=http_client())
    return OpenAIChatModel(model, provider=provider)


def _connect(endpoint: Endpoint) -> RemoteModel:
    model, _, url = endpoint.argument.partition("@")
    return RemoteModel(endpoint, chat_completions_client("local", model, url, endpoint.key_value))


def _normalize(argument: str) -> str:
    """Return MODEL@URL without a trailing slash. It is recorded in run folders, so it must not contain a secret."""
    model, _, url = argument.partition("@")
    if not model or model != model.strip():
        raise UserError(f'"{argument}" lacks the model; write MODEL@URL without spaces')
    unusable = UserError(f'"{argument}" has no usable URL; write for example "{OPENAI_COMPATIBLE.example_name}"')
    try:
        parts = urlsplit(url)
        if parts.username or parts.password or parts.query or parts.fragment:
            raise UserError(
                "a model's URL with a user, a password or a query would be written into run folders; set the "
                "environment variable AIDSR_API_KEY instead"
            )
        host, _ = parts.hostname, parts.port
    except ValueError:  # unclosed brackets, or a port that is not a number
        raise unusable from None
    if parts.scheme not in {"http", "https"} or not host or " " in url:
        raise unusable
    return f"{model}@{url.rstrip('/')}"


OPENAI_COMPATIBLE = Provider(
    prefix="",
    title="OpenAI-compatible server",
    doc="Any server that speaks Chat Completions: vLLM, llama.cpp, LM Studio, SGLang, a gateway.",
    argument="MODEL@URL",
    example="qwen3@http://localhost:8000/v1",
    connect=_connect,
    normalize=_normalize,
    key_variables=("AIDSR_API_KEY",),
)
