"""The JSON that `aidsr validate --json` prints for a file, and its schema for programs that read it."""

from __future__ import annotations

from json import dumps
from typing import Literal

from pydantic import ConfigDict

from aidsr.core.artifacts import Repairs, ValidationReport
from aidsr.validation.fidelity import FidelityReport


class FileReport(ValidationReport):
    """The report on one file: the fields of `aidsr.validate`'s report, and the results of further options."""

    model_config = ConfigDict(json_schema_serialization_defaults_required=True, use_attribute_docstrings=True)

    schema_version: Literal[1] = 1
    """Version of this format. It is increased when a field changes its meaning or is removed, not for new fields."""
    file: str = "-"
    """Path of the file as given in the command; "-" is standard input."""
    repairs: Repairs | None = None
    """Changes that `--repair` made before validation; null without `--repair`."""
    fidelity: FidelityReport | None = None
    """Accuracy of the simulation; null without `--fidelity` or if the file cannot be loaded."""


def schema_text() -> str:
    """Return the JSON schema of `FileReport`, the content of `docs/validation-schema.json`."""
    schema = FileReport.model_json_schema(mode="serialization")
    return dumps({"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}, indent=2) + "\n"
