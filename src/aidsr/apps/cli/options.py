"""Options of the command line, derived from the fields of a configuration, with their help, bounds and defaults."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field as dataclass_field
from dataclasses import fields, make_dataclass
from typing import Annotated, Any, ClassVar, Generic, TypeVar

from cyclopts import Parameter
from cyclopts.validators import Number
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from aidsr.core.config import RunConfig, bounds

Config = TypeVar("Config", bound=BaseModel)
_NUMBER = {"ge": "gte", "gt": "gt", "le": "lte", "multiple_of": "modulo"}
"""Names of the bounds in cyclopts' validator `Number`, by their names in pydantic."""


class Options(Generic[Config]):
    """Values of command-line options; `options_for` makes the dataclass that holds them."""

    kind: ClassVar[type[BaseModel]]

    @property
    def given(self) -> dict[str, Any]:
        """All values by field name, including defaults."""
        return {each.name: getattr(self, each.name) for each in fields(self)}  # type: ignore[arg-type]

    def value(self, **more: Any) -> Config:
        """Return the configuration that the options describe.

        Args:
            **more: Values of fields that are not options.
        """
        return self.kind.model_validate({**self.given, **more})  # type: ignore[return-value]


def options_for(
    kind: type[BaseModel],
    settings: Mapping[str, FieldInfo] | None = None,
    name: Callable[[str], str | None] = lambda _field: None,
) -> Any:
    """Return a dataclass, for use by cyclopts, with one option for each field of a configuration.

    Args:
        kind: Class of the configuration.
        settings: Fields that become options; default: all. A field that is itself a configuration is left out.
        name: Returns the name of the option of a field, or None to derive it from the name of the field.
    """
    chosen = kind.model_fields if settings is None else settings
    options = [
        (key, Annotated[field.annotation, option(field, name(key))], dataclass_field(default=field.default))
        for key, field in chosen.items()
        if not (isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel))
    ]
    made = make_dataclass(
        f"{kind.__name__}Options",
        options,
        bases=(Options,),
        namespace={"kind": kind, "__module__": __name__},
        frozen=True,
    )
    return Parameter(name="*")(made)


def option(field: FieldInfo, name: str | None = None) -> Parameter:
    """Return the cyclopts parameter of a configuration field."""
    limits: Any = {_NUMBER[key]: value for key, value in bounds(field).items()}
    is_switch = field.annotation is bool and field.default is False
    return Parameter(
        name=name,
        help=field.description,
        validator=Number(**limits) if limits else None,
        negative="" if is_switch else None,
        show_default=False if is_switch or field.default == "" else None,
    )


def setting(name: str) -> Parameter:
    """Return the cyclopts parameter of a run setting, for a command that has only some of the settings."""
    return option(RunConfig.model_fields[name])
