"""Writing of output files that a user names."""

from __future__ import annotations

from pathlib import Path

from aidsr.core.errors import UserError


def write_output(path: Path, text: str) -> None:
    """Replace the content of a file atomically, so that a full disk leaves the old content; a link is followed.

    Raises:
        UserError: The file cannot be written.
    """
    from aidsr.runs.files import replace_file

    target = path.resolve()
    if not target.parent.is_dir():
        raise UserError(f"cannot write {path}: the folder {path.parent} does not exist")
    replace_file(target, text.encode())
