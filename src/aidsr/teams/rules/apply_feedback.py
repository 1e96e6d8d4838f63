"""Wishes in plain words, as far as rules understand them: longer, stiffer, stronger, more fingers, another family."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any, TypeVar

import annotated_types

from aidsr.teams.rules.families.family import Parameters

__all__ = ["granted", "other_family"]

P = TypeVar("P", bound=Parameters)

_MORE, _LESS = 1.25, 0.8
"""How much one wish changes a number. Our choice: enough to see, not enough to leave what worked."""

_LENGTHS = ("length_m", "finger_length_m", "leg_length_m", "stalk_m", "wrist_m")
_TENSIONS = ("tension_n", "closing_n", "opening_n")
_COUNTS = ("fingers", "legs", "sections", "sectors")
_STIFFNESS = ("bending_stiffness_n_m2",)
_THICKNESS = ("radius_m", "base_radius_m", "tip_radius_m", "thickness_m")

_WISHES: tuple[tuple[str, tuple[str, ...], float], ...] = (
    # A longer limb of the same stiffness would bend and sag more, so its stiffness grows with its length.
    (r"longer|too short|reach(es)? only|farther|further", (*_LENGTHS, *_STIFFNESS), _MORE),
    (r"shorter|too long", (*_LENGTHS, *_STIFFNESS), _LESS),
    (r"stiffer|too soft|sturdier|sags?\b", _STIFFNESS, _MORE),
    (r"softer|too stiff|more compliant|more flexible", _STIFFNESS, _LESS),
    (r"stronger|more force|too weak|more tension", _TENSIONS, _MORE),
    (r"weaker|less force|too strong|gentler", _TENSIONS, _LESS),
    (r"thicker", _THICKNESS, _MORE),
    (r"thinner|slimmer", _THICKNESS, _LESS),
    (r"wider", ("palm_radius_m", "foot_half_width_m", "half_width_m", "trunk_width_m", "pad_half_width_m"), _MORE),
    (r"narrower", ("palm_radius_m", "foot_half_width_m", "half_width_m", "trunk_width_m", "pad_half_width_m"), _LESS),
    (r"calmer|more damping|less ringing|slower", ("damping_time_s",), 1.5),
    (r"lighter", ("density_kg_m3", "trunk_mass_kg", "foot_mass_kg", "tread_mass_kg"), _LESS),
    (r"heavier", ("density_kg_m3", "trunk_mass_kg", "foot_mass_kg", "tread_mass_kg"), _MORE),
)
"""Words, the parameters they mean, and the factor."""


def granted(parameters: P, wish: str) -> tuple[P, list[str]]:
    """Return parameters changed as the words ask, within each parameter's range, and what was understood."""
    words, update, understood = wish.lower(), {}, []
    values: dict[str, Any] = parameters.model_dump()
    for pattern, names, factor in _WISHES:
        match = re.search(pattern, words)
        present = [name for name in names if values.get(name)]
        if match and present:
            for name in present:
                update[name] = _within(parameters, name, values[name] * factor)
            understood.append(f'"{match.group()}" ({", ".join(present)} x {factor:g})')
    count = re.search(r"\b(more|fewer|less) (fingers|legs|sections|sectors)", words)
    if count and values.get(count.group(2)):
        step = (1 if count.group(1) == "more" else -1) * (2 if count.group(2) == "legs" or values.get("opposed") else 1)
        update[count.group(2)] = int(_within(parameters, count.group(2), values[count.group(2)] + step))
        understood.append(f'"{count.group()}"')
    return parameters.model_copy(update=update), understood


def _within(parameters: Parameters, name: str, value: float) -> float:
    """Return the value, kept inside the range its field allows."""
    for bound in type(parameters).model_fields[name].metadata:
        if isinstance(bound, annotated_types.Ge) and isinstance(bound.ge, int | float):
            value = max(value, bound.ge)
        if isinstance(bound, annotated_types.Le) and isinstance(bound.le, int | float):
            value = min(value, bound.le)
    return float(f"{value:.5g}")


def other_family(wish: str, present: str, suitable: Iterable[str]) -> str | None:
    """Return a family that the words name and that suits the job, other than the present one."""
    return next((name for name in suitable if name != present and re.search(rf"\b{name}s?\b", wish.lower())), None)
