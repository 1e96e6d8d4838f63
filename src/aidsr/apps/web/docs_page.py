"""The manual: its Markdown pages, with their pictures, where AID-SR runs from its source tree."""

from __future__ import annotations

import re

from nicegui import app, ui

from aidsr.apps.web.frame import frame
from aidsr.apps.web.run_page import not_found
from aidsr.apps.web.site import Site
from aidsr.core.documentation import DOCS, NO_DOCS, docs_pages, docs_title
from aidsr.core.errors import UserError
from aidsr.core.formatting import excerpt


def add_docs(site: Site) -> None:
    """Add the pages at /docs/NAME.md, so that links between them work as they are written, and their pictures."""
    if (DOCS / "images").is_dir():
        app.add_static_files("/docs/images", DOCS / "images")

    @ui.page("/docs/{name}.md")
    def docs_page(name: str) -> None:
        pages = docs_pages()
        if name not in pages:
            not_found(UserError(f'no page "{excerpt(name)}" in the manual' if pages else NO_DOCS))
            return
        title = docs_title(pages[name])
        with frame(title, ("Runs", "/"), ("Documentation", "/docs/index.md"), site=site, narrow=True):
            written = pages[name].read_text(encoding="utf-8")
            ui.markdown(_plain_fences(written), extras=["fenced-code-blocks", "tables", "header-ids"]).classes("docs")


def docs_address(page: str) -> str:
    """Return the address of a page of the manual; empty where the manual is not installed."""
    return f"/docs/{page}.md" if page in docs_pages() else ""


def _plain_fences(written: str) -> str:
    """Return Markdown whose code blocks have no titles, which only MkDocs knows."""
    return re.sub(r'^(```\w+) title="[^"]*"$', r"\1", written, flags=re.MULTILINE)
