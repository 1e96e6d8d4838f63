"""Reading of untrusted text files that a user names."""

from __future__ import annotations

import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

from aidsr.core.errors import UserError


def read_text_file(path: Path, *, max_bytes: int) -> str:
    """Return the text of a file.

    Args:
        path: The file; a link to it is followed, because the user named it.
        max_bytes: Maximum size [bytes]; of a larger file at most one byte more is read.

    Raises:
        UserError: The file is too large, not UTF-8, or not a regular file (a pipe would block for ever, a device would
            never end).
        OSError: The file cannot be opened.
    """
    # without O_NONBLOCK, opening a named pipe that has no writer would block
    with os.fdopen(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)), "rb") as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise UserError(f"{path} is not a regular file; name a file")
        content = file.read(max_bytes + 1)
    if len(content) > max_bytes:
        raise UserError(f"{path} is larger than {max_bytes:,} bytes, the most that is read; name a smaller file")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise UserError(f"{path} is not UTF-8 text; give a text file, saved as UTF-8") from None


_MAX_DEPTH = 20
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_PART}(?:\.[ \t]*+{_PART}){{{_MAX_DEPTH},}}")
_TOO_DEEP = f"tables and lists are nested more than {_MAX_DEPTH} deep"


def parse_toml(text: str) -> dict[str, Any]:
    """Return the values in a TOML text.

    Raises:
        ValueError: The text is not TOML, is nested too deeply, or has a number that is too long.
    """
    if _LONG_KEY.search(text):  # the time of tomllib grows with the square of the number of parts
        raise ValueError(_TOO_DEEP)
    try:
        values = tomllib.loads(text)
    except RecursionError:
        raise ValueError(_TOO_DEEP) from None
    level: list[Any] = [values]
    for _ in range(_MAX_DEPTH):
        level = [inner for each in level for inner in (each.values() if isinstance(each, dict) else each)]
        level = [inner for inner in level if isinstance(inner, dict | list)]
        if not level:
            return values
    raise ValueError(_TOO_DEEP)
