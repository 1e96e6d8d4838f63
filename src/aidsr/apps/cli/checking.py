"""Processing of one file by `aidsr validate`: repair, validate, write."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from aidsr.apps.cli.input_files import STANDARD_INPUT, read_standard_input
from aidsr.apps.cli.output_file import write_output
from aidsr.core.artifacts import ValidationReport
from aidsr.core.errors import UserError
from aidsr.fixes import fix
from aidsr.mjcf.read import open_mjcf
from aidsr.validation import validate
from aidsr.validation.fidelity import check_fidelity
from aidsr.validation.json_report import FileReport
from aidsr.validation.page import GENERATOR, TracedReport, page_html, trace_report

_HEAD_BYTES = 400
"""Number of bytes at the start of an HTML report that contain the name of the program that wrote it."""


@dataclass(frozen=True)
class Check:
    """Options of `aidsr validate` for checking a file."""

    mount: Literal["auto", "fixed", "free"] = "auto"
    needs_contact: bool = False
    realizable: bool = False
    fidelity: bool = False
    repair: Path | None = None
    """Output file of the repaired text; None to check the text without repairs."""
    page: Path | None = None
    """Output file of the HTML report; None to write none."""
    select: tuple[str, ...] = ()
    """Codes of the rules to apply; empty for all rules."""
    ignore: tuple[str, ...] = ()
    """Codes of the rules not to apply."""

    def run(self, file: str) -> FileReport:
        """Check one file. A repaired text is written before it is validated.

        Raises:
            UserError: The file cannot be read, or an output file cannot be written.
            MjcfError: The file is too large.
        """
        text = read_standard_input() if file == STANDARD_INPUT else Path(file)
        repairs = None
        if self.repair is not None:
            answer = fix(_opened(text))
            text, repairs = answer.mjcf, answer.repairs
            write_output(self.repair, text)
        shown = self._trace(_opened(text)) if self.page is not None else None
        report = shown.report if shown is not None else self._validated(text)
        loads = not any(fault.layer == "load" for fault in report.errors)
        trust = check_fidelity(text) if self.fidelity and loads else None
        if shown is not None and self.page is not None:
            name = "standard input" if file == STANDARD_INPUT else Path(file).name
            page = page_html(_opened(text), shown, file=name, repairs=repairs, fidelity=trust)
            write_output(self.page, page)
        return FileReport(**dict(report), file=file, repairs=repairs, fidelity=trust)

    def _validated(self, text: str | Path) -> ValidationReport:
        return validate(text, **self._options)

    def _trace(self, mjcf: str) -> TracedReport:
        return trace_report(mjcf, **self._options)

    @property
    def _options(self) -> dict[str, Any]:
        return {
            "mount": self.mount,
            "needs_contact": self.needs_contact,
            "realizable": self.realizable,
            "select": self.select,
            "ignore": self.ignore,
        }


def _opened(text: str | Path) -> str:
    return open_mjcf(text) if isinstance(text, Path) else text


def refuse_to_overwrite(path: Path, *, option: str) -> None:
    """Check that an output file does not exist yet, or is an HTML report that this command wrote.

    Raises:
        UserError: Another file exists at this path.
    """
    if path.exists() and not _is_our_page(path):
        raise UserError(f"{option}: {path} exists; name another file, or add --force to replace it")


def _is_our_page(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return f'content="{GENERATOR}"'.encode() in file.read(_HEAD_BYTES)
    except OSError:
        return False
