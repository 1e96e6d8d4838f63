"""Addresses of pages and files of the web app."""

from __future__ import annotations

from urllib.parse import quote, urlencode


def run_address(run: str) -> str:
    """Return the address of the page of a run."""
    return f"/run/{quote(run)}"


def design_address(run: str, number: int, **choices: str | int) -> str:
    """Return the address of the page of a design.

    Args:
        run: Name of the run.
        number: Number of the design.
        **choices: What the page shows: its `tab`, or the number of an `iteration`.
    """
    return f"{run_address(run)}/{number}" + (f"?{urlencode(choices)}" if choices else "")


def export_address(run: str, number: int) -> str:
    """Return the address of the page that exports a design."""
    return f"{design_address(run, number)}/export"


def job_address(run: str, number: int, kind: str) -> str:
    """Return the address of the page that shows a training, probe or export of a design."""
    return export_address(run, number) if kind == "export" else design_address(run, number, tab=kind)


def study_address(key: str) -> str:
    """Return the address of the page of a study."""
    return f"/study/{quote(key)}"


def report_address(key: str) -> str:
    """Return the address of the report of a study."""
    return f"/studies/{quote(key)}/report"


def file_address(run: str, path: str, *, version: str = "") -> str:
    """Return the address of a file of a run; empty for an empty path."""
    return f"/files/{quote(run)}/{quote(path)}" + (f"?v={quote(version)}" if version else "") if path else ""


def thumbnail_address(run: str, path: str) -> str:
    """Return the address of a small copy of a run's picture, for lists; empty for an empty path."""
    return f"/thumbnails/{quote(run)}/{quote(path)}" if path else ""


def download_address(run: str, number: int, *, export: bool = False) -> str:
    """Return the address of the ZIP file of a design, or of its export."""
    return f"/download/{quote(run)}/{number}" + "/export" * export


def sheet_address(run: str, number: int) -> str:
    """Return the address of the assembly sheet of a design."""
    return f"/sheet/{quote(run)}/{number}"
