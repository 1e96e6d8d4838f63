"""Import of a robot from several files into one self-contained MJCF document (`aidsr import`)."""

from __future__ import annotations

import hashlib
import os
import stat
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from aidsr.core.errors import UserError
from aidsr.mjcf.inline_files import MOST_INCLUDES, merge_includes, put_in_shapes, read_shape
from aidsr.mjcf.read import decode_mjcf

MOST_BYTES = 256 * 2**20
"""Largest size of all files together. Our choice: ten times the meshes of a large robot."""


@dataclass(frozen=True)
class ImportedFile:
    """A file that was read: its path relative to the folder, and the SHA-256 hash of its content."""

    path: str
    sha256: str


@dataclass(frozen=True)
class Imported:
    """A self-contained document that names no files.

    Attributes:
        mjcf: MJCF text.
        files: Files that were read.
        notes: Omissions and simplifications, one sentence each.
    """

    mjcf: str
    files: tuple[ImportedFile, ...]
    notes: tuple[str, ...]


def import_mjcf(path: Path, folder: Path | None = None) -> Imported:
    """Return the content of an MJCF file with its includes, meshes and height fields inlined.

    Only regular files below one folder are read. They are parsed in an isolated process that opens no files.

    Args:
        path: Path of the main document.
        folder: Folder that contains all files; by default the folder of the main document.

    Raises:
        UserError: A file is missing, outside the folder, too large, or cannot be read.
        MjcfError: The resulting document has faults; the error holds all of them.
        IsolationError: Reading the files exceeded the limits of time or memory.
    """
    files = _Files((folder or path.parent).resolve())
    main = files.path_of(path)
    base = PurePosixPath(main).parent
    text = decode_mjcf(files.read(main), str(path))
    included: dict[str, str] = {}
    for _ in range(MOST_INCLUDES):
        merged = merge_includes(text, included)
        if not merged.missing:
            break
        for name in merged.missing:
            included[name] = decode_mjcf(files.read(str(base / name)), name)
    else:
        raise UserError(f"{path} includes files more than {MOST_INCLUDES} deep")
    shapes = [read_shape(use, merged.mjcf, files.read(str(base / use.path))) for use in merged.uses]
    notes = (*merged.notes, *(shape.note for shape in shapes if shape.note))
    return Imported(put_in_shapes(merged, shapes), files.seen, notes)


class _Files:
    """Reader of regular files below a folder; links are not followed."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._hashes: dict[str, str] = {}
        self._bytes = 0

    @property
    def seen(self) -> tuple[ImportedFile, ...]:
        return tuple(ImportedFile(path, digest) for path, digest in self._hashes.items())

    def path_of(self, path: Path) -> str:
        """Return a path relative to the folder.

        Raises:
            UserError: The path is outside the folder.
        """
        absolute = path.parent.resolve() / path.name
        if not absolute.is_relative_to(self._folder):
            raise UserError(f"{path} is not in {self._folder}; name a folder that holds all files with --folder")
        return absolute.relative_to(self._folder).as_posix()

    def read(self, name: str) -> bytes:
        """Return the content of a file.

        Args:
            name: Path of the file relative to the folder.

        Raises:
            UserError: The file is missing, outside the folder, not a regular file or too large.
        """
        path = Path(os.path.normpath(self._folder / name))
        if not path.is_relative_to(self._folder):
            raise UserError(f"{name} is outside {self._folder}; name a folder that holds all files with --folder")
        if path.resolve() != path:
            raise UserError(f"{name} is or goes through a link; only regular files are read. Replace it by a copy")
        try:
            with os.fdopen(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)), "rb") as file:
                if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                    raise UserError(f"{name} is not a regular file; only regular files are read")
                content = file.read(MOST_BYTES - self._bytes + 1)
        except OSError as error:
            raise UserError(f"cannot read {name} in {self._folder}: {error.strerror}") from None
        self._bytes += len(content)
        if self._bytes > MOST_BYTES:
            raise UserError(f"the files have more than {MOST_BYTES:,} bytes together, the most that is read")
        self._hashes[path.relative_to(self._folder).as_posix()] = hashlib.sha256(content).hexdigest()
        return content
