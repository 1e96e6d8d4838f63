"""Feedback in plain words, as far as rules understand it: longer, stiffer, stronger, more fingers, another family."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any, TypeVar

import annotated_types

from aidsr.teams.rules.families.family import Is, Parameters, Quantity

P = TypeVar("P", bound=Parameters)

_MORE, _LESS = 1.25, 0.8
"""Factors by which one word changes a parameter. Our choice: a visible change that stays close to what worked."""

WORDS: tuple[tuple[str, tuple[Quantity, ...], float], ...] = (
    # A longer limb of the same stiffness would bend and sag more, so its stiffness grows with its length.
    (r"longer|too short|reach(es)? only|farther|further", ("length", "stiffness"), _MORE),
    (r"shorter|too long", ("length", "stiffness"), _LESS),
    (r"stiffer|too soft|sturdier|sags?\b", ("stiffness",), _MORE),
    (r"softer|too stiff|more compliant|more flexible", ("stiffness",), _LESS),
    (r"stronger|more force|too weak|more tension", ("tension",), _MORE),
    (r"weaker|less force|too strong|gentler", ("tension",), _LESS),
    (r"thicker", ("thickness",), _MORE),
    (r"thinner|slimmer", ("thickness",), _LESS),
    (r"wider", ("width", "tip width"), _MORE),
    (r"narrower", ("width", "tip width"), _LESS),
    (r"calmer|more damping|less ringing|slower", ("damping",), 1.5),
    (r"lighter", ("density", "mass"), _LESS),
    (r"heavier", ("density", "mass"), _MORE),
)
"""Regular expressions for words, the quantities to which they refer, and the factor."""


def apply_feedback(parameters: P, feedback: str) -> tuple[P, list[str]]:
    """Return parameters changed as the feedback requests, each within its range, and the requests understood."""
    words, update, understood = feedback.lower(), {}, []
    values: dict[str, Any] = parameters.model_dump()
    for pattern, quantities, factor in WORDS:
        match = re.search(pattern, words)
        if match and (changed := _multiplied(parameters, quantities, factor)):
            update.update(changed)
            understood.append(f'"{match.group()}" ({", ".join(changed)} x {factor:g})')
    counts = "|".join(_names_of(parameters, "count"))
    count = re.search(rf"\b(more|fewer|less) ({counts})", words) if counts else None
    if count and values[name := count.group(2)]:
        step = parameters.count_step(name) * (1 if count.group(1) == "more" else -1)
        update[name] = int(_within(parameters, name, values[name] + step))
        understood.append(f'"{count.group()}"')
    return parameters.model_copy(update=update), understood


def other_family(feedback: str, present: str, suitable: Iterable[str]) -> str | None:
    """Return another family than the present one that the feedback names and that suits the job; None without one."""
    return next((name for name in suitable if name != present and re.search(rf"\b{name}s?\b", feedback.lower())), None)


def scaled(parameters: P, quantities: Iterable[Quantity], factor: float) -> P:
    """Return parameters in which those of the given quantities are multiplied by a factor, each within its range."""
    return parameters.model_copy(update=_multiplied(parameters, quantities, factor))


def _multiplied(parameters: Parameters, quantities: Iterable[Quantity], factor: float) -> dict[str, float]:
    """Return the parameters of the given quantities that are not 0, multiplied by a factor, each within its range."""
    values: dict[str, Any] = parameters.model_dump()
    names = [name for quantity in quantities for name in _names_of(parameters, quantity) if values[name]]
    return {name: _within(parameters, name, values[name] * factor) for name in names}


def _names_of(parameters: Parameters, quantity: Quantity) -> list[str]:
    """Return the names of the parameters of a quantity, in the order of their definition."""
    fields = type(parameters).model_fields
    return [name for name, field in fields.items() if Is(quantity) in field.metadata]


def _within(parameters: Parameters, name: str, value: float) -> float:
    """Return the value, clipped to the range of its field and rounded to five digits."""
    for bound in type(parameters).model_fields[name].metadata:
        if isinstance(bound, annotated_types.Ge) and isinstance(bound.ge, int | float):
            value = max(value, bound.ge)
        if isinstance(bound, annotated_types.Le) and isinstance(bound.le, int | float):
            value = min(value, bound.le)
    return float(f"{value:.5g}")
