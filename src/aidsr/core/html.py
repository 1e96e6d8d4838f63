"""Self-contained HTML pages: a common loader for their templates, and one base page with its style."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Template


def html_template(file: Path, **filters: Callable[..., Any]) -> Template:
    """Return the template in a file, which may extend `base.html.j2` beside this module.

    Inserted values are escaped; a missing value is an error.

    Args:
        file: File of the template.
        filters: Functions that the template may use, by name.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader([file.parent, Path(__file__).parent]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(filters)
    return environment.get_template(file.name)
