"""What `aidsr validate --json` prints for a file, and its schema, for programs that read it."""

from __future__ import annotations

from json import dumps
from typing import Literal

from pydantic import ConfigDict

from aidsr.core.artifacts import Repairs, ValidationReport
from aidsr.validation.fidelity import FidelityReport


class FileReport(ValidationReport):
    """The report on one file: everything that `aidsr.validate` returns, and what else was asked for."""

    model_config = ConfigDict(json_schema_serialization_defaults_required=True, use_attribute_docstrings=True)

    schema_version: Literal[1] = 1
    """Raised when a field changes its meaning or goes away; new fields may come without."""
    file: str = "-"
    """As it was named in the command; "-" is standard input."""
    repairs: Repairs | None = None
    """What `--repair` changed before validating; null where it was not asked for."""
    fidelity: FidelityReport | None = None
    """How far the simulation can be trusted; null where it was not asked for or the file cannot be loaded."""


def schema_text() -> str:
    """Return the JSON schema of `FileReport`, which `docs/validation-schema.json` holds."""
    schema = FileReport.model_json_schema(mode="serialization")
    return dumps({"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}, indent=2) + "\n"
