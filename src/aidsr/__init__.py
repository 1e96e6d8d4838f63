"""AID-SR: design tendon-driven continuum robots from words.

The public names are resolved when they are first used, so that `import aidsr` loads neither the simulator nor a
language model's client.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from aidsr.core.config import RunConfig
    from aidsr.core.model import Model
    from aidsr.learn.openloop import probe
    from aidsr.loop.run import design, resume
    from aidsr.runs import Run
    from aidsr.tasks import Task, load_task
    from aidsr.validation import validate

__all__ = ["Model", "Run", "RunConfig", "Task", "__version__", "design", "load_task", "probe", "resume", "validate"]

__version__ = "0.1.0"

_HOMES = {
    "Model": "aidsr.core.model",
    "Run": "aidsr.runs",
    "RunConfig": "aidsr.core.config",
    "Task": "aidsr.tasks",
    "design": "aidsr.loop.run",
    "load_task": "aidsr.tasks",
    "probe": "aidsr.learn.openloop",
    "resume": "aidsr.loop.run",
    "validate": "aidsr.validation",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'aidsr' has no attribute {name!r}; it offers {', '.join(__all__)}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)
