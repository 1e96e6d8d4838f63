"""Pages of the manual, where AID-SR runs from its source tree."""

from __future__ import annotations

from pathlib import Path

DOCS = Path(__file__).parents[3] / "docs"
"""Folder of the manual; it exists only if AID-SR runs from its source tree."""
NO_DOCS = "the manual is not installed here; its pages are in the folder docs of the sources"


def docs_pages() -> dict[str, Path]:
    """Return the pages of the manual by name, such as "goals"; empty where it is not installed."""
    return {page.stem: page for page in sorted(DOCS.glob("*.md"))}


def docs_title(page: Path) -> str:
    """Return the title of a page of the manual."""
    return page.read_text(encoding="utf-8").partition("\n")[0].lstrip("# ")
