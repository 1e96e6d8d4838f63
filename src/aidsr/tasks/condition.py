"""Requirements of a task's stages: measured values with their limits, to report how far an episode came."""

from __future__ import annotations

from dataclasses import dataclass

from aidsr.tasks.readings import FloatArray


@dataclass(frozen=True)
class Condition:
    """One measured value that a stage or the success of a task depends on, in n simulations at one moment."""

    name: str
    """Description of the value, such as "share of the body that lies on the surface"."""
    value: FloatArray
    """Measured value, (n,)."""
    limit: float | FloatArray
    """Limit, one for all simulations or one for each, (n,)."""
    at_least: bool = True
    """Whether the condition holds from the limit upwards; otherwise from the limit downwards."""
    unit: str = ""
    """Unit of value and limit; empty for a dimensionless number."""
