"""Checks of the arguments of the Python API, so that a mistake is one sentence."""

from __future__ import annotations

import reprlib
from collections.abc import Collection
from numbers import Integral
from typing import Any

from aidsr.core.errors import UserError


def check_type(value: object, kinds: Any, sentence: str) -> None:
    """Refuse a value of another type.

    Args:
        value: What was given.
        kinds: The types that are taken, as `isinstance` reads them.
        sentence: What is taken, as "task must be the name of a task".

    Raises:
        TypeError: It is of none of them.
    """
    if not isinstance(value, kinds):
        raise TypeError(f"{sentence}, not {reprlib.repr(value)}")


def check_whole_number(name: str, value: object, *, least: int) -> None:
    """Refuse what is no whole number, or one that is too small.

    Raises:
        TypeError: It is no whole number.
        UserError: It is too small.
    """
    if not isinstance(value, Integral) or isinstance(value, bool):
        raise TypeError(f"{name} must be a whole number, not {reprlib.repr(value)}")
    if int(value) < least:
        raise UserError(f"{name} must be at least {least}: {value}")


def as_names(names: str | Collection[str]) -> tuple[str, ...]:
    """Return names, of which a single one may be given as a string."""
    return (names,) if isinstance(names, str) else tuple(names)
