"""Feedback in plain words, as far as rules understand it: longer, stiffer, stronger, more fingers, another family."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

import annotated_types

from aidsr.core.artifacts import Concept
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

UNDERSTOOD = (
    "longer, shorter, stiffer, softer, stronger, weaker, thicker, thinner, wider, narrower, lighter, heavier, calmer; "
    "more or fewer fingers, legs, sections or sectors; the name of another family"
)
"""The words that the rules understand in a refinement, for a person."""

_ISSUE = re.compile(r"^[a-z_]+: ", re.MULTILINE)
"""Begin of an issue of the Judge or of a trial, as the loop writes it: "component: problem"."""

_PART = re.compile(r"^About (\S+): ")
"""Begin of a person's words about one part, as the review form writes it."""

_AMOUNT = re.compile(r"\d+(?:\.\d+)?\s*(?:%|[a-z]+)?")
_CLAUSE = re.compile(r"[.,;!?](?=\s|$)|\n|\b(?:and|but)\b")

_CHANGES = re.compile(r"(?:Changed as |The built-in rules recognized no change).*", re.DOTALL)
"""The sentences of a rationale that `with_changes` wrote."""


def apply_feedback(parameters: P, feedback: str) -> tuple[P, list[str]]:
    """Return parameters changed as the feedback requests, each within its range, and the requests understood."""
    words, understood = feedback.lower(), list[str]()
    for pattern, quantities, factor in WORDS:
        match = re.search(pattern, words)
        if match and (changed := _multiplied(parameters, quantities, factor)):
            parameters = parameters.model_copy(update=changed)  # words for the same parameter act one after the other
            understood.append(f'"{match.group()}" ({", ".join(changed)} x {factor:g})')
    counts = "|".join(_names_of(parameters, "count"))
    count = re.search(rf"\b(more|fewer|less) ({counts})", words) if counts else None
    if count and (now := getattr(parameters, name := count.group(2))):
        step = parameters.count_step(name) * (1 if count.group(1) == "more" else -1)
        parameters = parameters.model_copy(update={name: int(_within(parameters, name, now + step))})
        understood.append(f'"{count.group()}"')
    return parameters, understood


def with_changes(concept: Concept, before: Concept, feedback: str, understood: Sequence[str]) -> Concept:
    """Return a changed concept whose rationale tells who asked, what was changed, and what was not understood.

    What earlier feedback changed is kept in the rationale, since a later change can undo it.

    Args:
        concept: The changed concept.
        before: The concept before the change.
        feedback: The feedback of a person or of the Judge.
        understood: What was changed: each time the words that were understood, in quotes, and their effect.
    """
    judged = bool(_ISSUE.search(feedback))
    who, changes = "the Judge" if judged else "you", ", ".join(understood)
    told = (
        f"Changed as {who} asked: {changes}."
        if changes
        else f"The built-in rules recognized no change in what {who} asked and changed nothing."
    )
    missed = [] if judged else _not_understood(feedback, re.findall(r'"(.+?)"', changes))
    if missed:
        told += f" Not understood: {', '.join(missed)}."
    earlier = _CHANGES.search(before.rationale)
    own = _CHANGES.sub("", concept.rationale).strip()
    sentences = (own, earlier.group() if earlier else "", told)
    return concept.model_copy(update={"rationale": " ".join(part for part in sentences if part)})


def _not_understood(feedback: str, words: Sequence[str]) -> list[str]:
    """Return what the rules did not read in a person's feedback: a part, whole clauses, and amounts; each quoted."""
    part = _PART.match(feedback)
    missed = [f'"{part.group(1)}" (the rules change the whole robot)'] if part else []
    for clause in _CLAUSE.split(feedback[part.end() if part else 0 :]):
        if not any(word in clause.lower() for word in words):
            missed += [f'"{clause.strip()}"'] * bool(clause.strip())
        else:
            missed += [f'"{amount.strip()}"' for amount in _AMOUNT.findall(clause)]
    return missed


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
