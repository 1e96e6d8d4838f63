"""Prompts: Markdown files in this folder, rendered by jinja2."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from aidsr.core.artifacts import Artifact


def render(prompt: str, **values: Any) -> str:
    """Return the text of the prompt file `prompt`.md with values filled in.

    Raises:
        jinja2.UndefinedError: A value that the file uses is missing.
    """
    return _templates().get_template(f"{prompt}.md").render(**values)


def as_json(artifact: Artifact, *exclude: str, defaults: bool = False) -> str:
    """Return an artifact as JSON with one field per line; fields with default values only if `defaults` is set."""
    values = artifact.model_dump(mode="json", exclude_defaults=not defaults, exclude=set(exclude))
    fields = ",\n".join(
        f"  {json.dumps(key)}: {json.dumps(value, ensure_ascii=False)}" for key, value in values.items()
    )
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
