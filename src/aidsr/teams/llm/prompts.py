"""Prompt texts: Markdown files beside this one, filled in by jinja2."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from aidsr.core.artifacts import Artifact

__all__ = ["as_json", "render"]


def render(prompt: str, **values: Any) -> str:
    """Return the text of the prompt file `prompt`.md with values filled in.

    Raises:
        jinja2.UndefinedError: The file asks for a value that is not given.
    """
    return _templates().get_template(f"{prompt}.md").render(**values)


def as_json(artifact: Artifact, *left_out: str, whole: bool = False) -> str:
    """Return an artifact as a model would write it, one field a line; what is only a default is said when `whole`."""
    said = artifact.model_dump(mode="json", exclude_defaults=not whole, exclude=set(left_out))
    fields = ",\n".join(f"  {json.dumps(key)}: {json.dumps(value, ensure_ascii=False)}" for key, value in said.items())
    return f"{{\n{fields}\n}}"


@cache
def _templates() -> Environment:
    return Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        undefined=StrictUndefined,
        autoescape=False,  # the texts are Markdown for a model, not HTML for a browser
        trim_blocks=True,
        lstrip_blocks=True,
    )
