"""Whether a folder was made here, by a mark that nobody else can write.

A run or study folder decides which server is asked, which key goes there and where prompts are written. So one that
came from elsewhere is shown to a person before it is resumed. The mark is the HMAC of the file that holds what was
asked (run.json, study.toml); its key is random and stays in the user's own settings folder.
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
"""File beside the marked one."""
_KEY_BYTES = 32


class ForeignFolderError(UserError):
    """A folder was not made here, and nobody has confirmed yet that it may be resumed."""


def mark_as_ours(asked: Path) -> None:
    """Mark the folder of `asked`, the file that holds what was asked, as made or confirmed here.

    Where the settings folder cannot be written there is no mark, and resuming will ask for confirmation.
    """
    key = _key(make=True)
    if key:
        replace_file(asked.parent / MARK, _digest(key, asked).encode())


def is_ours(asked: Path) -> bool:
    """Whether the folder of `asked` was marked here, and `asked` is what it was then."""
    key = _key(make=False)
    try:
        mark = (asked.parent / MARK).read_bytes()
    except FileNotFoundError:
        return False
    return bool(key) and hmac.compare_digest(mark, _digest(key, asked).encode())


def require_ours(asked: Path, destinations: Iterable[str], *, trust: bool) -> None:
    """Refuse to resume what was not made here, unless its user trusts it; then it is marked and not asked about again.

    Args:
        asked: The file that holds what was asked.
        destinations: Where its prompts go, in words; see `aidsr.teams.providers.destination`. None: nothing leaves.
        trust: Whether its user confirmed that.

    Raises:
        ForeignFolderError: It was not made here, something leaves this process, and `trust` is false.
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
    """Return the key of this user on this machine; empty where there is none and none can be made."""
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
