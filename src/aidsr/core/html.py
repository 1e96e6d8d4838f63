"""HTML pages that need nothing else: one environment for their templates, and one base page with its style."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jinja2 import Template


def html_template(file: Path, **filters: Callable[..., Any]) -> Template:
    """Return the template in a file, which may extend `base.html.j2` beside this module.

    What is put into it is escaped, and a value that is missing is an error.

    Args:
        file: The template.
        filters: Functions it may use, by name.
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
