"""What a stage of a task asks for, as a number against its limit, for whoever reads how far an episode came."""

from __future__ import annotations

from dataclasses import dataclass

from aidsr.tasks.readings import FloatArray


@dataclass(frozen=True)
class Condition:
    """One number that a stage or the success of a task is made of, in n simulations at one moment."""

    name: str
    """What it is, as "share of the body that lies on the surface"."""
    value: FloatArray
    """(n,)."""
    limit: float | FloatArray
    """From which it holds, for all or each, (n,)."""
    at_least: bool = True
    """Whether it holds from the limit upwards; else downwards."""
    unit: str = ""
    """Of value and limit; empty for a number without one."""
