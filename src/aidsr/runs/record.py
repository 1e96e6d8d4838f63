"""The request of a run: the content of run.json, which is written once when the run is created and never changed."""

from __future__ import annotations

from typing import Literal

from aidsr.core.artifacts import Artifact
from aidsr.core.config import RunConfig


class RunRecord(Artifact):
    """Everything that was requested of a run."""

    objective: str
    task: str = ""
    """Name of the benchmark task; empty for a free-text objective."""
    level: Literal["", "standard", "hard"] = ""
    """Level of the task; empty without a task."""
    config: RunConfig
    model_object: bool = False
    """Whether `config.model` names a model object that a script passed and must pass again to resume the run."""
    started: str
    """Time when the run was created, ISO 8601 with UTC offset."""
    versions: dict[str, str]
    """Versions of AID-SR, Python and the libraries that influence results."""
