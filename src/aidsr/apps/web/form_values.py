"""Checks of the values that a visitor enters in a form."""

from __future__ import annotations

from aidsr.core.errors import UserError


def whole_number(title: str, value: object, *, least: int) -> int:
    """Return the whole number of a field, which the browser may send as a float.

    Args:
        title: Title of the field, for the error message.
        value: Value of the field; None if it is empty.
        least: Minimum.

    Raises:
        UserError: The value is not a whole number, or is below `least`.
    """
    if not isinstance(value, int | float) or not float(value).is_integer() or value < least:
        raise UserError(f"{title} must be a whole number of at least {least}")
    return int(value)
