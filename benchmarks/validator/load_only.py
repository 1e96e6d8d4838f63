"""The validator without its driven tests, for fuzzing thousands of documents."""

from __future__ import annotations

from aidsr.core.artifacts import ValidationReport
from aidsr.sandbox.isolated import isolated
from aidsr.sandbox.limits import Limits


@isolated(limits=Limits(wall_s=30.0, cpu_s=30.0, memory_mib=3072))
def load_only(text: str) -> ValidationReport:
    """Return the report on an MJCF text, as far as it follows from the compiled model."""
    from aidsr.validation.engine import examine_text

    return examine_text(text, drive=False).report
