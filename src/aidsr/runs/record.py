"""What was asked of a run: the content of run.json, written before anything else happens and never changed."""

from __future__ import annotations

from typing import Literal

from aidsr.core.artifacts import Artifact
from aidsr.core.config import RunConfig


class RunRecord(Artifact):
    """The identity of a run."""

    objective: str
    task: str = ""
    """Name of the benchmark task; empty for an objective in the user's own words."""
    level: Literal["", "standard", "hard"] = ""
    """Level of the task; empty without one."""
    config: RunConfig
    model_object: bool = False
    """Whether `config.model` is the name of an object that a script passed, which resuming has to pass again."""
    started: str
    """ISO 8601 with zone."""
    versions: dict[str, str]
    """Versions of AID-SR, Python and the libraries that shape a result."""
