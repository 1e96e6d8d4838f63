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
    from aidsr.fixes import fix
    from aidsr.loop.run import design, resume
    from aidsr.runs import Run
    from aidsr.tasks import Task, load_task
    from aidsr.validation import validate
    from aidsr.validation.fixing import fix_until_stable

__all__ = [
    "Model",
    "Run",
    "RunConfig",
    "Task",
    "__version__",
    "assemble",
    "design",
    "evaluate",
    "export",
    "fix",
    "fix_until_stable",
    "load_task",
    "probe",
    "resume",
    "train",
    "validate",
]

__version__ = "0.1.0"

_MODULES = {
    "Model": "aidsr.core.model",
    "Run": "aidsr.runs",
    "RunConfig": "aidsr.core.config",
    "Task": "aidsr.tasks",
    "assemble": "aidsr.api",
    "design": "aidsr.loop.run",
    "evaluate": "aidsr.api",
    "export": "aidsr.api",
    "fix": "aidsr.fixes",
    "fix_until_stable": "aidsr.validation.fixing",
    "load_task": "aidsr.tasks",
    "probe": "aidsr.api",
    "resume": "aidsr.loop.run",
    "train": "aidsr.api",
    "validate": "aidsr.validation",
}
"""Module that defines each public name."""


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'aidsr' has no attribute {name!r}; it offers {', '.join(__all__)}")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
