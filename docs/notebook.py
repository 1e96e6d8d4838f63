"""MkDocs hook: show the notebook docs/tutorial.ipynb as a page, with the pictures in it."""

from __future__ import annotations

import base64
import json
import textwrap
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

_NOTEBOOK = "tutorial.ipynb"
_WIDTH = 78
"""Columns of an output that fit beside the navigation. Our choice."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add tutorial.md and its pictures, made of the notebook's cells and outputs."""
    notebook = files.get_file_from_path(_NOTEBOOK)
    if notebook is None:
        return files
    text, pictures = as_markdown(json.loads(notebook.content_string))
    files.append(File.generated(config, "tutorial.md", content=text))
    for name, picture in pictures.items():
        files.append(File.generated(config, name, content=picture))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Point links to the notebook, which GitHub shows, to the page made of it."""
    return markdown.replace(f"({_NOTEBOOK})", "(tutorial.md)")


def as_markdown(notebook: dict[str, Any]) -> tuple[str, dict[str, bytes]]:
    """Return a notebook as Markdown, and its pictures by file name."""
    parts: list[str] = []
    pictures: dict[str, bytes] = {}
    for cell in notebook["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
            continue
        parts.append(f"```python\n{source}\n```")
        for output in cell["outputs"]:
            data = output.get("data", {})
            kind = next((kind for kind in ("image/png", "image/webp", "image/jpeg") if kind in data), None)
            if kind is not None:
                name = f"images/tutorial-{len(pictures) + 1}.{kind.partition('/')[2]}"
                pictures[name] = base64.b64decode("".join(data[kind]))
                parts.append(f"![Output of the cell above]({name})")
            else:
                lines = "".join(output.get("text", data.get("text/plain", ""))).splitlines()
                wrapped = "\n".join(textwrap.fill(line, _WIDTH, subsequent_indent="  ") for line in lines)
                parts.append(f"```text\n{wrapped}\n```")
    return "\n\n".join(parts) + "\n", pictures
