"""What the page shows beside the report: values over time, as the worker hands them out."""

from __future__ import annotations

from aidsr.core.artifacts import Artifact


class Line(Artifact):
    """One curve."""

    label: str
    values: tuple[float, ...]


class Signal(Artifact):
    """What a fault was read off, over the time of one test."""

    quantity: str
    unit: str
    test: str
    """The test, in words."""
    time_s: tuple[float, ...]
    lines: tuple[Line, ...]
    limits: tuple[float, ...] = ()
    first_bad_s: float | None = None
    logarithmic: bool = False
    """For what grows out of all proportion."""


class ActuatorTrace(Artifact):
    """What one actuator did in its own test, everything else slack."""

    name: str
    pulls: str
    """Tendon or joint it acts on."""
    low: float
    high: float
    effect: float
    """Largest displacement it causes alone / L."""
    tension_n: float
    """Greatest pull in any test."""
    stroke_m: float
    time_s: tuple[float, ...] = ()
    displacement: tuple[float, ...] = ()
    """Largest displacement of any point / L, over time."""
    force_n: tuple[float, ...] = ()
    """Its pull, over time."""
