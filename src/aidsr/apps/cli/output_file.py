"""Writing of output files that a user names."""

from __future__ import annotations

from pathlib import Path

from aidsr.core.errors import UserError


def require_output(path: Path, *, option: str, suffix: str) -> None:
    """Check, before work that may take minutes, that an output file has the right kind of name and a folder.

    Raises:
        UserError: The name does not end in the suffix, is that of a folder, or names a folder that does not exist.
    """
    kind = suffix.removeprefix(".").upper()
    if path.suffix.lower() != suffix:
        raise UserError(f"{option} {path} is not a {kind} file; give a file name that ends in {suffix}")
    if path.is_dir():
        raise UserError(f"{option} {path} is a folder; give the name of a {kind} file")
    if not path.parent.is_dir():
        raise UserError(f"cannot write {path}: the folder {path.parent} does not exist")


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
