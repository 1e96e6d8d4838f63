"""Plug-ins: the tasks, rules, robot families and providers that other packages add by entry points.

Each kind has one `PluginGroup`, beside its built-in records; docs/add_a_rule.md shows a package that adds one.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Generic, TypeVar, cast

from aidsr.core.errors import UserError

T = TypeVar("T")


@dataclass(frozen=True)
class Plugin(Generic[T]):
    """What one entry point adds, and the package it comes from."""

    name: str
    value: T
    package: str
    version: str


@dataclass(frozen=True, kw_only=True)
class PluginGroup(Generic[T]):
    """A group of entry points; an entry's name is the name of what it adds."""

    group: str
    """For example "aidsr.rules"."""
    noun: str
    """What an entry adds, for messages: "rule"."""
    kind: type
    """The class that what is added must be an instance of, or a subclass of."""
    is_subclass: bool = False
    name_attribute: str = "name"
    """The attribute that must equal the entry's name."""
    builtin: Callable[[], Collection[str]]
    """Names that are taken."""
    find_fault: Callable[[T], str] = lambda _: ""
    """What else is wrong with it, empty if nothing."""

    def entries(self) -> list[EntryPoint]:
        """Return the entry points of installed packages by name; nothing is imported."""
        return sorted(entry_points(group=self.group), key=lambda entry: entry.name)

    def load(self, entry: EntryPoint) -> Plugin[T]:
        """Return what an entry point adds.

        Raises:
            UserError: It cannot be imported, is of another kind or has another name, or its name is taken.
        """
        package, version = (entry.dist.name, entry.dist.version) if entry.dist else (entry.value, "")
        if entry.name in self.builtin():
            raise UserError(f"duplicate {self.noun}: {entry.name} is built in; uninstall {package}")
        same = [other for other in self.entries() if other.name == entry.name]
        if len(same) > 1:
            packages = " and ".join(sorted({other.dist.name if other.dist else other.value for other in same}))
            raise UserError(f"duplicate {self.noun}: {entry.name} (of {packages}); uninstall all but one")
        try:
            value = entry.load()
            fault = self._fault(entry.name, value)
        except Exception as error:
            text = " ".join(str(error).split())
            raise self._cannot_load(entry, package, f"{type(error).__name__}: {text}") from error
        if fault:
            raise self._cannot_load(entry, package, fault)
        return Plugin(entry.name, cast("T", value), package, version)

    def load_all(self) -> list[Plugin[T]]:
        """Return what all installed packages add, by name.

        Raises:
            UserError: An entry point cannot be loaded, or its name is taken.
        """
        return [self.load(entry) for entry in self.entries()]

    def load_named(self, name: str) -> T | None:
        """Return what the entry point of that name adds, None where there is none; the others are not imported.

        Raises:
            UserError: The entry point cannot be loaded, or its name is taken.
        """
        return next((self.load(entry).value for entry in self.entries() if entry.name == name), None)

    def _fault(self, name: str, value: object) -> str:
        if self.is_subclass:
            if not (isinstance(value, type) and issubclass(value, self.kind)):
                return f"not a subclass of {self.kind.__name__}"
        elif not isinstance(value, self.kind):
            return f"{type(value).__name__} is not {self.kind.__name__}"
        own = getattr(value, self.name_attribute, None)
        if own != name:
            return f'its {self.name_attribute} is "{own}"; use one name'
        return self.find_fault(cast("T", value))

    def _cannot_load(self, entry: EntryPoint, package: str, fault: str) -> UserError:
        return UserError(
            f'cannot load {self.noun} "{entry.name}" of {package} ({fault}); update or uninstall that package'
        )
