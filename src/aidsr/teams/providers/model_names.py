"""Model names as people type them: `PROVIDER:MODEL`, or `MODEL@URL` for a server of one's own."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from urllib.parse import urlsplit

from aidsr.core.errors import UserError

__all__ = ["PROVIDERS", "Address", "parse_address"]

PROVIDERS: dict[str, str] = {
    "openai": "gpt-6.1-sol",
    "openai-chat": "gpt-6.1-sol",
    "anthropic": "claude-sonnet-5-5",
    "google": "gemini-3.8-flash",
    "openrouter": "qwen/qwen3-coder",
    "ollama": "qwen3:32b",
}
"""Every provider that can be named, with a model name as an example."""


@dataclass(frozen=True)
class Address:
    """Where a model is reached.

    Attributes:
        provider: A key of `PROVIDERS`, or "url" for a server named by its URL.
        model: The model's name as its server knows it.
        url: Base URL of the server, empty unless `provider` is "url".
    """

    provider: str
    model: str
    url: str = ""

    def __str__(self) -> str:
        """Return the name as it was typed."""
        return f"{self.model}@{self.url}" if self.provider == "url" else f"{self.provider}:{self.model}"


def parse_address(name: str) -> Address:
    """Return the address behind a model's name.

    Raises:
        UserError: The name has neither form, or its provider is not known. The nearest provider is named.
    """
    if "@http" in name:
        model, _, url = name.partition("@")
        return Address("url", _named(model, name), _checked_url(url, name))
    provider, colon, model = name.partition(":")
    if provider in PROVIDERS and colon:
        if provider == "openrouter" and model and "/" not in model:
            raise UserError(f'OpenRouter names a model with its maker; write for example "{_example(provider)}".')
        return Address(provider, _named(model, name))
    if provider in PROVIDERS:
        raise UserError(f'"{name}" names a provider without a model; write for example "{_example(provider)}".')
    near = difflib.get_close_matches(provider, PROVIDERS, n=1)
    if near and colon:
        raise UserError(f'There is no provider "{provider}"; did you mean "{near[0]}:{model}"?')
    raise UserError(
        f'"{name}" is not a model name; write PROVIDER:MODEL, for example "{_example(near[0] if near else "openai")}", '
        f"with one of {', '.join(PROVIDERS)}, or MODEL@URL for a server of your own."
    )


def _example(provider: str) -> str:
    return f"{provider}:{PROVIDERS[provider]}"


def _named(model: str, name: str) -> str:
    if not model or model != model.strip():
        raise UserError(f'"{name}" lacks the model; write PROVIDER:MODEL or MODEL@URL without spaces.')
    return model


def _checked_url(url: str, name: str) -> str:
    """Return the URL without a trailing slash; the name is recorded, so it must not carry a secret."""
    unusable = UserError(f'"{name}" has no usable URL; write for example "qwen3@http://localhost:8000/v1".')
    try:
        parts = urlsplit(url)
        if parts.username or parts.password or parts.query or parts.fragment:
            raise UserError(
                "A model's URL is written into run folders, so it must not contain a user, a password or a query; "
                "put the key into the environment variable AIDSR_API_KEY."
            )
        host, _ = parts.hostname, parts.port
    except ValueError:  # brackets without an end, or a port that is no number
        raise unusable from None
    if parts.scheme not in {"http", "https"} or not host or " " in url:
        raise unusable
    return url.rstrip("/")
