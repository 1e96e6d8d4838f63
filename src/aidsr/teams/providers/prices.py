"""What a call may cost, before it is made."""

from __future__ import annotations

from aidsr.teams.providers.credentials import Access
from aidsr.teams.providers.model_names import parse_address

__all__ = ["is_priced", "list_price_usd"]

_PROVIDER_IDS = {"openai-chat": "openai"}
"""Names of genai-prices where they differ from ours."""


def is_priced(provider: str, access: Access) -> bool:
    """Return whether list prices apply: the provider's own service, not a proxy and not a local server."""
    urls = {
        "openai": access.openai_base_url,
        "openai-chat": access.openai_base_url,
        "anthropic": access.anthropic_base_url,
        "google": access.google_base_url,
        "openrouter": access.openrouter_base_url,
    }
    return provider in urls and urls[provider] is None


def list_price_usd(name: str, input_tokens: int, output_tokens: int, access: Access | None = None) -> float | None:
    """Return the list price of a call without any cached input [USD]; None when it is not known.

    Args:
        name: Name of the model, as for `connect`.
        input_tokens: Tokens of the prompt.
        output_tokens: Tokens of the reply, reasoning included.
        access: URLs; a model behind one of one's own has no list price. The environment's by default.

    Source: list prices of the genai-prices package, matched by provider and model name.
    """
    from genai_prices import Usage, calc_price

    address = parse_address(name)
    if not is_priced(address.provider, access or Access()):
        return None
    usage = Usage(input_tokens=input_tokens, output_tokens=output_tokens)
    provider = _PROVIDER_IDS.get(address.provider, address.provider)
    try:
        return float(calc_price(usage, model_ref=address.model, provider_id=provider).total_price)
    except (LookupError, ValueError):
        return None
