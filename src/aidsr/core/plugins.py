"""Plug-ins: tasks, rules, robot families and providers that other packages add by entry points.

Each kind of plug-in has one `PluginGroup`, defined beside the built-in ones; docs/add_a_rule.md shows a package that
adds a rule.
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
    """The object that an entry point adds, and the package it comes from."""

    name: str
    value: T
    package: str
    version: str


@dataclass(frozen=True, kw_only=True)
class PluginGroup(Generic[T]):
    """A group of entry points; the name of an entry point must equal the name of the object that it adds."""

    group: str
    """Name of the group, for example "aidsr.rules"."""
    noun: str
    """Noun for the added objects in messages, for example "rule"."""
    kind: type
    """Class of the added objects."""
    is_subclass: bool = False
    """Whether the added objects are subclasses of `kind` instead of instances."""
    name_attribute: str = "name"
    """Attribute of the object that must equal the name of the entry point."""
    builtin: Callable[[], Collection[str]]
    """Returns the names of the built-in objects, which plug-ins cannot use."""
    find_fault: Callable[[T], str] = lambda _: ""
    """Returns what else is wrong with an added object; empty if nothing."""

    def entries(self) -> list[EntryPoint]:
        """Return the entry points of installed packages, sorted by name; nothing is imported."""
        return sorted(entry_points(group=self.group), key=lambda entry: entry.name)

    def load(self, entry: EntryPoint) -> Plugin[T]:
        """Load an entry point and return what it adds.

        Raises:
            UserError: It cannot be imported, has the wrong kind or another name, or its name is already used.
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
        """Load all entry points of installed packages and return what they add, sorted by name.

        Raises:
            UserError: An entry point cannot be loaded, or its name is already used.
        """
        return [self.load(entry) for entry in self.entries()]

    def load_named(self, name: str) -> T | None:
        """Load only the entry point with this name and return the added object; None if there is no such entry point.

        Raises:
            UserError: The entry point cannot be loaded, or its name is already used.
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
