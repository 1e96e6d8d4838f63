"""Files that a person names for the output of a command."""

from __future__ import annotations

from pathlib import Path

from aidsr.core.errors import UserError


def write_output(path: Path, text: str) -> None:
    """Put text into a file in one step, so that a full disk leaves what was there; a link is followed.

    Raises:
        UserError: It cannot be written.
    """
    from aidsr.runs.files import replace_file

    target = path.resolve()
    if not target.parent.is_dir():
        raise UserError(f"cannot write {path}: the folder {path.parent} does not exist")
    replace_file(target, text.encode())
