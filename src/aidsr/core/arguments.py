"""Checks of the arguments of the Python API that report a mistake in one sentence."""

from __future__ import annotations

import reprlib
from collections.abc import Collection
from numbers import Integral
from typing import Any

from aidsr.core.errors import UserError


def check_type(value: object, kinds: Any, sentence: str) -> None:
    """Check the type of an argument.

    Args:
        value: The argument.
        kinds: Allowed types, in the form that `isinstance` takes.
        sentence: Requirement for the error message, such as "task must be the name of a task".

    Raises:
        TypeError: The value has none of the allowed types.
    """
    if not isinstance(value, kinds):
        raise TypeError(f"{sentence}, not {reprlib.repr(value)}")


def check_whole_number(name: str, value: object, *, least: int) -> None:
    """Check that an argument is a whole number and not below a minimum.

    Raises:
        TypeError: The value is not a whole number.
        UserError: The value is below `least`.
    """
    if not isinstance(value, Integral) or isinstance(value, bool):
        raise TypeError(f"{name} must be a whole number, not {reprlib.repr(value)}")
    if int(value) < least:
        raise UserError(f"{name} must be at least {least}: {value}")


def as_names(names: str | Collection[str]) -> tuple[str, ...]:
    """Return names as a tuple; a single name may be given as a string."""
    return (names,) if isinstance(names, str) else tuple(names)
