"""List prices of models."""

from __future__ import annotations

from typing import TYPE_CHECKING

from aidsr.teams.providers.wire import amount

if TYPE_CHECKING:
    from pydantic_ai.messages import ModelResponse


def list_price_usd(
    price_id: str, model: str, input_tokens: int, output_tokens: int, *, highest: bool = False
) -> float | None:
    """Return the list price of a call without any cached input [USD]; None if it is unknown.

    Args:
        price_id: Name of the provider in genai-prices.
        model: Name of the model at its provider.
        input_tokens: Number of tokens of the prompt.
        output_tokens: Number of tokens of the reply, reasoning included.
        highest: Whether to return the price if the whole prompt is written to the provider's cache, where that costs
            more: Anthropic asks for 1.25 times the price of the prompt.

    Source: list prices of the genai-prices package, matched by provider and model name.
    """
    from genai_prices import Usage, calc_price

    calls = [Usage(input_tokens=input_tokens, output_tokens=output_tokens)]
    if highest:
        calls.append(Usage(input_tokens=input_tokens, cache_write_tokens=input_tokens, output_tokens=output_tokens))
    try:
        return max(float(calc_price(call, model_ref=model, provider_id=price_id).total_price) for call in calls)
    except (LookupError, ValueError):
        return None


def cost_usd(response: ModelResponse, has_list_price: bool) -> float | None:
    """Return the cost of a response [USD]: as reported by its server, else by list price; None if it is unknown.

    Args:
        response: The response.
        has_list_price: Whether the provider's list prices apply.

    Source: list prices of the genai-prices package, matched by provider and model name.
    """
    reported = amount((response.provider_details or {}).get("cost"))
    if reported is not None:
        return reported
    if not has_list_price or not response.model_name:
        return None
    try:
        return float(response.cost().total_price)
    except (LookupError, ValueError):
        return None
