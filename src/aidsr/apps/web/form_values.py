"""Number fields, and checks of the values that a visitor enters in them."""

from __future__ import annotations

from math import isfinite

from nicegui import ui

from aidsr.core.errors import UserError


class NumberField(ui.number):
    """A number field that keeps what was typed; `ui.number` silently replaces it by the nearest allowed value."""

    def sanitize(self) -> None:
        """Leave the value as it is: the field says what is allowed, and so does the check of the form."""


def whole_number_field(title: str, *, least: int, most: int | None = None, step: int = 1) -> ui.number:
    """Return a field for a whole number, which says what is allowed while another value is in it."""

    def complaint(value: float | None) -> str | None:
        return None if _is_whole(value, least, most) else _allowed(least, most)

    field = NumberField(title, min=least, max=most, step=step, validation=complaint)
    return field.props("outlined dense")


def whole_number(title: str, value: object, *, least: int, most: int | None = None) -> int:
    """Return the whole number of a field, which the browser may send as a float.

    Args:
        title: Title of the field, for the error message.
        value: Value of the field; None if it is empty.
        least: Minimum.
        most: Maximum; None for none.

    Raises:
        UserError: The value is not a whole number, or is out of bounds.
    """
    if not isinstance(value, int | float) or not _is_whole(value, least, most):
        raise UserError(f"{title} must be {_allowed(least, most)}")
    return int(value)


def limit_field(title: str, *, step: float, whole: bool, empty: str = "no limit") -> ui.number:
    """Return a field for a limit, which may stay empty; see `limit`."""

    def complaint(value: float | None) -> str | None:
        return _limit_complaint(value, whole=whole, empty=empty) or None

    field = NumberField(title, min=0, step=step, validation=complaint)
    field.props["placeholder"] = empty
    return field.props("outlined dense clearable")


def limit(title: str, value: float | None, *, whole: bool, empty: str = "no limit") -> float | None:
    """Return the limit in a field; None if the field is empty.

    Args:
        title: Title of the field, for the error message.
        value: Value of the field; None if it is empty.
        whole: Whether fractions are refused.
        empty: What holds if the field is empty.

    Raises:
        UserError: The limit is not above zero, or is a fraction where `whole` refuses these.
    """
    if complaint := _limit_complaint(value, whole=whole, empty=empty):
        raise UserError(f"{title} must be {complaint}")
    return value


def _is_whole(value: float | None, least: int, most: int | None) -> bool:
    return value is not None and float(value).is_integer() and least <= value and (most is None or value <= most)


def _allowed(least: int, most: int | None) -> str:
    return f"a whole number of at least {least}" if most is None else f"a whole number from {least} to {most}"


def _limit_complaint(value: float | None, *, whole: bool, empty: str) -> str:
    if value is None or (isfinite(value) and value > 0 and (float(value).is_integer() or not whole)):
        return ""
    return f"{'a whole number ' * whole}above 0, or empty for {empty}"
