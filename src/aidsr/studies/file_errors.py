"""Conversion of pydantic's validation errors into one sentence for users who edited a file."""

from __future__ import annotations

from pydantic import ValidationError

from aidsr.core.formatting import excerpt


def first_error(error: ValidationError) -> str:
    """Return the first error: the key, what is wrong with it, and the value found. List entries count from 1."""
    first = error.errors()[0]
    key = ""
    for part in first["loc"]:
        key += f"[{part + 1}]" if isinstance(part, int) else f".{excerpt(part)}" if key else excerpt(part)
    shown = excerpt(repr(first["input"]))
    match first["type"]:
        case "missing":
            return f'the key "{key}" is missing'
        case "extra_forbidden":
            return f'there is no key "{key}"; found {shown} for it'
        case "value_error":
            return (f'"{key}": ' if key else "") + str(first["ctx"]["error"])
        case "json_invalid":
            return f"not valid JSON: {first['ctx']['error']}"
        case "too_short":
            return f'"{key}": at least {first["ctx"]["min_length"]} entry required, found {shown}'
        case _:
            expected = first["msg"].removeprefix("Input should be ")
            return f'"{key}": expected {expected[:1].lower()}{expected[1:]}, found {shown}'
