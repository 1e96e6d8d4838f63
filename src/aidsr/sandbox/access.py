"""Files that a child process may open, in addition to system files and its private folder."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, is_dataclass, replace
from pathlib import Path
from typing import Any, Self

from pydantic import BaseModel

from aidsr.sandbox.environment import INSIDE
from aidsr.sandbox.landlock import give_up_files_and_network

_SYSTEM = (
    *("/usr", "/lib", "/lib32", "/lib64", "/bin", "/sbin", "/etc", "/opt", "/proc", "/sys", "/run/opengl-driver"),
    *("/var/cache/fontconfig", "/nix", "/gnu", "/snap"),
)
"""Folders from which libraries are loaded, and that describe the machine. Home directories and temporary files of
others are not included."""
_DEVICES = ("null", "zero", "full", "random", "urandom", "tty", "dri/*", "nvidia*")
"""Devices below /dev; the last two are for rendering."""


@dataclass(frozen=True)
class Access:
    """Files and folders that a call may open; all paths are absolute.

    Attributes:
        modules: Folders of the module search path, readable.
        read: Readable files.
        write: Readable and writable folders, with everything below them.
    """

    modules: frozenset[str] = frozenset()
    read: frozenset[str] = frozenset()
    write: frozenset[str] = frozenset()

    @classmethod
    def needed(cls, module_path: Iterable[str], arguments: tuple[Any, ...]) -> Self:
        """Return the access that a call needs: write access to folders among its arguments, read access to files."""
        paths = list(_paths(arguments))
        return cls(
            modules=frozenset(module_path),
            read=frozenset(str(path) for path in paths if path.is_file()),
            write=frozenset(str(path) for path in paths if path.is_dir()),
        )

    def suffices_for(self, needed: Access) -> bool:
        """Return whether a child with this access can serve a call that needs `needed`, and has no access beyond it.

        Additional folders of modules are allowed.
        """
        return self.modules >= needed.modules and (self.read, self.write) == (needed.read, needed.write)

    def to_json(self) -> str:
        """Return the access as JSON text for `from_json`."""
        return json.dumps({name: sorted(paths) for name, paths in asdict(self).items()})

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Return the access that `to_json` wrote."""
        return cls(**{name: frozenset(paths) for name, paths in json.loads(text).items()})

    def give_up_everything_else(self) -> None:
        """Permanently give up access to all other files in this child process, where the kernel has Landlock."""
        private = Path(os.environ[INSIDE])
        python = (sys.prefix, sys.base_prefix, sys.exec_prefix, sys.base_exec_prefix, *sys.path)
        variables = (path for value in os.environ.values() for path in value.split(os.pathsep))
        give_up_files_and_network(
            readable=[
                path for path in (*_SYSTEM, *python, *variables, *self.modules, *self.read) if Path(path).is_absolute()
            ],
            writable=[private, *self.write],
            devices=[device for pattern in _DEVICES for device in Path("/dev").glob(pattern)],
            emptied=private.parent,
        )


def _paths(value: Any) -> Iterator[Path]:
    """Yield all paths in a value, including those in nested models, mappings and sequences."""
    if isinstance(value, Path):
        yield value
    elif isinstance(value, BaseModel) or is_dataclass(value):
        yield from _paths(list(vars(value).values()))
    elif isinstance(value, Mapping):
        yield from _paths(list(value.values()))
    elif isinstance(value, (list, tuple, set, frozenset)):
        for one in value:
            yield from _paths(one)


def with_absolute_paths(value: Any) -> Any:
    """Return a value with absolute paths, also in nested models, mappings and sequences; unchanged if all are so."""
    if isinstance(value, Path):
        return value.absolute()
    if all(path.is_absolute() for path in _paths(value)):
        return value
    if isinstance(value, BaseModel):
        return value.model_copy(update=with_absolute_paths(dict(vars(value))))
    if isinstance(value, Mapping):
        return {key: with_absolute_paths(one) for key, one in value.items()}
    if isinstance(value, (list, tuple, set, frozenset)):
        return type(value)(with_absolute_paths(one) for one in value)
    return replace(value, **with_absolute_paths(dict(vars(value))))  # a dataclass: nothing else has paths


NOTHING = Access()
"""Access to no files except system files and the private folder."""
