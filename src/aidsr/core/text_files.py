"""Text files that a person names and somebody else may have written."""

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
        path: The file; a link to it is followed, since its user named it.
        max_bytes: Bound on its size; a larger one is refused without being read.

    Raises:
        UserError: It is no regular file (a pipe would block for ever, a device never end), too large or not UTF-8.
        OSError: It cannot be opened.
    """
    # a named pipe without a writer would block while it is opened
    with os.fdopen(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)), "rb") as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise UserError(f"{path} is not a regular file; name a file")
        content = file.read(max_bytes + 1)
    if len(content) > max_bytes:
        raise UserError(f"{path} is larger than {max_bytes:,} bytes, the most that is read; name a smaller file")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise UserError(f"{path} is not UTF-8 text; save it as UTF-8") from None


_MAX_DEPTH = 20
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_PART}(?:\.[ \t]*+{_PART}){{{_MAX_DEPTH},}}")
_TOO_DEEP = f"tables and lists are nested more than {_MAX_DEPTH} deep"


def parse_toml(text: str) -> dict[str, Any]:
    """Return the values in a TOML text.

    Raises:
        ValueError: It is not TOML, or nests too deep or has a number too long to be read.
    """
    if _LONG_KEY.search(text):  # takes tomllib a time that grows with the square of its parts
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
