"""Write-once files.

A file of a run is either absent or complete: its content is written to a temporary file in the same folder, flushed to
disk, and then renamed. If the process is killed, at most a temporary file is left, which is ignored.
"""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from pydantic import TypeAdapter, ValidationError

from aidsr.core.artifacts import Robot, Scene
from aidsr.core.errors import UserError
from aidsr.core.storage_errors import storage_errors

Value = TypeVar("Value")
Drawn = TypeVar("Drawn", Robot, Scene)


class WrittenTwiceError(UserError):
    """A write-once file exists with other content: it was edited, or two processes work on the same run."""


def write_once(path: Path, content: bytes) -> None:
    """Write a file that must never change; writing the same content again does nothing.

    Raises:
        WrittenTwiceError: The file exists with other content.
    """
    if path.exists():
        if path.read_bytes() == content:
            return
        raise WrittenTwiceError(
            f"{path} is written once and holds something else than what belongs there: it was changed by hand, or "
            "another process works on the same run; restore it, or start the design again"
        )
    replace_file(path, content)


def replace_file(path: Path, content: bytes) -> None:
    """Write a file atomically, replacing an existing one. For files computed from others, such as summary.html.

    Raises:
        StorageError: The file cannot be written, as on a full disk; an existing file is unchanged.
    """
    with storage_errors(path):
        _replace(path, content)


def _replace(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        Path(temporary).chmod(stat.S_IMODE(path.stat().st_mode) if path.exists() else 0o644)
        Path(temporary).replace(path)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            Path(temporary).unlink()
        raise


class Stored(Protocol[Value]):
    """A value that is stored in a file of a run."""

    def read(self) -> Value | None:
        """Return the value, or None if the file does not exist."""
        ...

    def write(self, value: Value) -> None:
        """Write the value; see `write_once`."""
        ...


@dataclass(frozen=True)
class BytesFile:
    """A file of unstructured content, such as a picture or an MJCF text."""

    path: Path

    def read(self) -> bytes | None:
        """Return the bytes, or None if the file does not exist.

        Raises:
            StorageError: The file cannot be read, as without the permission.
        """
        try:
            with storage_errors(self.path):
                return self.path.read_bytes()
        except FileNotFoundError:
            return None

    def read_text(self) -> str | None:
        """Return the text, or None if the file does not exist.

        Raises:
            UserError: The file is not UTF-8 text.
        """
        content = self.read()
        try:
            return None if content is None else content.decode()
        except UnicodeDecodeError:
            raise UserError(f"{self.path} is not UTF-8 text; restore or remove it") from None

    def write(self, value: bytes) -> None:
        """Write the bytes; see `write_once`."""
        write_once(self.path, value)


@dataclass(frozen=True)
class JsonFile(Generic[Value]):
    """One artifact, or a tuple of them, as indented JSON."""

    path: Path
    kind: type[Value]

    def read(self) -> Value | None:
        """Return the artifact, or None if the file does not exist.

        Raises:
            UserError: The file does not contain a valid artifact of this kind.
            StorageError: The file cannot be read, as without the permission.
        """
        content = BytesFile(self.path).read()
        if content is None:
            return None
        return _valid(self.path, lambda: TypeAdapter(self.kind).validate_json(content))

    def write(self, value: Value) -> None:
        """Write the artifact; see `write_once`."""
        write_once(self.path, TypeAdapter(self.kind).dump_json(value, indent=2) + b"\n")


@dataclass(frozen=True)
class MjcfFile(Generic[Drawn]):
    """A robot or a scene: its MJCF in `stem`.xml and all other fields in `stem`.json.

    The XML is written last, so a robot or scene exists if and only if its XML file does.
    """

    folder: Path
    stem: str
    kind: type[Drawn]

    @property
    def xml(self) -> BytesFile:
        """The MJCF text."""
        return BytesFile(self.folder / f"{self.stem}.xml")

    @property
    def json(self) -> JsonFile[dict[str, Any]]:
        """The artifact without its MJCF."""
        return JsonFile(self.folder / f"{self.stem}.json", dict[str, Any])

    def read(self) -> Drawn | None:
        """Return the robot or scene, or None if it does not exist.

        Raises:
            UserError: The XML is empty, as after a power failure, or not UTF-8 text, or the JSON file is invalid.
        """
        mjcf = self.xml.read_text()
        if mjcf is None:
            return None
        if not mjcf.strip():
            raise UserError(f"{self.xml.path} is empty; restore or remove it")
        whole = {**(self.json.read() or {}), "mjcf": mjcf}
        return _valid(self.json.path, lambda: self.kind.model_validate(whole))

    def write(self, value: Drawn) -> None:
        """Write both files; see `write_once`."""
        self.json.write(value.model_dump(mode="json", exclude={"mjcf"}))
        self.xml.write(value.mjcf.encode())


def _valid(path: Path, validate: Callable[[], Value]) -> Value:
    """Return the validated content of a file.

    Raises:
        UserError: The content is not valid.
    """
    try:
        return validate()
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or "the whole file"
        raise UserError(f"{path} cannot be read ({place}: {first['msg']}); restore or remove it") from None
