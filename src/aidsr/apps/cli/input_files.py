"""Files given to `aidsr fix` and `aidsr validate`, of which one may be standard input."""

from __future__ import annotations

import sys
from collections.abc import Sequence

STANDARD_INPUT = "-"
"""Name of standard input on the command line."""


def require_files(files: Sequence[str], command: str) -> None:
    """Check that files are given, and that none of them is a misspelt option.

    Raises:
        UserError: There is no file, or one begins with "--".
    """
    from aidsr.core.errors import UserError

    unknown = next((file for file in files if file.startswith("--")), None)
    if unknown or not files:
        fault = f"unknown option: {unknown}" if unknown else "no file given"
        raise UserError(f"{fault}; see aidsr {command} --help")


def read_standard_input() -> str:
    """Return the MJCF on standard input.

    Raises:
        MjcfError: It is too large, or not text.
    """
    from aidsr.mjcf.read import decode_mjcf

    return decode_mjcf(sys.stdin.buffer.read(), "standard input")
