"""From a name to a model that can be asked: which client, which profile, which key."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import SecretStr

from aidsr.core.errors import UserError
from aidsr.core.model import Model
from aidsr.teams.providers.credentials import Access
from aidsr.teams.providers.manual import MANUAL, ManualModel
from aidsr.teams.providers.model_names import Address, parse_address
from aidsr.teams.providers.prices import is_priced
from aidsr.teams.providers.remote import RemoteModel
from aidsr.teams.providers.retry import Clock, Patience

if TYPE_CHECKING:
    from pydantic_ai.models import Model as Client

__all__ = ["connect", "key_variables"]

_KEY_FIELDS = {
    "openai": "openai_api_key",
    "openai-chat": "openai_api_key",
    "anthropic": "anthropic_api_key",
    "google": "google_api_key",
    "openrouter": "openrouter_api_key",
    "ollama": "ollama_api_key",
    "url": "aidsr_api_key",
}
_KEY_OPTIONAL = frozenset({"ollama", "url"})


def connect(
    name: str, *, access: Access | None = None, patience: Patience | None = None, clock: Clock | None = None
) -> Model:
    """Return the language model of that name. Nothing is sent yet.

    Args:
        name: "openai:MODEL" (Responses API), "openai-chat:MODEL" (Chat Completions), "anthropic:MODEL",
            "google:MODEL", "openrouter:MODEL", "ollama:MODEL", or "MODEL@URL" for any server that speaks OpenAI's
            Chat Completions; "manual:DIRECTORY" for a person who answers in files.
        access: Keys and URLs; the environment's by default.
        patience: Retries and time limits; the environment's and our defaults by default.
        clock: Time as the retries see it.

    Raises:
        UserError: The name is not understood, the key it needs is not set, or a limit in the environment is no number.
    """
    if name.startswith(MANUAL):
        return ManualModel(_directory(name))
    address = parse_address(name)
    access = access or Access()
    key_field = _KEY_FIELDS[address.provider]
    key: SecretStr | None = getattr(access, key_field)
    if key is None and address.provider not in _KEY_OPTIONAL:
        raise UserError(f'"{address}" needs a key: set the environment variable {key_field.upper()}.')
    return RemoteModel(
        name=str(address),
        client=_client(address, key.get_secret_value() if key else None, access),
        priced=is_priced(address.provider, access),
        key_variable=key_field.upper(),
        access=access,
        patience=patience or Patience.from_environment(),
        clock=clock or Clock(),
    )


def key_variables(access: Access | None = None) -> dict[str, tuple[str, bool]]:
    """Return for each provider the environment variable of its key and whether that is set; never a key."""
    access = access or Access()
    return {
        provider: (name.upper(), getattr(access, name) is not None)
        for provider, name in _KEY_FIELDS.items()
        if provider != "url"
    }


def _directory(name: str) -> Path:
    directory = name.removeprefix(MANUAL)
    if not directory.strip():
        raise UserError(f'"{name}" lacks the directory for prompts and replies; write for example "{MANUAL}prompts".')
    return Path(directory)


def _client(address: Address, key: str | None, access: Access) -> Client:
    """Return pydantic-ai's client for an address; each library is loaded only for its own provider."""
    model = address.model
    match address.provider:
        case "openai" | "openai-chat":
            from pydantic_ai.models.openai import OpenAIChatModel, OpenAIResponsesModel
            from pydantic_ai.providers.openai import OpenAIProvider

            wire = OpenAIResponsesModel if address.provider == "openai" else OpenAIChatModel
            base_url = access.openai_base_url or "https://api.openai.com/v1"
            return wire(model, provider=OpenAIProvider(base_url=base_url, api_key=key))
        case "anthropic":
            from pydantic_ai.models.anthropic import AnthropicModel
            from pydantic_ai.providers.anthropic import AnthropicProvider

            base_url = access.anthropic_base_url or "https://api.anthropic.com"
            return AnthropicModel(model, provider=AnthropicProvider(api_key=key, base_url=base_url))
        case "google":
            from pydantic_ai.models.google import GoogleModel
            from pydantic_ai.providers.google import GoogleProvider

            base_url = access.google_base_url or "https://generativelanguage.googleapis.com"
            return GoogleModel(model, provider=GoogleProvider(api_key=key, base_url=base_url))
        case "openrouter":
            from pydantic_ai.models.openrouter import OpenRouterModel, OpenRouterModelSettings
            from pydantic_ai.providers.openrouter import OpenRouterProvider

            router = OpenRouterProvider(api_key=key)
            router.client.base_url = access.openrouter_base_url or router.client.base_url
            report_cost = OpenRouterModelSettings(openrouter_usage={"include": True})
            return OpenRouterModel(model, provider=router, settings=report_cost)
        case "ollama":
            return _compatible("ollama", model, access.ollama_base_url, key)
        case _:
            return _compatible("local", model, address.url, key)


def _compatible(service: str, model: str, url: str, key: str | None) -> Client:
    """Return a client for a server that speaks Chat Completions as most do, not as OpenAI itself does.

    Such servers ignore `max_completion_tokens` and know `max_tokens`; strict chat templates refuse a system message
    after the first place.
    """
    from pydantic_ai.models.openai import OpenAIChatModel
    from pydantic_ai.profiles.openai import OpenAIModelProfile
    from pydantic_ai.providers.openai_compatible import OpenAICompatibleProvider

    profile = OpenAIModelProfile(openai_chat_supports_max_completion_tokens=False, supports_inline_system_prompts=False)
    provider = OpenAICompatibleProvider(service, base_url=url, api_key=key, profile=profile)
    return OpenAIChatModel(model, provider=provider)
