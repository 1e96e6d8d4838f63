"""AID-SR: design tendon-driven continuum robots from a description in words.

Public names are imported on first use, so that `import aidsr` loads neither the simulator nor the client of a language
model. docs/api.md has a complete script, from an objective to a trained policy and parts. The tasks are also available
as Gymnasium environments: `gymnasium.make("aidsr.learn.rl:aidsr/ButtonPushing-v0", scene=…)`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from aidsr.api import assemble, evaluate, export, probe, train
    from aidsr.core.config import RunConfig
    from aidsr.core.model import Model
    from aidsr.evolution import Evolution, evolve
    from aidsr.fixes import fix
    from aidsr.loop.run import design, resume
    from aidsr.memory import Memory
    from aidsr.memory.collecting import lessons_of
    from aidsr.runs import Library, Run, read_status
    from aidsr.runs.trainings import trainings_of
    from aidsr.studies.benchmark import benchmark
    from aidsr.studies.comparison import compare
    from aidsr.studies.records import outcomes
    from aidsr.studies.study import Study, open_study
    from aidsr.tasks import Task, load_task
    from aidsr.validation import validate
    from aidsr.validation.fixing import fix_until_stable

__all__ = [
    "Evolution",
    "Library",
    "Memory",
    "Model",
    "Run",
    "RunConfig",
    "Study",
    "Task",
    "__version__",
    "assemble",
    "benchmark",
    "compare",
    "design",
    "evaluate",
    "evolve",
    "export",
    "fix",
    "fix_until_stable",
    "lessons_of",
    "load_task",
    "open_study",
    "outcomes",
    "probe",
    "read_status",
    "resume",
    "train",
    "trainings_of",
    "validate",
]

__version__ = "0.1.0"

_MODULES = {
    "Evolution": "aidsr.evolution",
    "Library": "aidsr.runs",
    "Memory": "aidsr.memory",
    "Model": "aidsr.core.model",
    "Run": "aidsr.runs",
    "RunConfig": "aidsr.core.config",
    "Study": "aidsr.studies.study",
    "Task": "aidsr.tasks",
    "assemble": "aidsr.api",
    "benchmark": "aidsr.studies.benchmark",
    "compare": "aidsr.studies.comparison",
    "design": "aidsr.loop.run",
    "evaluate": "aidsr.api",
    "evolve": "aidsr.evolution",
    "export": "aidsr.api",
    "fix": "aidsr.fixes",
    "fix_until_stable": "aidsr.validation.fixing",
    "lessons_of": "aidsr.memory.collecting",
    "load_task": "aidsr.tasks",
    "open_study": "aidsr.studies.study",
    "outcomes": "aidsr.studies.records",
    "probe": "aidsr.api",
    "read_status": "aidsr.runs",
    "resume": "aidsr.loop.run",
    "train": "aidsr.api",
    "trainings_of": "aidsr.runs.trainings",
    "validate": "aidsr.validation",
}
"""Module that defines each public name."""


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'aidsr' has no attribute {name!r}; it offers {', '.join(__all__)}")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
