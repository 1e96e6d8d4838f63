"""Marking of folders that were made on this machine, with a mark that cannot be forged elsewhere.

A run or study folder determines which server is called, which API key is sent there and where prompts are written.
Therefore a folder from elsewhere needs a person's confirmation before it is resumed. The mark is the HMAC of the file
with the request (run.json, study.toml); its key is random and stays in the user's settings folder.
"""

from __future__ import annotations

import contextlib
import hmac
import os
import secrets
from collections.abc import Iterable
from pathlib import Path

from platformdirs import user_config_path

from aidsr.core.errors import UserError
from aidsr.runs.files import replace_file

MARK = ".origin"
"""Name of the file with the mark, in the same folder as the marked file."""
_KEY_BYTES = 32


class ForeignFolderError(UserError):
    """A folder was not made on this machine, and the user has not confirmed that it may be resumed."""


def mark_as_ours(asked: Path) -> None:
    """Mark a folder as made or confirmed on this machine.

    If the settings folder cannot be written, no mark is made, and resuming will require confirmation.

    Args:
        asked: File with the request (run.json, study.toml) in the folder to mark.
    """
    key = _key(make=True)
    if key:
        replace_file(asked.parent / MARK, _digest(key, asked).encode())


def is_ours(asked: Path) -> bool:
    """Whether the folder of `asked` was marked on this machine and `asked` has not changed since."""
    key = _key(make=False)
    try:
        mark = (asked.parent / MARK).read_bytes()
    except FileNotFoundError:
        return False
    return bool(key) and hmac.compare_digest(mark, _digest(key, asked).encode())


def require_ours(asked: Path, destinations: Iterable[str], *, trust: bool) -> None:
    """Refuse to resume a folder that was not made here, unless the user trusts it; a trusted folder is marked.

    Args:
        asked: File with the request (run.json, study.toml).
        destinations: Where prompts are sent, in words; see `aidsr.teams.providers.destination`. Empty ones are ignored;
            without any, no data leaves this process and nothing is refused.
        trust: Whether the user confirmed that the folder may be resumed.

    Raises:
        ForeignFolderError: The folder was not made here, data would leave this process, and `trust` is false.
    """
    where = "; ".join(dict.fromkeys(filter(None, destinations)))
    if not where or is_ours(asked):
        return
    if not trust:
        raise ForeignFolderError(
            f"{asked.parent} was not made here, or {asked.name} was changed since. Resuming it sends prompts to "
            f"{where}. Read {asked.name}; if that is what you want, resume it with --trust"
        )
    mark_as_ours(asked)


def _digest(key: bytes, asked: Path) -> str:
    return hmac.new(key, asked.read_bytes(), "sha256").hexdigest()


def _key(*, make: bool) -> bytes:
    """Return the key of this user on this machine; empty where there is none or it cannot be created."""
    path = user_config_path("aidsr") / "origin_key"
    with contextlib.suppress(OSError):
        if make and not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
            with os.fdopen(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
                file.write(secrets.token_bytes(_KEY_BYTES))
            with contextlib.suppress(FileExistsError):
                os.link(temporary, path)  # the first of two processes wins
            temporary.unlink()
        content = path.read_bytes()
        return content if len(content) == _KEY_BYTES else b""
    return b""
